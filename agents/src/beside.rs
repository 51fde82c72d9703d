//! Who drives on the lane beside, and whether there is room among them.

use nalgebra::RealField;
use schemas::ActorId;

use crate::network::{LanePoint, wrapped};
use crate::scene::{Body, Scene};

/// Whoever is behind on the other lane must not have to brake harder, nor who changes there.
pub(crate) const SAFE_MPS2: f32 = 2.0;
/// Standing room to those ahead and behind on the other lane.
pub(crate) const ROOM_M: f32 = 3.0;
/// Time at the speed of those behind on the other lane.
const BEHIND_SECS: f32 = 0.8;
/// How far back somebody counts.
const BACK_M: f32 = 50.0;
/// Middles of vehicles on one lane, and on the next, are nearer than this to its middle.
const LANE_M: f32 = 1.8;
const LANES_M: f32 = 5.5;
/// Room to vehicles on the lane beyond.
const BEYOND_M: f32 = 4.0;
/// Vehicles turned from the lane by more do not drive along it.
const TURN_RAD: f32 = 0.8;

/// Another vehicle as seen from the place on the lane beside that a vehicle would change to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Neighbour {
    pub id: ActorId,
    /// From its middle to the place, along the lane; below zero ahead of it.
    back_m: f32,
    /// Left of the lane's middle.
    left_m: f32,
    /// Half the lengths of both vehicles.
    reach_m: f32,
    /// Velocity along the lane and to its left.
    pub along_mps: f32,
    pub left_mps: f32,
}

impl Neighbour {
    /// From its front to the own rear; below zero for one abreast.
    pub(crate) fn gap_m(&self) -> f32 {
        self.back_m - self.reach_m
    }

    /// Whether it is on the lane, abreast or behind.
    pub(crate) fn is_behind(&self) -> bool {
        self.left_m.abs() <= LANE_M && (-self.reach_m..=BACK_M).contains(&self.back_m)
    }

    /// Whether it is on the lane beyond, on that side.
    pub(crate) fn is_beyond(&self, on_left: bool) -> bool {
        (LANE_M..LANES_M).contains(&self.left_m.abs()) && (self.left_m > 0.0) == on_left
    }

    pub(crate) fn is_abreast(&self) -> bool {
        self.back_m.abs() < self.reach_m + BEYOND_M
    }

    /// Whether it could stay behind somebody who changes to its lane at a speed.
    pub(crate) fn has_room(&self, speed_mps: f32) -> bool {
        let closing_mps = (self.along_mps - speed_mps).max(0.0);
        let needed_mps2 = closing_mps * closing_mps / (2.0 * self.gap_m().max(0.1));
        self.gap_m() >= ROOM_M + BEHIND_SECS * self.along_mps && needed_mps2 <= SAFE_MPS2
    }
}

/// Calls for every vehicle about a place on the lane beside, on it or on the next ones, that drives
/// the lane's way.
pub(crate) fn neighbours(
    scene: &Scene,
    own: &Body,
    place: &LanePoint,
    mut tell: impl FnMut(&Neighbour),
) {
    let along = place.heading();
    scene.near(&own.centre_m, BACK_M, |body: &Body| {
        let away = body.centre_m - place.point_m;
        let left_m = along.x * away.y - along.y * away.x;
        if body.id == own.id || body.is_walker || left_m.abs() >= LANES_M {
            return;
        }
        let body_rad = RealField::atan2(body.forward.y, body.forward.x);
        if wrapped(body_rad - place.heading_rad).abs() > TURN_RAD {
            return;
        }
        tell(&Neighbour {
            id: body.id,
            back_m: -away.dot(&along),
            left_m,
            reach_m: own.half_m.x + body.half_m.x,
            along_mps: along.dot(&body.velocity_mps).max(0.0),
            left_mps: along.x * body.velocity_mps.y - along.y * body.velocity_mps.x,
        });
    });
}
