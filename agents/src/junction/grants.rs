//! The way of one vehicle through the next junction: what it asks for, and what it may drive.
//!
//! Lanes are granted by [`Claims`], and given back one by one as the vehicle leaves them.

use serde::{Deserialize, Serialize};

use super::claims::{Claims, Hold};
use crate::network::{Lane, LaneId, Network};
use crate::path::Path;
use crate::scene::Body;

/// Lanes looked at for the way through a junction.
const LEGS_MAX: usize = 16;

/// The next way through a junction that a vehicle has no claim on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Way {
    pub lanes: Vec<LaneId>,
    /// From the vehicle's origin.
    pub entry_m: f32,
    pub exit_m: f32,
    /// Entry of the junction after it; infinite where none is near.
    pub next_m: f32,
}

/// The lanes that a vehicle may drive through.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Grants {
    lanes: Vec<Grant>,
    waited_secs: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Grant {
    lane: LaneId,
    /// Way driven since the lane was left, or below zero while it is ahead.
    left_m: f32,
    /// Where on the lane the front is to wait, for a part of it.
    until_m: Option<f32>,
}

impl Way {
    /// Junctions nearer to each other than `room_m` are one.
    pub(crate) fn next(
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
    pub(crate) fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    fn holds(&self, lane: LaneId) -> bool {
        self.lanes.iter().any(|grant| grant.lane == lane)
    }

    /// Whether all that a snapshot may get wrong is right.
    pub(crate) fn is_consistent(&self) -> bool {
        let finite =
            |grant: &Grant| grant.left_m.is_finite() && grant.until_m.is_none_or(f32::is_finite);
        self.waited_secs.is_finite() && self.lanes.iter().all(finite)
    }

    /// Takes a way, as a whole or up to where the front is to wait on it.
    pub(crate) fn add(&mut self, way: &Way, until_m: Option<f32>) {
        self.lanes.retain(|grant| !way.lanes.contains(&grant.lane));
        let grant = |lane: &LaneId| Grant { lane: *lane, left_m: -1.0, until_m };
        self.lanes.extend(way.lanes.iter().map(grant));
        self.waited_secs = 0.0;
    }

    /// The way of which a part is claimed, and how far ahead of the origin the front is to wait.
    pub(crate) fn part(&self, path: &Path) -> Option<(Way, f32)> {
        path.ahead().take(LEGS_MAX).find_map(|(begins_m, leg)| {
            let grant = self.lanes.iter().find(|grant| grant.lane == leg.lane)?;
            let exit_m = begins_m + leg.length_m();
            let way =
                Way { lanes: vec![leg.lane], entry_m: begins_m, exit_m, next_m: f32::INFINITY };
            Some((way, begins_m - leg.from_m + grant.until_m?))
        })
    }

    /// Gives back what the vehicle's rear has left.
    pub(crate) fn drive_on(&mut self, path: &Path, driven_m: f32, half_length_m: f32) {
        for grant in &mut self.lanes {
            if path.ahead().take(LEGS_MAX).any(|(_, leg)| leg.lane == grant.lane) {
                grant.left_m = -1.0;
            } else {
                grant.left_m = grant.left_m.max(0.0) + driven_m;
            }
        }
        self.lanes.retain(|grant| grant.left_m <= half_length_m + 0.5);
    }

    /// Gives back what lies beyond a place on the path.
    pub(crate) fn give_up(&mut self, path: &Path, from_m: f32) {
        for (begins_m, leg) in path.ahead().take(LEGS_MAX) {
            if begins_m + 1.0 > from_m {
                self.lanes.retain(|grant| grant.lane != leg.lane);
            }
        }
    }

    /// Takes what the vehicle is on: whoever is put there has asked nobody.
    pub(crate) fn hold_present(&mut self, network: &Network, path: &Path) {
        let Some((_, leg)) = path.ahead().next() else { return };
        let inside = network.lane(leg.lane).is_some_and(|lane| lane.junction.is_some());
        if inside && !self.holds(leg.lane) {
            self.lanes.push(Grant { lane: leg.lane, left_m: -1.0, until_m: None });
        }
    }

    pub(crate) fn tell(&self, network: &Network, path: &Path, body: &Body, claims: &mut Claims) {
        let half_m = body.half_m.x;
        for grant in &self.lanes {
            let Grant { lane, left_m, until_m } = *grant;
            let ahead = path.ahead().take(LEGS_MAX).find(|(_, leg)| leg.lane == lane);
            let at_m = match ahead {
                Some((begins_m, leg)) => leg.from_m - begins_m,
                None => network.lane(lane).map_or(0.0, Lane::length_m) + left_m,
            };
            let eta_secs = (-at_m - half_m).max(0.0) / body.velocity_mps.norm().max(1.0);
            claims.tell(
                network,
                Hold { lane, id: body.id, rear_m: at_m - half_m, until_m, eta_secs },
            );
        }
    }

    /// Counts how long it stands and asks for a claim.
    pub(crate) fn wait(&mut self, dt_secs: f32, speed_mps: f32, asks: bool) {
        if speed_mps > 0.5 {
            self.waited_secs = 0.0;
        } else if asks {
            self.waited_secs += dt_secs;
        }
    }

    pub(crate) fn waited_secs(&self) -> f32 {
        self.waited_secs
    }
}
