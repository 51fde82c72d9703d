//! Who may drive through a junction.
//!
//! A way through a junction is claimed as a whole before it is entered, and given back lane by lane
//! as the vehicle leaves. Ways that come near each other exclude each other. Of those who wait, the
//! one with the higher rank goes first, then the one who asks first. Lane changes are told here too.

use schemas::ActorId;
use serde::{Deserialize, Serialize};

use crate::network::{Lane, LaneId, Network};
use crate::path::Path;
use crate::scene::Body;

/// Somebody with a higher rank who is nearer than this to a junction is let through.
const GAP_SECS: f32 = 4.0;
/// How far beyond a crossing a vehicle's rear leaves it to others.
const CLEAR_M: f32 = 0.5;
/// Lanes looked at for the way through a junction.
const LEGS_MAX: usize = 16;

/// What is claimed and wished for, by lane, and who changes lanes.
#[derive(Debug, Default)]
pub struct Claims {
    held: Vec<Hold>,
    wishes: Vec<Wish>,
    changes: Vec<Change>,
}

/// Somebody who changes lanes.
#[derive(Clone, Copy, Debug)]
struct Change {
    id: ActorId,
    to_left: bool,
}

#[derive(Clone, Copy, Debug)]
struct Hold {
    lane: LaneId,
    id: ActorId,
    /// Where on the lane the rear of the vehicle is; below zero before the lane's entry.
    rear_m: f32,
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
    /// Entry of the junction after it; infinite where none is near.
    pub next_m: f32,
}

/// The lanes that a vehicle may drive through.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Grants {
    /// Each with the way driven since it was left, or below zero while it is ahead.
    lanes: Vec<(LaneId, f32)>,
    waited_secs: f32,
}

impl Way {
    /// Junctions nearer to each other than `room_m` are one.
    pub(super) fn next(
        network: &Network,
        path: &Path,
        grants: &Grants,
        room_m: f32,
    ) -> Option<Self> {
        let mut way: Option<Self> = None;
        for (index, (begins_m, leg)) in path.ahead().take(LEGS_MAX).enumerate() {
            // Where the vehicle already is, asking comes too late.
            let through = network.lane(leg.lane).is_some_and(|lane| lane.junction.is_some());
            if !through || grants.holds(leg.lane) || index == 0 {
                continue;
            }
            let exit_m = begins_m + leg.length_m();
            match &mut way {
                None => {
                    let lanes = vec![leg.lane];
                    way = Some(Self { lanes, entry_m: begins_m, exit_m, next_m: f32::INFINITY });
                }
                Some(way) if begins_m - way.exit_m < room_m => {
                    way.lanes.push(leg.lane);
                    way.exit_m = exit_m;
                }
                Some(way) => {
                    way.next_m = begins_m;
                    break;
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

    pub(super) fn tell(&self, network: &Network, path: &Path, body: &Body, claims: &mut Claims) {
        let half_m = body.half_m.x;
        claims.held.extend(self.lanes.iter().map(|(lane, left_m)| {
            let ahead = path.ahead().take(LEGS_MAX).find(|(_, leg)| leg.lane == *lane);
            let at_m = match ahead {
                Some((begins_m, leg)) => leg.from_m - begins_m,
                None => network.lane(*lane).map_or(0.0, Lane::length_m) + left_m,
            };
            Hold { lane: *lane, id: body.id, rear_m: at_m - half_m }
        }));
    }

    /// Counts how long it stands and asks for a claim.
    pub(super) fn wait(&mut self, dt_secs: f32, speed_mps: f32, asks: bool) {
        if speed_mps > 0.5 {
            self.waited_secs = 0.0;
        } else if asks {
            self.waited_secs += dt_secs;
        }
    }

    pub(super) fn waited_secs(&self) -> f32 {
        self.waited_secs
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
                self.held.push(Hold { lane: near.place.lane, id: body.id, rear_m });
            }
            let left_m = lane.length_m() - near.place.at_m;
            if left_m < 3.0 + body.half_m.x + SOON_SECS * body.velocity_mps.norm() {
                let inside =
                    |id: &&LaneId| network.lane(**id).is_some_and(|lane| lane.junction.is_some());
                let rear_m = -left_m - body.half_m.x;
                let hold = |lane: &LaneId| Hold { lane: *lane, id: body.id, rear_m };
                self.held.extend(lane.next.iter().filter(inside).map(hold));
            }
        }
    }

    /// Tells all who ask later in this tick that somebody changes lanes.
    pub(super) fn change(&mut self, id: ActorId, to_left: bool) {
        self.changes.push(Change { id, to_left });
    }

    /// Whether somebody changes to the lane on that side.
    pub(super) fn is_changing(&self, id: ActorId, to_left: bool) -> bool {
        self.changes.iter().any(|change| change.id == id && change.to_left == to_left)
    }

    pub(super) fn wish(&mut self, way: &Way, id: ActorId, eta_secs: f32, rank: u8) {
        let wishes = way.lanes.iter().map(|lane| Wish { lane: *lane, id, eta_secs, rank });
        self.wishes.extend(wishes);
    }

    /// Claims a way if nobody holds or is to have what crosses it; else tells who.
    pub(super) fn grant(
        &mut self,
        network: &Network,
        way: &Way,
        id: ActorId,
        rank: u8,
    ) -> Result<(), ActorId> {
        for lane in &way.lanes {
            let crosses_until_m = |other: LaneId| network.lane(other)?.crosses_until_m(*lane);
            let held = self.held.iter().find(|hold| {
                let until_m = crosses_until_m(hold.lane).filter(|_| hold.id != id);
                until_m.is_some_and(|until_m| hold.rear_m < until_m + CLEAR_M)
            });
            if let Some(hold) = held {
                return Err(hold.id);
            }
            let first = self.wishes.iter().find(|wish| {
                wish.id != id
                    && wish.rank > rank
                    && wish.eta_secs < GAP_SECS
                    && crosses_until_m(wish.lane).is_some()
            });
            if let Some(wish) = first {
                return Err(wish.id);
            }
        }
        let holds = way.lanes.iter().map(|lane| Hold { lane: *lane, id, rear_m: -way.entry_m });
        self.held.extend(holds);
        Ok(())
    }
}
