//! Lane changes of agents: begun where the lane beside has room, put off elsewhere.

use super::{Agent, EASY_MPS2, SPACING_M, STANDING_MPS, room};
use crate::beside::{ROOM_M, SAFE_MPS2, neighbours};
use crate::network::{Network, Place};
use crate::path::{Leg, NextChange, Path};
use crate::route;
use crate::senses::Senses;

/// A change is decided on this far before it begins, and per metre per second from farther away.
const LOOK_M: f32 = 3.0;
const LOOK_SECS: f32 = 0.5;
/// Who has begun a change this far ago ends it.
const BEGUN_M: f32 = 2.0;
/// A change takes at least this way.
pub(super) const LENGTH_M_MIN: f32 = 12.0;
/// How far ahead others on the lane beside count.
const AHEAD_M: f32 = 60.0;
/// Vehicles beyond the lane beside that move towards it as fast as this change to it.
const COMES_MPS: f32 = 0.3;
/// Legs of the way that are tried as ends of another way.
const REJOIN_MAX: usize = 8;
/// Who has stood this long for want of room goes another way.
const PATIENCE_SECS: f32 = 20.0;

impl Agent {
    /// Puts off the next lane change while there is no room on the lane beside; how far the vehicle
    /// may drive without it.
    pub(super) fn await_room(&mut self, senses: &Senses<'_>, speed_mps: f32) -> f32 {
        let network = senses.network;
        let speed_mps = speed_mps.max(0.0);
        let look_m = LOOK_M + LOOK_SECS * speed_mps;
        let stopping_m = speed_mps * speed_mps / (2.0 * EASY_MPS2 * senses.view.grip);
        let near = -BEGUN_M..look_m + stopping_m;
        let next = self.path.next_change(network).filter(|next| near.contains(&next.begins_m));
        let free = |next: &NextChange| has_room(senses, &self.path, next, speed_mps);
        let Some(next) = next.filter(|next| !self.options.ignore_vehicles && !free(next)) else {
            self.waited_secs = 0.0;
            return f32::INFINITY;
        };
        let last_m = next.begins_m + next.room_m - LENGTH_M_MIN * f32::from(next.count);
        if next.begins_m < look_m && look_m < last_m {
            if let Some(path) = self.path.postponed(network, look_m) {
                self.path = path;
            }
        } else if speed_mps < STANDING_MPS {
            self.waited_secs += senses.dt_secs;
        }
        if self.waited_secs > PATIENCE_SECS {
            self.waited_secs = 0.0;
            if let Some(path) = around(network, &self.path, &next) {
                self.path = path;
            }
        }
        last_m.max(0.0)
    }
}

/// Whether somebody at a speed may begin a change: nobody abreast, room ahead and behind, and
/// nobody who comes from the lane beyond.
pub(super) fn has_room(
    senses: &Senses<'_>,
    path: &Path,
    next: &NextChange,
    speed_mps: f32,
) -> bool {
    let Some(place) = path.beside_point(senses.network, next.index) else { return true };
    let mut free = true;
    neighbours(senses.scene, senses.body, &place, |other| {
        let toward_mps = if next.to_left { -other.left_mps } else { other.left_mps };
        let comes = other.is_beyond(next.to_left) && other.is_abreast() && toward_mps > COMES_MPS;
        free &= !comes && (!other.is_behind() || other.has_room(speed_mps));
    });
    let Some(there) = path.changed(senses.network, next.index).filter(|_| free) else {
        return false;
    };
    let mut points = Vec::new();
    there.sample(senses.network, AHEAD_M, SPACING_M, &mut points);
    let ahead = senses.scene.ahead(&points, &room(senses));
    ahead.is_none_or(|ahead| {
        let closing_mps = (speed_mps - ahead.along_mps.max(0.0)).max(0.0);
        let room_m = ahead.gap_m - ROOM_M;
        room_m > 0.0 && closing_mps * closing_mps <= 2.0 * SAFE_MPS2 * room_m
    })
}

/// Another way to where the way leads, straight on where its next change would begin.
fn around(network: &Network, path: &Path, next: &NextChange) -> Option<Path> {
    let (_, leg) = path.ahead().nth(next.index)?;
    let to_m = network.lane(leg.lane)?.length_m();
    let end = Place { lane: leg.lane, at_m: to_m };
    let own = Leg { to_m, onto: None, ..*leg };
    let after = path.ahead().enumerate().skip(next.index + 1);
    after.filter(|(_, (_, leg))| leg.onto.is_none()).take(REJOIN_MAX).find_map(
        |(index, (_, to))| {
            let (_, legs) = route::plan(network, end, Place { lane: to.lane, at_m: to.to_m })?;
            Some(path.with(next.index..=index, std::iter::once(own).chain(legs)))
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{Lane, LaneId};

    fn network() -> Network {
        let text = roads::town::build("Town03_Opt").unwrap();
        Network::new(&roads::Map::parse("Town03_Opt", &text).unwrap())
    }

    /// Whether each leg begins where the one before ends.
    fn hangs_together(network: &Network, path: &Path) -> bool {
        let legs: Vec<Leg> = path.ahead().map(|(_, leg)| *leg).collect();
        legs.windows(2).all(|pair| {
            let [from, to] = pair else { return false };
            let [lane, last] = [from.lane, from.last_lane()].map(|id| network.lane(id).unwrap());
            if to.lane == from.last_lane() {
                (lane.abreast_m(from.to_m, last) - to.from_m).abs() < 0.01
            } else {
                let ends = (from.to_m - last.length_m()).abs() < 0.01;
                ends && last.next.contains(&to.lane) && to.from_m == 0.0
            }
        })
    }

    /// Ways from the beginning of lanes to the lanes beside their ends, where it does not matter
    /// for their length where they change.
    fn ways(network: &Network) -> Vec<Path> {
        let lanes = (0..network.lane_count() as LaneId).filter_map(|id| {
            let lane = network.lane(id).filter(|lane| lane.length_m() > 70.0)?;
            let onto = lane.left.or(lane.right).filter(|beside| beside.to_m > 60.0)?.lane;
            let as_long = |beside: f32| (beside - lane.length_m()).abs() < 0.5;
            let beside_m = network.lane(onto).map(Lane::length_m).filter(|at_m| as_long(*at_m))?;
            let to = Place { lane: onto, at_m: beside_m };
            let mut path = Path::default();
            let (_, legs) = route::plan(network, Place { lane: id, at_m: 5.0 }, to)?;
            legs.into_iter().for_each(|leg| path.push(leg));
            Some(path)
        });
        lanes.collect()
    }

    #[test]
    fn a_change_that_is_put_off_begins_later_and_ends_where_it_may() {
        let network = network();
        let ways = ways(&network);
        assert!(ways.len() > 15, "{}", ways.len());
        for way in ways {
            let (before, whole_m) = (way.next_change(&network).unwrap(), way.length_m());
            let mut path = way.clone();
            for ahead_m in [5.0, 20.0, 30.0] {
                path = path.postponed(&network, ahead_m).unwrap();
                let next = path.next_change(&network).unwrap();
                assert!(hangs_together(&network, &path), "{path:?}");
                assert!((next.begins_m - ahead_m.max(before.begins_m)).abs() < 0.01, "{next:?}");
                let [ended_m, was_m] = [next, before].map(|change| change.begins_m + change.room_m);
                assert!((ended_m - was_m).abs() < 0.5, "{ended_m} m, {was_m} m");
                assert!((path.length_m() - whole_m).abs() < 1.0, "{path:?}");
            }
        }
    }

    #[test]
    fn two_changes_in_a_row_are_put_off_together() {
        let text = roads::town::build("Town06_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town06_Opt", &text).unwrap());
        let ids = 0..network.lane_count() as LaneId;
        let mut found = ids.filter_map(|id| {
            let lane = network.lane(id).filter(|lane| lane.length_m() > 150.0)?;
            let beside = lane.left.filter(|beside| beside.to_m > 140.0)?;
            let beyond = network.lane(beside.lane)?.left.filter(|beyond| beyond.to_m > 140.0)?;
            let place = |lane, at_m| Place { lane, at_m };
            let (from, to) = (place(id, 0.0), place(beyond.lane, 130.0));
            let mut path = Path::default();
            route::plan(&network, from, to)?.1.into_iter().for_each(|leg| path.push(leg));
            Some(path)
        });
        let path = found.next().unwrap();
        let later = path.postponed(&network, 40.0).unwrap();
        assert!(hangs_together(&network, &later), "{later:?}");
        for (path, begins_m) in [(path, 0.0), (later, 40.0)] {
            let next = path.next_change(&network).unwrap();
            assert_eq!((next.count, next.begins_m), (2, begins_m));
            assert!((next.begins_m + next.room_m - 130.0).abs() < 1.0, "{next:?}");
        }
    }

    #[test]
    fn the_way_around_goes_on_along_the_lane_and_leads_to_the_same_end() {
        let network = network();
        let mut found = 0;
        for way in ways(&network) {
            let next = way.next_change(&network).unwrap();
            let Some(around) = around(&network, &way, &next) else { continue };
            found += 1;
            assert!(hangs_together(&network, &around), "{around:?}");
            let (own, lane) = way.own(&network).unwrap();
            let there = around.at(&network, lane.length_m() - 5.0).unwrap().point;
            assert!((there.point_m - lane.at(lane.length_m()).point_m).norm() < 0.1, "{own}");
            let end = |path: &Path| path.last().map(|leg| (leg.lane, leg.to_m));
            assert_eq!(end(&around), end(&way));
            assert!(around.length_m() > way.length_m() + 50.0);
        }
        assert!(found > 10, "{found}");
    }
}
