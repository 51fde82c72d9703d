//! How a way turns, in junctions and between them.

use std::f32::consts::{PI, TAU};

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

    /// Junctions in which the way turns by an angle between two.
    pub(crate) fn turns(&self, from_deg: f32, to_deg: f32) -> usize {
        let range = from_deg.to_radians()..=to_deg.to_radians();
        self.junctions_rad.iter().filter(|turn| range.contains(&turn.abs())).count()
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
        assert_eq!(bends.turns(60.0, 120.0), 1);
    }
}
