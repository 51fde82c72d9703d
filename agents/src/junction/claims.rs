//! Who may drive through a junction.
//!
//! A way through a junction is claimed as a whole before it is entered. Ways that come near each
//! other exclude each other. Whoever is kept by oncoming traffic alone may claim the part before
//! it, enter, and wait there. Of those who wait, the one with the higher rank goes first, then who
//! comes from the right (where traffic keeps to the left, from the left), then the one who asks
//! first. Lane changes are told here too.

mod judge;

use std::collections::BTreeMap;

use schemas::ActorId;

use super::entry::Held;
use super::grants::Way;
use crate::network::{LaneId, Network};
use crate::scene::Body;
pub use judge::Entering;

/// Somebody with a higher rank who is nearer than this to a junction is let through.
const GAP_SECS: f32 = 4.0;
/// Of two equals who come at times nearer to each other than this, or both within that gap, who
/// comes from the right goes first; where traffic keeps to the left, from the left.
const TOGETHER_SECS: f32 = 1.0;
/// The rank of those whom neither sign nor a long wait tells who goes first: the side they come
/// from does.
const EQUAL: u8 = 1;
/// The rank of blue lights.
pub(super) const URGENT: u8 = 3;
/// How far beyond a crossing a vehicle's rear leaves it to others.
const CLEAR_M: f32 = 0.5;
/// Who waits inside a junction stands so far before the way that he lets through, at least this
/// far inside.
const BEFORE_M: f32 = 2.5;
const INSIDE_M_MIN: f32 = 5.0;
/// Who stands so far before a way leaves it free.
const APART_M: f32 = 0.5;
/// Most vehicles of a circle that is found.
const CIRCLE_MAX: usize = 64;

/// What is claimed and wished for, by lane, who changes lanes, and who stands as others do.
#[derive(Debug, Default)]
pub struct Claims {
    /// By junction: ways through different ones do not meet.
    junctions: BTreeMap<u32, Told>,
    changes: Vec<Change>,
    waits: BTreeMap<ActorId, Wait>,
}

/// For whom somebody waits at rest.
#[derive(Clone, Copy, Debug)]
struct Wait {
    whom: ActorId,
    /// Whether the other is in its way, also on the lane beside, and no junction holds it.
    is_behind: bool,
    /// Whether it has room beyond the junction.
    has_room: bool,
}

/// What is claimed and wished for in one junction, in the order in which it was told.
#[derive(Debug, Default)]
struct Told {
    held: Vec<Hold>,
    wishes: Vec<Wish>,
}

/// Somebody who changes lanes.
#[derive(Clone, Copy, Debug)]
struct Change {
    id: ActorId,
    to_left: bool,
}

/// A lane that somebody may drive through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hold {
    pub lane: LaneId,
    pub id: ActorId,
    /// Where on the lane the rear of the vehicle is; below zero before the lane's entry.
    pub rear_m: f32,
    /// Where on the lane its front will wait.
    pub until_m: Option<f32>,
    /// Until its front is there; endless for who asks nobody.
    pub eta_secs: f32,
}

#[derive(Clone, Copy, Debug)]
struct Wish {
    lane: LaneId,
    asker: Asker,
}

/// Who asks for a way through a junction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Asker {
    pub id: ActorId,
    /// Who goes first: see [`Passage::rank`](super::Passage::rank).
    pub rank: u8,
    /// Until its front is at the junction.
    pub eta_secs: f32,
    /// Whether it drives on first of a circle of those who each wait for the next one.
    pub leads_circle: bool,
}

impl Asker {
    /// Whether it is let through by somebody who asks as well: it goes first, and comes soon.
    /// `from_side` says whether it comes from the side of the other that goes first.
    fn goes_before(&self, other: &Self, from_side: impl FnOnce() -> bool) -> bool {
        let until_secs = match (self.rank, other.rank) {
            (EQUAL, EQUAL) => GAP_SECS.max(other.eta_secs + TOGETHER_SECS),
            (own, others) if own > others => GAP_SECS,
            _ => return false,
        };
        // What costs most is asked last.
        self.id != other.id && self.eta_secs < until_secs && (self.rank > other.rank || from_side())
    }
}

impl Hold {
    /// From the lane's entry on, of somebody of whom it is not known when it will be there.
    fn of(lane: LaneId, id: ActorId) -> Self {
        Self { lane, id, rear_m: 0.0, until_m: None, eta_secs: f32::INFINITY }
    }
}

impl Claims {
    /// A vehicle that asks nobody: what it is on, and what it may enter soon.
    pub fn occupy(&mut self, network: &Network, body: &Body) {
        use nalgebra::RealField;
        /// A lane counts when its middle is this near.
        const BESIDE_M: f32 = 1.5;
        const SOON_SECS: f32 = 2.5;
        let heading_rad = RealField::atan2(body.forward.y, body.forward.x);
        for near in network.near(&body.centre_m, BESIDE_M) {
            let turn_rad = crate::network::wrapped(near.heading_rad - heading_rad).abs();
            let Some(lane) = network.lane(near.place.lane).filter(|_| turn_rad < 1.0) else {
                continue;
            };
            if lane.junction.is_some() {
                let rear_m = near.place.at_m - body.half_m.x;
                let lane = near.place.lane;
                self.tell(network, Hold { rear_m, ..Hold::of(lane, body.id) });
            }
            let left_m = lane.length_m() - near.place.at_m;
            if left_m < 3.0 + body.half_m.x + SOON_SECS * body.velocity_mps.norm() {
                let rear_m = -left_m - body.half_m.x;
                for next in &lane.next {
                    self.tell(network, Hold { rear_m, ..Hold::of(*next, body.id) });
                }
            }
            if body.is_urgent {
                let front_m = (left_m - body.half_m.x).max(0.0);
                let eta_secs = front_m / body.velocity_mps.norm().max(1.0);
                let asker = Asker { id: body.id, rank: URGENT, eta_secs, leads_circle: false };
                for next in &lane.next {
                    self.ask(network, Wish { lane: *next, asker });
                }
            }
        }
    }

    /// Tells all who ask later in this tick what somebody was granted before.
    pub(crate) fn tell(&mut self, network: &Network, hold: Hold) {
        if let Some(told) = self.told_mut(network, hold.lane) {
            told.held.push(hold);
        }
    }

    /// Tells all who ask later in this tick that somebody changes lanes.
    pub(crate) fn change(&mut self, id: ActorId, to_left: bool) {
        self.changes.push(Change { id, to_left });
    }

    /// Whether somebody changes to the lane on that side.
    pub(crate) fn is_changing(&self, id: ActorId, to_left: bool) -> bool {
        self.changes.iter().any(|change| change.id == id && change.to_left == to_left)
    }

    /// Tells all who ask later in this tick for whom somebody waits at rest.
    pub(crate) fn wait(&mut self, id: ActorId, held: Held) {
        let (whom, is_behind, has_room) = match held {
            Held::Claim(whom) => (whom, false, true),
            Held::Room(whom) => (whom, false, false),
            Held::Behind(whom) | Held::Beside(whom) => (whom, true, false),
            Held::No | Held::Line => return,
        };
        self.waits.insert(id, Wait { whom, is_behind, has_room });
    }

    /// Whether somebody is the first of a circle of those who each wait for the next one: of those
    /// whom a junction holds the one with the lowest number, of those with room beyond it if there
    /// are any.
    pub(crate) fn leads_circle(&self, id: ActorId) -> bool {
        let place = |wait: &Wait, id: ActorId| (!wait.has_room, id);
        let own = self.waits.get(&id).filter(|wait| !wait.is_behind);
        let Some(first) = own.map(|wait| place(wait, id)) else { return false };
        let mut at = id;
        for _ in 0..CIRCLE_MAX {
            let wait = self.waits.get(&at);
            let Some(wait) = wait.filter(|wait| wait.is_behind || place(wait, at) >= first) else {
                return false;
            };
            at = wait.whom;
            if at == id {
                return true;
            }
        }
        false
    }

    /// Whether somebody is of a circle of those who each wait at rest for the next one.
    pub(crate) fn is_in_circle(&self, id: ActorId) -> bool {
        let next = |at: &ActorId| self.waits.get(at).map(|wait| wait.whom);
        std::iter::successors(next(&id), next).take(CIRCLE_MAX).any(|at| at == id)
    }

    /// Whether somebody waits until another one has driven on: as that one is in its way, or, where
    /// the other leads a circle, for whatever reason.
    fn waits_for(&self, id: ActorId, other: &Asker) -> bool {
        let mut at = id;
        for _ in 0..CIRCLE_MAX {
            let wait = self.waits.get(&at).filter(|wait| wait.is_behind || other.leads_circle);
            let Some(wait) = wait else { return false };
            at = wait.whom;
            if at == other.id {
                return true;
            }
        }
        false
    }

    pub(crate) fn wish(&mut self, network: &Network, way: &Way, asker: &Asker) {
        for lane in &way.lanes {
            self.ask(network, Wish { lane: *lane, asker: *asker });
        }
    }

    /// Claims a way if nobody holds or is to have what crosses it; else tells who.
    pub(crate) fn grant(
        &mut self,
        network: &Network,
        way: &Way,
        asker: &Asker,
    ) -> Result<(), ActorId> {
        for lane in &way.lanes {
            if let Some((_, other)) = self.blockers(network, *lane, asker).next() {
                return Err(other);
            }
        }
        self.hold(network, way, asker.id, None);
        Ok(())
    }

    /// Claims the part of a way that lies before oncoming traffic, if nothing else is in the way;
    /// where on its lane the front is to wait.
    pub(crate) fn grant_part(
        &mut self,
        network: &Network,
        way: &Way,
        asker: &Asker,
    ) -> Option<f32> {
        let [lane_id] = way.lanes.as_slice() else { return None };
        let id = asker.id;
        if asker.rank == 0 {
            return None;
        }
        let lane = network.lane(*lane_id)?;
        let waits = |hold: &Hold| hold.lane == *lane_id && hold.until_m.is_some();
        let let_through = |(other, _): (LaneId, ActorId)| {
            network.lane(other).is_some_and(|other| other.is_oncoming(lane) && !other.joins(lane))
        };
        let held = self.told(network, *lane_id).map_or(&[][..], |told| told.held.as_slice());
        if held.iter().any(|hold| hold.id != id && waits(hold))
            || !self.blockers(network, *lane_id, asker).all(let_through)
        {
            return None;
        }
        let oncoming = lane.conflicts.iter().filter(|conflict| {
            network.lane(conflict.lane).is_some_and(|other| other.is_oncoming(lane))
        });
        let from_m = oncoming.map(|conflict| conflict.from_m).min_by(f32::total_cmp)?;
        let until_m = from_m - BEFORE_M;
        if until_m < INSIDE_M_MIN {
            return None;
        }
        self.hold(network, way, id, Some(until_m));
        Some(until_m)
    }

    /// Lanes that keep somebody from a lane of a junction, and whose they are or are to be.
    fn blockers(
        &self,
        network: &Network,
        lane: LaneId,
        asker: &Asker,
    ) -> impl Iterator<Item = (LaneId, ActorId)> {
        let (own, asker) = (network.lane(lane), *asker);
        let told = self.told(network, lane);
        let held = told.map_or(&[][..], |told| told.held.as_slice());
        let wishes = told.map_or(&[][..], |told| told.wishes.as_slice());
        let held = held.iter().filter(move |hold| {
            let other = (hold.id != asker.id).then(|| network.lane(hold.lane)).flatten();
            let met = other.and_then(|other| Some((other, other.conflict(lane)?)));
            met.is_some_and(|(other, conflict)| {
                let short = hold.until_m.is_some_and(|until_m| {
                    let joins = || own.is_some_and(|own| own.joins(other));
                    until_m + APART_M < conflict.from_m && !joins()
                });
                !short
                    && hold.rear_m < conflict.until_m + CLEAR_M
                    && !self.waits_for(hold.id, &asker)
            })
        });
        let first = wishes.iter().filter(move |wish| {
            let lanes = || network.lane(wish.lane).zip(own);
            let from_side = || lanes().is_some_and(|(other, own)| other.is_from_first_side_of(own));
            let crosses = || lanes().is_some_and(|(other, _)| other.conflict(lane).is_some());
            wish.asker.goes_before(&asker, from_side)
                && crosses()
                && !self.waits_for(wish.asker.id, &asker)
        });
        let held = held.map(|hold| (hold.lane, hold.id));
        held.chain(first.map(|wish| (wish.lane, wish.asker.id)))
    }

    fn hold(&mut self, network: &Network, way: &Way, id: ActorId, until_m: Option<f32>) {
        let rear_m = -way.entry_m;
        for lane in &way.lanes {
            self.tell(network, Hold { rear_m, until_m, ..Hold::of(*lane, id) });
        }
    }

    fn ask(&mut self, network: &Network, wish: Wish) {
        if let Some(told) = self.told_mut(network, wish.lane) {
            told.wishes.push(wish);
        }
    }

    /// What was told of the junction that a lane leads through; nobody crosses another one's way
    /// outside of junctions.
    fn told(&self, network: &Network, lane: LaneId) -> Option<&Told> {
        self.junctions.get(&network.lane(lane)?.junction?)
    }

    fn told_mut(&mut self, network: &Network, lane: LaneId) -> Option<&mut Told> {
        Some(self.junctions.entry(network.lane(lane)?.junction?).or_default())
    }
}

#[cfg(test)]
mod tests;
