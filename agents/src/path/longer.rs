//! What lies beyond the end of a way.

use super::{Leg, Path};
use crate::network::{Lane, Network};

/// Lanes that lead on from the end of a way, at most.
const LEGS_MAX: usize = 8;

impl Path {
    /// The same way and so much more, on the first lanes that lead on.
    pub(crate) fn lengthened(&self, network: &Network, more_m: f32) -> Self {
        let mut path = self.clone();
        let mut left_m = more_m;
        if let Some(last) = path.legs.back_mut().filter(|last| last.onto.is_none()) {
            let length_m = network.lane(last.lane).map_or(0.0, Lane::length_m);
            let own_m = left_m.min(length_m - last.to_m).max(0.0);
            last.to_m += own_m;
            left_m -= own_m;
        }
        for _ in 0..LEGS_MAX {
            let lane = path.last().and_then(|last| network.lane(last.last_lane()));
            let next = lane.and_then(|lane| lane.next.first().copied()).filter(|_| left_m > 0.0);
            let Some((lane, next)) = next.and_then(|id| Some((id, network.lane(id)?))) else {
                break;
            };
            let to_m = left_m.min(next.length_m());
            path.push(Leg { lane, from_m: 0.0, to_m, onto: None });
            left_m -= to_m;
        }
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_longer_way_goes_on_along_its_lane_and_the_next_one() {
        let text = roads::town::build("Town03_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town03_Opt", &text).unwrap());
        let long = |id: &u32| network.lane(*id).is_some_and(|it| it.length_m() > 30.0);
        let goes_on = |id: &u32| !network.lane(*id).unwrap().next.is_empty();
        let id = (0..network.lane_count() as u32).find(|id| long(id) && goes_on(id)).unwrap();
        let lane = network.lane(id).unwrap();
        let to_m = lane.length_m() - 2.0;
        let mut path = Path::default();
        path.push(Leg { lane: id, from_m: 5.0, to_m, onto: None });
        for (more_m, legs) in [(1.5, 1), (4.0, 2)] {
            let longer = path.lengthened(&network, more_m);
            assert_eq!(longer.ahead().count(), legs);
            assert!((longer.length_m() - path.length_m() - more_m).abs() < 0.01);
        }
        let end = path.lengthened(&network, 4.0).last().copied().unwrap();
        assert_eq!((end.lane, end.from_m), (lane.next[0], 0.0));
    }
}
