//! Lines that several lights have, each for other ways through a junction.

use schemas::Vec3;

use super::{Lane, LaneId, Network, Stop, StopLine, stops};

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

    /// Whether one of these lights, which have one line, holds the way through the junction behind
    /// it that a vehicle's front is on; `None` while it may be on several, of which they hold some.
    #[must_use]
    pub fn hold_way(&self, lights: &[u32], front_m: &Vec3, forward: &Vec3) -> Option<bool> {
        let inside = self.inside(front_m, forward);
        let ways = inside.filter_map(|(lane, _)| Some(self.lane(lane)?.entered.lane));
        let (mut held, mut free) = (false, false);
        for way in ways {
            let holds = self.is_held(way, lights);
            held |= holds;
            free |= !holds;
        }
        (!(held && free)).then_some(held)
    }

    /// Whether one of these lights holds who takes a way through a junction.
    fn is_held(&self, way: LaneId, lights: &[u32]) -> bool {
        let before = self.lane(way).map_or(&[][..], |lane| lane.previous.as_slice());
        before.iter().filter_map(|id| self.lane(*id)).any(|lane| {
            self::lights(lane)
                .any(|(light, line)| lights.contains(&light) && lane.holds(line.why, Some(way)))
        })
    }
}
