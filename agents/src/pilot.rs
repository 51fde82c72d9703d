//! A driver for one vehicle.

use roads::Map;
use schemas::{PilotMode, Pose, Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

use crate::lane_change::{LaneChange, Manoeuvre};
use crate::speed::SpeedControl;
use crate::steering;
use crate::track::Track;

/// Keeps a lane at a speed, after a lane change if one was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pilot {
    /// `None` when there is no lane near that leads the vehicle's way.
    track: Option<Track>,
    lane_change: Option<LaneChange>,
    speed: SpeedControl,
}

/// What a pilot knows of its vehicle, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleView {
    /// Origin at the box centre on the ground.
    pub world_from_vehicle: Pose,
    /// Of the centre of mass.
    pub velocity_mps: Vec3,
    /// Between the axles.
    pub wheelbase_m: f32,
    /// Front wheel angle that a steer of 1 reaches at this speed: in the mean or, where
    /// `half_track_m` is not 0, of the inner wheel.
    pub full_lock_rad: f32,
    /// Half the distance between front wheels of which the inner one is steered.
    pub half_track_m: f32,
    /// Extra front wheel angle per sideways acceleration, in steady cornering.
    pub understeer_rad_per_mps2: f32,
    /// Friction of the road over that of a dry one: what a driver dares, as [`DRY`](Self::DRY).
    pub grip: f32,
}

impl VehicleView {
    /// Grip of a dry road.
    pub const DRY: f32 = 1.0;
}

impl Pilot {
    /// A driver who takes over at this pose and velocity.
    ///
    /// A lane change to a side without a driving lane of the same direction keeps the lane.
    ///
    /// - **Domain:** `target_speed_mps` is not negative.
    pub fn new(map: &Map, mode: PilotMode, target_speed_mps: f32, view: &VehicleView) -> Self {
        let own = Track::nearest(map, &view.world_from_vehicle);
        let neighbour = own.as_ref().and_then(|track| match mode {
            PilotMode::KeepLane => None,
            PilotMode::ChangeLaneLeft => track.left(map),
            PilotMode::ChangeLaneRight => track.right(map),
        });
        let manoeuvre = if neighbour.is_some() { Manoeuvre::Change } else { Manoeuvre::Return };
        let track = neighbour.or(own);
        let lane_change = track.as_ref().and_then(|track| {
            let place = track.place(map, &view.world_from_vehicle, view.velocity_mps);
            LaneChange::plan(manoeuvre, &place, view.grip)
        });
        Self { track, lane_change, speed: SpeedControl::new(target_speed_mps) }
    }

    /// With what the driver before knew of the pedals that hold a speed here.
    #[must_use]
    pub fn after(mut self, before: &Self) -> Self {
        self.speed = self.speed.after(&before.speed);
        self
    }

    /// The control for the next `dt_secs`.
    pub fn control(&mut self, map: &Map, view: &VehicleView, dt_secs: f32) -> VehicleControl {
        let forward = view.world_from_vehicle.rotation * Vec3::x();
        let speed_mps = view.velocity_mps.dot(&forward);
        let mut steer = 0.0;
        let mut limit_mps = f32::INFINITY;
        if let Some(track) = &mut self.track {
            track.advance(map, &view.world_from_vehicle);
            let place = track.place(map, &view.world_from_vehicle, view.velocity_mps);
            let reference = LaneChange::advance(&mut self.lane_change, place.along_mps, dt_secs);
            steer = steering::steer(&place, &reference, view);
            limit_mps = track.speed_limit_mps(map, speed_mps, view.grip);
        }
        let (throttle, brake) = self.speed.pedals(speed_mps, limit_mps, dt_secs);
        VehicleControl { throttle, steer, brake, ..VehicleControl::default() }
    }
}

#[cfg(test)]
impl VehicleView {
    /// A car's at a pose, with a velocity.
    pub(crate) fn of_car(world_from_vehicle: Pose, velocity_mps: Vec3) -> Self {
        Self {
            world_from_vehicle,
            velocity_mps,
            wheelbase_m: 2.8,
            full_lock_rad: 0.6,
            half_track_m: 0.0,
            understeer_rad_per_mps2: 0.0,
            grip: Self::DRY,
        }
    }
}
