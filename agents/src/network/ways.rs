//! Ways through junctions: where they begin, who of two goes first, and how far they turn. Where a
//! road through a junction has several sections, a way is as many lanes after each other.

use nalgebra::RealField;
use schemas::Vec3;

use super::{Lane, LaneId, Near, Network, wrapped};

/// Ways into a junction that begin this much turned from each other begin opposite.
const ONCOMING_RAD: f32 = 2.4;
/// Who comes from the right begins turned to the left by this much, and the other way around.
const FROM_SIDE_RAD: std::ops::Range<f32> = 0.7..2.4;
/// A front is on ways whose middle is this near and that lead this much the same way.
const BESIDE_M: f32 = 1.5;
const SAME_WAY_RAD: f32 = 0.6;
/// Sections of a road through a junction at most.
const LANES_MAX: usize = 64;

/// Where traffic comes into a junction: a way through it may be several lanes after each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Entered {
    /// The first lane inside.
    pub lane: LaneId,
    /// Which way that begins.
    heading_rad: f32,
    /// How long the way is up to the present lane.
    pub before_m: f32,
}

/// Notes where traffic comes into junctions.
pub(super) fn enter(network: &mut Network) {
    let entered: Vec<Entered> =
        (0..network.lanes.len() as LaneId).map(|id| entered(network, id)).collect();
    for (lane, entered) in network.lanes.iter_mut().zip(entered) {
        lane.entered = entered;
    }
}

/// Where traffic on a lane came into its junction, over the sections before on the same road.
fn entered(network: &Network, id: LaneId) -> Entered {
    let before = |id: &LaneId| {
        let lane = network.lane(*id)?;
        let is_before = |before: &&LaneId| network.are_of_one_way(**before, *id);
        lane.previous.iter().find(is_before).copied()
    };
    let (mut first, mut before_m) = (id, 0.0);
    for lane in std::iter::successors(before(&id), before).take(LANES_MAX) {
        first = lane;
        before_m += network.lane(lane).map_or(0.0, Lane::length_m);
    }
    let heading_rad = network.lane(first).map_or(0.0, |lane| lane.at(0.0).heading_rad);
    Entered { lane: first, heading_rad, before_m }
}

impl Network {
    /// A lane and those after it in its junction, one for each section of the road.
    pub(crate) fn through(&self, id: LaneId) -> impl Iterator<Item = LaneId> {
        let after = |id: &LaneId| {
            let next = self.lane(*id)?.next.iter();
            next.copied().find(|next| self.are_of_one_way(*id, *next))
        };
        std::iter::successors(Some(id), after).take(LANES_MAX)
    }

    /// Lanes through junctions that a vehicle's front may be on, with where on each of them.
    pub(crate) fn inside(
        &self,
        front_m: &Vec3,
        forward: &Vec3,
    ) -> impl Iterator<Item = (LaneId, f32)> {
        let inside = |id: LaneId| self.lane(id).is_some_and(|lane| lane.junction.is_some());
        self.under(front_m, forward).filter(move |(id, _)| inside(*id))
    }

    /// Lanes that a vehicle's front may be on, with where on each of them.
    pub(super) fn under(
        &self,
        front_m: &Vec3,
        forward: &Vec3,
    ) -> impl Iterator<Item = (LaneId, f32)> + use<> {
        let heading_rad = RealField::atan2(forward.y, forward.x);
        let same_way =
            move |near: &Near| wrapped(near.heading_rad - heading_rad).abs() < SAME_WAY_RAD;
        let near = self.near(front_m, BESIDE_M).into_iter().filter(same_way);
        near.map(|near| (near.place.lane, near.place.at_m))
    }

    /// Whether two lanes are of one road through a junction.
    fn are_of_one_way(&self, id: LaneId, other: LaneId) -> bool {
        let lanes = self.lane(id).zip(self.lane(other));
        lanes.is_some_and(|(a, b)| a.junction.is_some() && a.key.0 == b.key.0)
    }

    /// By how much a way through a junction turns across oncoming traffic: to the left, and to the
    /// right where traffic keeps to the left.
    pub(crate) fn across_rad(&self, id: LaneId) -> f32 {
        let last = self.through(id).last().and_then(|last| self.lane(last));
        self.lane(id).zip(last).map_or(0.0, |(lane, last)| {
            let leaves_rad = last.at(last.length_m()).heading_rad;
            lane.side() * wrapped(leaves_rad - lane.entered.heading_rad)
        })
    }
}

impl Lane {
    /// Whether its traffic comes into the junction against the direction of another lane's.
    pub(crate) fn is_oncoming(&self, other: &Self) -> bool {
        let turn_rad = wrapped(self.entered.heading_rad - other.entered.heading_rad);
        turn_rad.abs() > ONCOMING_RAD
    }

    /// Whether its traffic comes from the side that goes first: from the right of another lane's,
    /// and from its left where traffic keeps to the left.
    pub(crate) fn is_from_first_side_of(&self, other: &Self) -> bool {
        let turn_rad = wrapped(self.entered.heading_rad - other.entered.heading_rad);
        FROM_SIDE_RAD.contains(&(other.side() * turn_rad))
    }

    /// 1 where traffic keeps to the right, -1 where it keeps to the left.
    fn side(&self) -> f32 {
        if self.keeps_left { -1.0 } else { 1.0 }
    }
}
