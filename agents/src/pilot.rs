//! A driver for one vehicle.

use roads::Map;
use schemas::{PilotMode, Pose, Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

use crate::lane_change::{LaneChange, Manoeuvre};
use crate::speed::SpeedControl;
use crate::steering;
use crate::track::Track;

const GRAVITY_MPS2: f32 = 9.81;
/// Climb, as a sine, up to which a road counts as level: so far springs let a vehicle nod.
const LEVEL: f32 = 0.04;
/// What a vehicle has left at least that can start on a climb, in metres per second squared.
const SPARE_MPS2: f32 = 0.3;

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
    /// The tightest bend that its middle can follow; endless for who leans.
    pub bend_per_m_max: f32,
    /// Extra front wheel angle per sideways acceleration, in steady cornering.
    pub understeer_rad_per_mps2: f32,
    /// Friction of the road over that of a dry one: what a driver dares, as [`DRY`](Self::DRY).
    pub grip: f32,
    /// What the engine gives a vehicle that starts, at full throttle.
    pub start_mps2: f32,
}

impl VehicleView {
    /// Grip of a dry road.
    pub const DRY: f32 = 1.0;

    /// What gravity takes from a vehicle that climbs, in metres per second squared; below zero
    /// downhill, and 0 where it leans no more than its own springs let it.
    pub(crate) fn hill_mps2(&self) -> f32 {
        let forward = self.world_from_vehicle.rotation * Vec3::x();
        GRAVITY_MPS2 * (forward.z - forward.z.clamp(-LEVEL, LEVEL))
    }

    /// Sine of the steepest climb that it should drive up: where it can start though it nods.
    pub(crate) fn climb_max(&self) -> f32 {
        (self.start_mps2 - SPARE_MPS2) / GRAVITY_MPS2 - LEVEL
    }

    /// Whether it would roll back here at full throttle.
    pub(crate) fn is_too_steep(&self) -> bool {
        let forward = self.world_from_vehicle.rotation * Vec3::x();
        GRAVITY_MPS2 * forward.z > self.start_mps2 - SPARE_MPS2
    }
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
            bend_per_m_max: 0.24,
            understeer_rad_per_mps2: 0.0,
            grip: Self::DRY,
            start_mps2: 4.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use schemas::UnitQuaternion;

    use super::*;

    #[test]
    fn a_hill_takes_what_gravity_does_and_a_nod_takes_nothing() {
        let hill_mps2 = |slope: f32| {
            let rotation = UnitQuaternion::from_euler_angles(0.0, -slope.atan(), 0.7);
            let pose = Pose::from_parts(Vec3::zeros().into(), rotation);
            VehicleView::of_car(pose, Vec3::zeros()).hill_mps2()
        };
        for slope in [0.0, 0.03, -0.03] {
            assert_eq!(hill_mps2(slope), 0.0, "{slope}");
        }
        // sin(atan(0.36)) · 9.81 m/s² = 3.32 m/s², less 0.39 m/s² for the nod.
        for (slope, wanted) in [(0.36, 2.93), (-0.36, -2.93)] {
            assert!((hill_mps2(slope) - wanted).abs() < 0.01, "{slope}: {}", hill_mps2(slope));
        }
    }

    #[test]
    fn a_climb_is_too_steep_for_an_engine_that_gives_less_than_gravity_takes() {
        let is_too_steep = |start_mps2: f32, slope: f32| {
            let rotation = UnitQuaternion::from_euler_angles(0.0, -slope.atan(), 0.7);
            let pose = Pose::from_parts(Vec3::zeros().into(), rotation);
            let view = VehicleView::of_car(pose, Vec3::zeros());
            VehicleView { start_mps2, ..view }.is_too_steep()
        };
        assert!(is_too_steep(2.5, 0.36) && is_too_steep(3.5, 0.36));
        assert!(!is_too_steep(3.7, 0.36));
        assert!(!is_too_steep(2.5, 0.1) && !is_too_steep(2.5, -0.36));
    }
}
