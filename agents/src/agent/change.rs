//! Lane changes of agents: begun where the lane beside has room, put off elsewhere.

use schemas::ActorId;

use super::{Agent, EASY_MPS2, SPACING_M, STANDING_MPS, room};
use crate::beside::{Neighbour, ROOM_M, SAFE_MPS2, neighbours};
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
/// Who stands between two lanes for so long drives on along the nearer one.
const BETWEEN_SECS: f32 = 1.5;

/// Room on the lane beside that somebody takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Taken {
    /// From the origin to where the vehicle waits.
    pub stop_m: f32,
    /// By whom.
    pub by: Option<ActorId>,
}

impl Agent {
    /// Puts off the next lane change while there is no room on the lane beside; where it waits for
    /// it, and for whom.
    pub(super) fn await_room(&mut self, senses: &Senses<'_>, speed_mps: f32) -> Option<Taken> {
        self.settle(senses, speed_mps);
        let network = senses.network;
        let speed_mps = speed_mps.max(0.0);
        let look_m = LOOK_M + LOOK_SECS * speed_mps;
        let stopping_m = speed_mps * speed_mps / (2.0 * EASY_MPS2 * senses.view.grip);
        let ahead_m = self.traits(senses.view.grip).emergency_m.max(ROOM_M);
        // Who stands may do so before somebody on the lane beside.
        let look_m = if speed_mps < STANDING_MPS { look_m + ahead_m } else { look_m };
        let near = -BEGUN_M..look_m + stopping_m;
        let next = self.path.next_change(network).filter(|next| near.contains(&next.begins_m));
        let next = next.filter(|_| !self.options.ignore_vehicles);
        let taken = next.and_then(|next| {
            let by = ask_room(senses, &self.path, &next, (speed_mps, ahead_m)).err()?;
            Some((next, by))
        });
        let Some((next, by)) = taken else {
            self.waited_secs = 0.0;
            return None;
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
        Some(Taken { stop_m: last_m.max(0.0), by })
    }

    /// Does not stand between two lanes, where each of two vehicles would wait for the other: ends
    /// the change where most of it is done, else begins it anew once there is room or, where none
    /// of the marking is left, goes another way.
    fn settle(&mut self, senses: &Senses<'_>, speed_mps: f32) {
        let network = senses.network;
        let next = self.path.next_change(network).filter(|next| next.begins_m < -BEGUN_M);
        let Some(next) = next.filter(|_| speed_mps < STANDING_MPS && !self.options.ignore_vehicles)
        else {
            self.between_secs = 0.0;
            return;
        };
        self.between_secs += senses.dt_secs;
        if self.between_secs < BETWEEN_SECS {
            return;
        }
        let settled = settled(network, &self.path).or_else(|| {
            let is_patient = self.between_secs < PATIENCE_SECS;
            if is_patient { None } else { around(network, &self.path, &next) }
        });
        if let Some(path) = settled {
            (self.between_secs, self.path) = (0.0, path);
        }
    }
}

/// The way to the same end with the change under the vehicle as if it were done, where most of it
/// is, else begun anew from here on; none where the markings do not allow that.
fn settled(network: &Network, path: &Path) -> Option<Path> {
    let (_, leg) = path.ahead().next()?;
    if path.place(network)?.lane == leg.onto? {
        return path.changed(network, 0);
    }
    let anew = path.postponed(network, 0.0)?;
    let next = anew.next_change(network)?;
    (next.room_m >= LENGTH_M_MIN * f32::from(next.count)).then_some(anew)
}

/// Whether somebody at a speed who leaves so much room ahead may begin a change: nobody abreast,
/// room ahead and behind, and nobody who comes from the lane beyond; else who keeps it from it.
pub(super) fn ask_room(
    senses: &Senses<'_>,
    path: &Path,
    next: &NextChange,
    (speed_mps, ahead_m): (f32, f32),
) -> Result<(), Option<ActorId>> {
    let Some(place) = path.beside_point(senses.network, next.index) else { return Ok(()) };
    let mut first: Option<Neighbour> = None;
    neighbours(senses.scene, senses.body, &place, |other| {
        let toward_mps = if next.to_left { -other.left_mps } else { other.left_mps };
        let comes = other.is_beyond(next.to_left) && other.is_abreast() && toward_mps > COMES_MPS;
        let taken = comes || (other.is_behind() && !other.has_room(speed_mps));
        if taken && first.is_none_or(|first| other.gap_m() < first.gap_m()) {
            first = Some(*other);
        }
    });
    if let Some(other) = first {
        return Err(Some(other.id));
    }
    let there = path.changed(senses.network, next.index).ok_or(None)?;
    let mut points = Vec::new();
    there.sample(senses.network, AHEAD_M, SPACING_M, &mut points);
    let ahead = senses.scene.ahead(&points, &room(senses));
    let near = ahead.filter(|ahead| {
        let closing_mps = (speed_mps - ahead.along_mps.max(0.0)).max(0.0);
        let room_m = ahead.gap_m - ahead_m;
        room_m <= 0.0 || closing_mps * closing_mps > 2.0 * SAFE_MPS2 * room_m
    });
    near.map_or(Ok(()), |near| Err(Some(near.id)))
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
    fn who_stands_between_two_lanes_ends_the_change_or_begins_it_anew() {
        let network = network();
        for way in ways(&network) {
            let leg = way.ahead().find_map(|(_, leg)| leg.onto.map(|onto| (*leg, onto)));
            let (leg, onto) = leg.unwrap();
            let driven_m = |share: f32| leg.from_m - 5.0 + share * leg.length_m();
            let [mut early, mut late] = [way.clone(), way.clone()];
            early.go(driven_m(0.3));
            late.go(driven_m(0.7));
            let done = settled(&network, &late).unwrap();
            assert_eq!((done.own(&network).unwrap().0, done.is_changing()), (onto, false));
            let anew = settled(&network, &early);
            for path in [Some(&done), anew.as_ref()].into_iter().flatten() {
                assert!(hangs_together(&network, path), "{path:?}");
                let end = |path: &Path| path.last().map(|leg| (leg.lane, leg.to_m));
                assert_eq!(end(path), end(&way));
            }
            let next = anew.map(|path| path.next_change(&network).unwrap());
            assert!(next.is_none_or(|next| next.begins_m.abs() < 0.01), "{next:?}");
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
