//! Lines that several lights have, each for other ways through a junction.

use schemas::Vec3;
use serde::{Deserialize, Serialize};

use super::{Lane, LaneId, Network, Stop, StopLine, stops};

/// Which of the lights that have one line showed red.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RedLights {
    /// One of those that have the line.
    light: u32,
    /// As bits in the order of [`Network::sharing`].
    red: u16,
}

/// Notes which lights have lines together.
pub(super) fn mark(network: &mut Network) {
    for lane in network.lanes.iter().filter(|lane| !lane.spoken.is_empty()) {
        for (light, line) in lights(lane) {
            let near = lights(lane).filter(|(_, other)| stops::are_one(line, other));
            let all = network.sharing.entry(light).or_default();
            all.extend(near.map(|(other, _)| other));
        }
    }
    network.sharing.values_mut().for_each(|all| {
        all.sort_unstable();
        all.dedup();
    });
    network.sharing.retain(|_, all| all.len() > 1);
}

fn lights(lane: &Lane) -> impl Iterator<Item = (u32, &StopLine)> {
    lane.stops.iter().filter_map(|line| match line.why {
        Stop::Light(light) => Some((light, line)),
        _ => None,
    })
}

impl Lane {
    /// Whether a line holds those who drive on along a lane: not a light's where others have the
    /// same line, of which some speak to that lane and it does not.
    pub(crate) fn holds(&self, why: Stop, next: Option<LaneId>) -> bool {
        let Stop::Light(light) = why else { return true };
        let mut spoken = self.spoken.iter().filter(|(_, lane)| Some(*lane) == next).peekable();
        spoken.peek().is_none() || spoken.any(|(other, _)| *other == light)
    }
}

impl Network {
    /// All lights that have a line with this one and speak to other ways than it, with itself, in
    /// order; none where it has its lines for itself.
    #[must_use]
    pub fn sharing(&self, light: u32) -> &[u32] {
        self.sharing.get(&light).map_or(&[], Vec::as_slice)
    }

    /// Ways through junctions on which a vehicle's front may be, or which lead to where it is.
    fn ways_of(&self, front_m: &Vec3, forward: &Vec3) -> impl Iterator<Item = LaneId> {
        let under = self.under(front_m, forward).filter_map(|(id, _)| Some((id, self.lane(id)?)));
        let lanes = under.flat_map(|(id, lane)| match lane.junction {
            Some(_) => vec![id],
            None => lane.previous.clone(),
        });
        let inside = lanes.filter_map(|id| self.lane(id).filter(|lane| lane.junction.is_some()));
        inside.map(|lane| lane.entered.lane)
    }

    /// Whether one of these lights holds who takes a way through a junction.
    fn is_held(&self, way: LaneId, is_one: impl Fn(u32) -> bool) -> bool {
        let before = self.lane(way).map_or(&[][..], |lane| lane.previous.as_slice());
        before.iter().filter_map(|id| self.lane(*id)).any(|lane| {
            self::lights(lane).any(|(light, line)| is_one(light) && lane.holds(line.why, Some(way)))
        })
    }
}

impl RedLights {
    /// Those of the lights of a line that show red. `all` are [`Network::sharing`] of `light`.
    #[must_use]
    pub fn of(light: u32, all: &[u32], is_red: impl Fn(u32) -> bool) -> Self {
        let bits = (0..u16::BITS).zip(all).filter(|(_, light)| is_red(**light));
        Self { light, red: bits.fold(0, |red, (bit, _)| red | (1 << bit)) }
    }

    /// Those that showed red at the same line before, too.
    #[must_use]
    pub fn and(self, before: Self) -> Self {
        Self { red: self.red & before.red, ..self }
    }

    /// Whether none is red.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.red == 0
    }

    /// Whether one of them holds the way through the junction behind the line that a vehicle takes
    /// with its front there; `None` while that may be several, of which they hold some, or none.
    #[must_use]
    pub fn hold_way(self, network: &Network, front_m: &Vec3, forward: &Vec3) -> Option<bool> {
        let all = network.sharing(self.light);
        let is_red = |light: u32| {
            let mut bits = (0..u16::BITS).zip(all);
            bits.any(|(bit, one)| *one == light && self.red >> bit & 1 == 1)
        };
        let (mut held, mut free) = (false, false);
        for way in network.ways_of(front_m, forward) {
            if network.is_held(way, |light| all.contains(&light)) {
                let holds = network.is_held(way, is_red);
                held |= holds;
                free |= !holds;
            }
        }
        (held != free).then_some(held)
    }
}

#[cfg(test)]
mod tests {
    use roads::Map;

    use super::*;

    const FORK: &str = include_str!("../../../roads/tests/maps/fork.xodr");

    /// Who has passed the line, whose lights 1 and 0 hold the ways to the left and straight on.
    fn verdict(red: &[u32], at_m: [f32; 2], heading_rad: f32) -> Option<bool> {
        let network = Network::new(&Map::parse("fork", FORK).unwrap());
        let all = network.sharing(0);
        assert_eq!((all, network.sharing(1)), (&[0, 1][..], all));
        let front_m = Vec3::new(at_m[0], at_m[1], 0.0);
        let forward = Vec3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
        RedLights::of(1, all, |light| red.contains(&light)).hold_way(&network, &front_m, &forward)
    }

    #[test]
    fn red_lights_hold_whoever_takes_their_way_as_soon_as_it_is_clear_which() {
        let before = ([-11.0, 0.0], 0.0);
        let unclear = ([-8.0, 0.0], 0.0);
        let straight = ([2.0, 0.0], 0.0);
        let beyond = ([30.0, 0.0], 0.0);
        let left = ([8.0, 8.0], 1.0);
        for ((at_m, heading_rad), of_straight, of_left) in [
            (before, None, None),
            (unclear, None, None),
            (straight, Some(true), Some(false)),
            (beyond, Some(true), Some(false)),
            (left, Some(false), Some(true)),
        ] {
            assert_eq!(verdict(&[0], at_m, heading_rad), of_straight, "{at_m:?}");
            assert_eq!(verdict(&[1], at_m, heading_rad), of_left, "{at_m:?}");
        }
        let (at_m, heading_rad) = unclear;
        assert_eq!(verdict(&[0, 1], at_m, heading_rad), Some(true), "both are red");
        assert_eq!(verdict(&[], at_m, heading_rad), Some(false));
    }
}
