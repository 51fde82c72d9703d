//! How a way turns, in junctions and between them.

use std::f32::consts::{PI, TAU};

use serde::Deserialize;

/// Turns of a way, in radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Bends {
    /// Of each junction that it leads through: heading behind it less heading before.
    pub junctions_rad: Vec<f32>,
    /// Between junctions: sum of all turns to either side.
    pub elsewhere_rad: f32,
}

impl Bends {
    /// - **Domain:** headings along a way, each with the junction there.
    pub(crate) fn of(way: impl Iterator<Item = (f32, Option<u32>)>) -> Self {
        let mut bends = Self::default();
        let (mut before, mut inside) = (None, None);
        for (heading_rad, at) in way {
            let Some((from_rad, from)) = before.replace((heading_rad, at)) else { continue };
            let turn_rad = wrapped(heading_rad - from_rad);
            let junction = at.or(from);
            match (junction, bends.junctions_rad.last_mut()) {
                (None, _) => bends.elsewhere_rad += turn_rad.abs(),
                (Some(_), Some(last)) if junction == inside => *last += turn_rad,
                (Some(_), _) => bends.junctions_rad.push(turn_rad),
            }
            inside = junction;
        }
        bends
    }

    /// Of all turns to either side.
    pub(crate) fn sum_rad(&self) -> f32 {
        let junctions_rad: f32 = self.junctions_rad.iter().map(|turn| turn.abs()).sum();
        junctions_rad + self.elsewhere_rad
    }
}

/// How often a way turns by an angle between two in junctions.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Turns {
    pub degrees: (f32, f32),
    /// At least and at most.
    pub count: (usize, usize),
    /// To which side; `None`: either.
    pub side: Option<Side>,
}

/// Where a turn leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Side {
    Left,
    Right,
}

impl Turns {
    /// Whether a way turns so often.
    pub(crate) fn hold(&self, bends: &Bends) -> bool {
        let (from, to) = self.degrees;
        let range = from.to_radians()..=to.to_radians();
        let fits = |turn: &&f32| match self.side {
            None => range.contains(&turn.abs()),
            Some(Side::Left) => range.contains(*turn),
            Some(Side::Right) => range.contains(&-**turn),
        };
        let found = bends.junctions_rad.iter().filter(fits).count();
        (self.count.0..=self.count.1).contains(&found)
    }
}

fn wrapped(angle_rad: f32) -> f32 {
    angle_rad - ((angle_rad + PI) / TAU).floor() * TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_count_by_junction_and_those_between_add_up() {
        let way = [
            (0.0, None),
            (0.1, None),
            (0.1, Some(1)),
            (0.9, Some(1)),
            (1.6, Some(1)),
            (1.6, None),
            (1.5, None),
            (1.5 + TAU, Some(2)),
        ];
        let bends = Bends::of(way.into_iter());
        assert_eq!(bends.junctions_rad.len(), 2);
        assert!((bends.junctions_rad[0] - 1.5).abs() < 1.0e-5);
        assert!(bends.junctions_rad[1].abs() < 1.0e-5);
        assert!((bends.elsewhere_rad - 0.2).abs() < 1.0e-5);
        let turns = |side, count| Turns { degrees: (60.0, 120.0), count, side }.hold(&bends);
        assert!(turns(None, (1, 1)) && turns(Some(Side::Left), (1, 5)));
        assert!(!turns(Some(Side::Right), (1, 5)) && !turns(None, (2, 5)) && !turns(None, (0, 0)));
    }
}
