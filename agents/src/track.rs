//! The lane a vehicle follows.

use nalgebra::{Isometry3, Vector3};
use roads::{LaneTypes, Map, Waypoint};
use schemas::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// A lane farther away than this is not the vehicle's.
const LANE_DISTANCE_M_MAX: f64 = 6.0;
/// Sideways acceleration that curves ahead are taken with, and braking towards them.
const CURVE_MPS2: f64 = 3.0;
const CURVE_BRAKING_MPS2: f64 = 2.5;
/// Spacing of the places ahead whose curvature counts.
const PREVIEW_STEP_M: f64 = 4.0;
const PREVIEW_COUNT_MAX: usize = 12;
/// Chord over which curvature is measured.
const CHORD_M: f64 = 2.0;

/// A place on a lane that moves along with the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Track {
    at: Waypoint,
    /// The lane ends here.
    ended: bool,
}

/// The vehicle seen from its place on the lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Left of the lane's middle.
    pub left_m: f32,
    /// Velocity along the lane and to its left.
    pub along_mps: f32,
    pub left_mps: f32,
    /// Of the lane, positive when it turns left.
    pub curvature_per_m: f32,
}

impl Track {
    /// The driving lane that the vehicle is on, if it leads its way.
    pub(crate) fn nearest(map: &Map, world_from_vehicle: &Pose) -> Option<Self> {
        let position: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let at = map.nearest(position.into(), LaneTypes::DRIVING)?;
        let lane = map.pose(&at);
        let near = (lane.translation.vector - position).xy().norm() <= LANE_DISTANCE_M_MAX;
        let heading: Vector3<f64> = nalgebra::convert(world_from_vehicle.rotation * Vec3::x());
        (near && heading_of(&lane).dot(&heading) > 0.0).then_some(Self { at, ended: false })
    }

    pub(crate) fn left(&self, map: &Map) -> Option<Self> {
        Some(Self { at: map.left_driving(&self.at)?, ended: false })
    }

    pub(crate) fn right(&self, map: &Map) -> Option<Self> {
        Some(Self { at: map.right_driving(&self.at)?, ended: false })
    }

    /// Moves the place abreast of the vehicle; at a fork the straightest way is taken.
    pub(crate) fn advance(&mut self, map: &Map, world_from_vehicle: &Pose) {
        let lane = map.pose(&self.at);
        let position: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let ahead_m = heading_of(&lane).dot(&(position - lane.translation.vector));
        if ahead_m > 0.01 {
            match straightest(map, &self.at, &lane, ahead_m) {
                Some(next) => self.at = next,
                None => self.ended = true,
            }
        }
    }

    pub(crate) fn place(&self, map: &Map, world_from_vehicle: &Pose, velocity: Vec3) -> Place {
        let lane = map.pose(&self.at);
        let position: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let velocity: Vector3<f64> = nalgebra::convert(velocity);
        let left = lane.rotation * Vector3::y();
        Place {
            left_m: left.dot(&(position - lane.translation.vector)) as f32,
            along_mps: heading_of(&lane).dot(&velocity) as f32,
            left_mps: left.dot(&velocity) as f32,
            curvature_per_m: curvature_per_m(map, &self.at, &lane) as f32,
        }
    }

    /// Fastest speed from which the curves ahead and the lane's end can be met.
    pub(crate) fn speed_limit_mps(&self, map: &Map, speed_mps: f32) -> f32 {
        if self.ended {
            return 0.0;
        }
        let speed = f64::from(speed_mps);
        let preview_m = speed * speed / (2.0 * CURVE_BRAKING_MPS2) + 2.0 * PREVIEW_STEP_M;
        let mut limit = f64::INFINITY;
        let mut at = self.at;
        for step in 0..PREVIEW_COUNT_MAX {
            let distance_m = step as f64 * PREVIEW_STEP_M;
            if distance_m > preview_m {
                break;
            }
            let lane = map.pose(&at);
            let curvature = curvature_per_m(map, &at, &lane).abs().max(1.0e-6);
            let braked = 2.0 * CURVE_BRAKING_MPS2 * distance_m;
            limit = f64::min(limit, (CURVE_MPS2 / curvature + braked).sqrt());
            match straightest(map, &at, &lane, PREVIEW_STEP_M) {
                Some(next) => at = next,
                None => {
                    limit = f64::min(limit, braked.sqrt());
                    break;
                }
            }
        }
        limit as f32
    }
}

fn heading_of(lane: &Isometry3<f64>) -> Vector3<f64> {
    lane.rotation * Vector3::x()
}

/// The way on that turns least; the first of equals.
fn straightest(
    map: &Map,
    from: &Waypoint,
    lane: &Isometry3<f64>,
    distance_m: f64,
) -> Option<Waypoint> {
    let heading = heading_of(lane);
    let mut best: Option<(f64, Waypoint)> = None;
    for candidate in map.next(from, distance_m) {
        let along = heading_of(&map.pose(&candidate)).dot(&heading);
        if best.is_none_or(|(least, _)| along > least) {
            best = Some((along, candidate));
        }
    }
    best.map(|(_, waypoint)| waypoint)
}

/// Of the lane's middle, positive to the left; 0 at its end.
fn curvature_per_m(map: &Map, at: &Waypoint, lane: &Isometry3<f64>) -> f64 {
    let Some(next) = straightest(map, at, lane, CHORD_M) else { return 0.0 };
    let (from, to) = (heading_of(lane), heading_of(&map.pose(&next)));
    // The sine of the turn; on the curves of roads it equals the turn to within a percent.
    (from.x * to.y - from.y * to.x) / CHORD_M
}
