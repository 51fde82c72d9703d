//! What makes one vehicle differ from another.

use super::{WHEEL_COUNT, steering};

/// Standard gravity, metres per second squared.
pub(crate) const GRAVITY_MPS2: f32 = 9.81;

/// Lateral slip stiffness of the axles over load, per radian. The front is softer, as steering and
/// bushings yield: that makes a passenger car understeer, and stable at speed.
const FRONT_STIFFNESS: f32 = 15.0;
const REAR_STIFFNESS: f32 = 20.0;

/// A vehicle as data; lengths from the ground under the box centre.
#[derive(Clone, Debug)]
pub(crate) struct VehicleSpec {
    pub length_m: f32,
    pub width_m: f32,
    pub height_m: f32,
    pub ground_clearance_m: f32,
    pub wheelbase_m: f32,
    pub track_m: f32,
    pub wheel_radius_m: f32,
    /// Of one wheel with tyre and brake disc.
    pub wheel_inertia_kgm2: f32,
    pub mass_kg: f32,
    pub centre_of_mass_forward_m: f32,
    pub centre_of_mass_height_m: f32,
    /// Natural frequency of the body on its springs.
    pub ride_hz: f32,
    /// Of the body on its springs; 1 is critical.
    pub damping_ratio: f32,
    /// Load moved between the wheels of an axle per metre of difference in compression.
    pub anti_roll_n_per_m: f32,
    /// Mean angle of the front wheels at full lock.
    pub steer_rad_max: f32,
    /// Friction of the tyres over that of the surface's nominal coefficient.
    pub grip: f32,
    pub driven: Driven,
    pub engine: EngineSpec,
    pub gearbox: GearboxSpec,
    /// Torque of all brakes at full pressure.
    pub brake_nm: f32,
    pub brake_front_share: f32,
    /// Torque of the hand brake on each rear wheel.
    pub hand_brake_nm: f32,
    /// Drag coefficient times frontal area.
    pub drag_area_m2: f32,
}

/// Which wheels the engine turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Driven {
    Front,
    Rear,
    All,
}

/// An engine or motor.
#[derive(Clone, Debug)]
pub(crate) struct EngineSpec {
    /// (revolutions per minute, newton metres) at full throttle, ascending; zero beyond the last.
    pub torque_nm: &'static [(f32, f32)],
    /// 0 for an electric motor, which needs no clutch.
    pub idle_rpm: f32,
    /// Drag with closed throttle.
    pub drag_nm: f32,
    pub inertia_kgm2: f32,
}

/// An automatic gearbox.
#[derive(Clone, Debug)]
pub(crate) struct GearboxSpec {
    /// Ratios, first gear first.
    pub forward: &'static [f32],
    pub reverse: f32,
    pub final_drive: f32,
    pub efficiency: f32,
    /// Without torque during a change of gear.
    pub shift_secs: f32,
}

impl Driven {
    /// Share of the engine's torque at a wheel.
    pub(super) fn share(self, wheel: usize) -> f32 {
        match (self, is_front(wheel)) {
            (Self::Front, true) | (Self::Rear, false) => 0.5,
            (Self::All, _) => 0.25,
            _ => 0.0,
        }
    }
}

impl VehicleSpec {
    /// Load of a wheel at rest on level ground, in newtons.
    pub(super) fn static_load_n(&self, wheel: usize) -> f32 {
        let front_share = 0.5 + self.centre_of_mass_forward_m / self.wheelbase_m;
        let axle_share = if is_front(wheel) { front_share } else { 1.0 - front_share };
        self.mass_kg * GRAVITY_MPS2 * axle_share / 2.0
    }

    /// Wheel centre over the contact point, in the vehicle's x-y plane.
    pub(super) fn wheel_xy_m(&self, wheel: usize) -> (f32, f32) {
        let x = if is_front(wheel) { self.wheelbase_m } else { -self.wheelbase_m };
        let y = if is_left(wheel) { self.track_m } else { -self.track_m };
        (x / 2.0, y / 2.0)
    }

    /// Wheel contact points at rest, in the vehicle's x-y plane.
    pub(crate) fn contacts_xy_m(&self) -> [(f32, f32); WHEEL_COUNT] {
        std::array::from_fn(|wheel| self.wheel_xy_m(wheel))
    }

    /// Mean front wheel angle that full control reaches at a speed.
    pub(crate) fn full_lock_rad(&self, speed_mps: f32) -> f32 {
        self.steer_rad_max * steering::speed_share(speed_mps)
    }

    /// Principal moments of inertia about x, y, z through the centre of mass.
    ///
    /// - **Source:** radii of gyration of passenger cars as shares of the box, about 0.36 of half
    ///   the width and height diagonal in roll, 0.25 of the length in pitch and 0.26 in yaw.
    pub(crate) fn inertia_kgm2(&self) -> [f32; 3] {
        let roll_m = 0.36 * self.width_m;
        let pitch_m = 0.25 * self.length_m;
        let yaw_m = 0.26 * self.length_m;
        [roll_m, pitch_m, yaw_m].map(|radius_m| self.mass_kg * radius_m * radius_m)
    }
}

pub(super) fn is_front(wheel: usize) -> bool {
    wheel < 2
}

pub(super) fn is_left(wheel: usize) -> bool {
    wheel.is_multiple_of(2)
}

/// Lateral slip stiffness of a wheel over its load, per radian.
pub(super) fn lateral_stiffness(wheel: usize) -> f32 {
    if is_front(wheel) { FRONT_STIFFNESS } else { REAR_STIFFNESS }
}

/// Extra front wheel angle per sideways acceleration, in steady cornering.
pub(crate) fn understeer_rad_per_mps2() -> f32 {
    (1.0 / FRONT_STIFFNESS - 1.0 / REAR_STIFFNESS) / GRAVITY_MPS2
}
