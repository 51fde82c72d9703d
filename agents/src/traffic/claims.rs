//! Who may drive through a junction.
//!
//! A way through a junction is claimed as a whole before it is entered, and given back lane by lane
//! as the vehicle leaves. Ways that come near each other exclude each other. Of those who wait, the
//! one with the higher rank goes first, then the one who asks first.

use schemas::ActorId;
use serde::{Deserialize, Serialize};

use crate::network::{LaneId, Network};
use crate::path::Path;
use crate::scene::Body;

/// Somebody with a higher rank who is nearer than this to a junction is let through.
const GAP_SECS: f32 = 4.0;
/// Who waited as long as this goes before others.
const PATIENCE_SECS: f32 = 20.0;
/// Lanes looked at for the way through a junction.
const LEGS_MAX: usize = 16;

/// What is claimed and wished for, by lane.
#[derive(Debug, Default)]
pub struct Claims {
    held: Vec<(LaneId, ActorId)>,
    wishes: Vec<Wish>,
}

#[derive(Clone, Copy, Debug)]
struct Wish {
    lane: LaneId,
    id: ActorId,
    eta_secs: f32,
    rank: u8,
}

/// The next way through a junction that a vehicle has no claim on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Way {
    pub lanes: Vec<LaneId>,
    /// From the vehicle's origin.
    pub entry_m: f32,
    pub exit_m: f32,
}

/// The lanes that a vehicle may drive through.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Grants {
    /// Each with the way driven since it was left, or below zero while it is ahead.
    lanes: Vec<(LaneId, f32)>,
    waited_secs: f32,
}

impl Way {
    pub(super) fn next(network: &Network, path: &Path, grants: &Grants) -> Option<Self> {
        let mut way: Option<Self> = None;
        for (index, (begins_m, leg)) in path.ahead().take(LEGS_MAX).enumerate() {
            let through = network.lane(leg.lane).is_some_and(|lane| lane.junction.is_some());
            // Where the vehicle already is, asking comes too late.
            if !through || grants.holds(leg.lane) || index == 0 {
                match way {
                    Some(_) => break,
                    None => continue,
                }
            }
            let ends_m = begins_m + leg.length_m();
            match &mut way {
                Some(way) => {
                    way.lanes.push(leg.lane);
                    way.exit_m = ends_m;
                }
                None => {
                    way = Some(Self { lanes: vec![leg.lane], entry_m: begins_m, exit_m: ends_m });
                }
            }
        }
        way
    }
}

impl Grants {
    pub(super) fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    fn holds(&self, lane: LaneId) -> bool {
        self.lanes.iter().any(|(held, _)| *held == lane)
    }

    pub(super) fn add(&mut self, way: &Way) {
        self.lanes.extend(way.lanes.iter().map(|lane| (*lane, -1.0)));
        self.waited_secs = 0.0;
    }

    /// Gives back what the vehicle's rear has left.
    pub(super) fn drive_on(&mut self, path: &Path, driven_m: f32, half_length_m: f32) {
        for (lane, left_m) in &mut self.lanes {
            if path.ahead().take(LEGS_MAX).any(|(_, leg)| leg.lane == *lane) {
                *left_m = -1.0;
            } else {
                *left_m = left_m.max(0.0) + driven_m;
            }
        }
        self.lanes.retain(|(_, left_m)| *left_m <= half_length_m + 0.5);
    }

    /// Gives back what lies beyond a place on the path.
    pub(super) fn give_up(&mut self, path: &Path, from_m: f32) {
        for (begins_m, leg) in path.ahead().take(LEGS_MAX) {
            if begins_m + 1.0 > from_m {
                self.lanes.retain(|(lane, _)| *lane != leg.lane);
            }
        }
    }

    pub(super) fn tell(&self, id: ActorId, claims: &mut Claims) {
        claims.held.extend(self.lanes.iter().map(|(lane, _)| (*lane, id)));
    }

    /// Counts how long it stands without getting on.
    pub(super) fn wait(&mut self, dt_secs: f32, speed_mps: f32) {
        let stands = speed_mps < 0.5 && self.lanes.is_empty();
        self.waited_secs = if stands { self.waited_secs + dt_secs } else { 0.0 };
    }

    pub(super) fn waited_long(&self) -> bool {
        self.waited_secs > PATIENCE_SECS
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
                self.held.push((near.place.lane, body.id));
            }
            let left_m = lane.length_m() - near.place.at_m;
            if left_m < 3.0 + body.half_m.x + SOON_SECS * body.velocity_mps.norm() {
                let inside =
                    |id: &&LaneId| network.lane(**id).is_some_and(|lane| lane.junction.is_some());
                self.held.extend(lane.next.iter().filter(inside).map(|id| (*id, body.id)));
            }
        }
    }

    pub(super) fn wish(&mut self, way: &Way, id: ActorId, eta_secs: f32, rank: u8) {
        let wishes = way.lanes.iter().map(|lane| Wish { lane: *lane, id, eta_secs, rank });
        self.wishes.extend(wishes);
    }

    /// Claims a way if nobody holds or is to have what crosses it.
    pub(super) fn grant(&mut self, network: &Network, way: &Way, id: ActorId, rank: u8) -> bool {
        let crosses = |lane: LaneId, other: LaneId| {
            network.lane(lane).is_some_and(|lane| lane.conflicts.binary_search(&other).is_ok())
        };
        let taken = way.lanes.iter().any(|lane| {
            self.held.iter().any(|(held, who)| *who != id && crosses(*lane, *held))
                || self.wishes.iter().any(|wish| {
                    wish.id != id
                        && wish.rank > rank
                        && wish.eta_secs < GAP_SECS
                        && crosses(*lane, wish.lane)
                })
        });
        if taken {
            return false;
        }
        self.held.extend(way.lanes.iter().map(|lane| (*lane, id)));
        true
    }
}
