//! What makes a vehicle drive as it does, and what it measures: CARLA's vehicle physics in SI units
//! and ISO 8855 axes.

use serde::{Deserialize, Serialize};

use crate::Vec3;

/// CARLA's Ackermann target with ISO 8855 signs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AckermannControl {
    /// Angle of the road wheels, positive left.
    pub steer_rad: f32,
    /// Highest rate of change of the angle; 0 means at once.
    pub steer_radps: f32,
    /// Negative drives backwards.
    pub speed_mps: f32,
    /// Highest change of speed; 0 means as fast as the controller can.
    pub acceleration_mps2: f32,
    /// Highest change of acceleration; 0 means any.
    pub jerk_mps3: f32,
}

/// Gains of the Ackermann controller's two PID loops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub struct AckermannGains {
    pub speed_kp: f32,
    pub speed_ki: f32,
    pub speed_kd: f32,
    pub acceleration_kp: f32,
    pub acceleration_ki: f32,
    pub acceleration_kd: f32,
}

/// A gear of a gearbox.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gear {
    /// Turns of the gearbox's input for one of its output.
    pub ratio: f32,
    /// Share of the highest engine speed below which the gearbox changes down.
    pub down_share: f32,
    /// Share of the highest engine speed above which it changes up.
    pub up_share: f32,
}

/// One wheel with CARLA's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelPhysics {
    /// Friction coefficient of the tyre over that of the road.
    pub tyre_friction: f32,
    /// Resistance of the free wheel, newton metre seconds.
    pub damping_rate: f32,
    /// Angle at full lock; 0 for a wheel that does not steer.
    pub steer_rad_max: f32,
    /// Of the rolling wheel.
    pub radius_m: f32,
    /// Torque of the service brake.
    pub brake_nm_max: f32,
    /// Torque of the hand brake.
    pub hand_brake_nm_max: f32,
    /// Load over the nominal one up to which cornering stiffness grows.
    pub lateral_stiffness_load_max: f32,
    /// Cornering stiffness over the load, per radian.
    pub lateral_stiffness: f32,
    /// Stiffness along the wheel over the load.
    pub longitudinal_stiffness: f32,
    /// Centre of the wheel in the vehicle's frame.
    pub position_m: Vec3,
}

/// How a vehicle answers its controls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Handling {
    /// As a real one: the lock is the mean angle of the front wheels, which turn by at most 1 rad/s
    /// as a driver's hands do it; the engine idles, and the box changes gears by the throttle.
    #[default]
    Real,
    /// As CARLA's: the lock is the angle of the inner wheel, and control is followed by 2.5 of its
    /// range per second away from the middle and by 5 towards it; the engine drives all wheels and
    /// is coupled down to a standstill, and the box changes gears by engine speed alone.
    Carla,
}

/// CARLA's `VehiclePhysicsControl`, and how the vehicle answers its controls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VehiclePhysics {
    /// (revolutions per minute, newton metres) at full throttle, ascending.
    pub torque_curve: Vec<(f32, f32)>,
    /// Revolutions per minute.
    pub engine_rpm_max: f32,
    /// Kilogram square metres.
    pub engine_inertia_kgm2: f32,
    /// Drag of the engine, newton metre seconds.
    pub damping_full_throttle: f32,
    /// Drag with closed throttle and engaged clutch.
    pub damping_closed_throttle_clutch_engaged: f32,
    /// Drag with closed throttle and disengaged clutch.
    pub damping_closed_throttle_clutch_disengaged: f32,
    /// Changes gears by itself.
    pub automatic_gearbox: bool,
    /// Without torque during a change of gear.
    pub gear_switch_secs: f32,
    /// How hard the clutch couples.
    pub clutch_strength: f32,
    /// Turns of the gearbox's output for one of the wheels.
    pub final_ratio: f32,
    /// First gear first.
    pub forward_gears: Vec<Gear>,
    /// Of the whole vehicle.
    pub mass_kg: f32,
    /// Of the air.
    pub drag_coefficient: f32,
    /// In the vehicle's frame.
    pub centre_of_mass_m: Vec3,
    /// (metres per second, share of the full lock), ascending.
    pub steering_curve: Vec<(f32, f32)>,
    /// Front left, front right, rear left, rear right, and further rear axles.
    pub wheels: Vec<WheelPhysics>,
    /// CARLA's switch for wheels that collide as volumes; ours always do.
    pub sweep_wheel_collision: bool,
    /// Which of both a vehicle has; CARLA's clients cannot ask for the other.
    pub handling: Handling,
    /// Whether the foot brake keeps wheels from locking.
    pub anti_lock: bool,
    /// Whether single wheels are braked to keep the vehicle on the course that it is steered for;
    /// nothing comes of it on fewer than four wheels.
    pub stability_control: bool,
}

/// What one wheel did in the last tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WheelTelemetry {
    /// Friction coefficient in force.
    pub tyre_friction: f32,
    /// Radians, positive when the wheel slides left.
    pub lateral_slip: f32,
    /// Slip over rolling speed.
    pub longitudinal_slip: f32,
    /// Positive forward.
    pub spin_radps: f32,
    /// On the ground.
    pub load_n: f32,
    /// Load over the load at rest.
    pub load_share: f32,
    /// Of drive and brakes.
    pub torque_nm: f32,
    /// Of the ground on the tyre, along the wheel.
    pub longitudinal_force_n: f32,
    /// Of the ground on the tyre, to its left.
    pub lateral_force_n: f32,
    /// Force over the tyre's friction limit.
    pub longitudinal_force_share: f32,
    /// Force over the tyre's friction limit.
    pub lateral_force_share: f32,
}

/// What a vehicle did in the last tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehicleTelemetry {
    /// Along the vehicle, negative backwards.
    pub speed_mps: f32,
    /// As in [`VehicleControl`](crate::VehicleControl).
    pub steer: f32,
    /// 0 to 1.
    pub throttle: f32,
    /// 0 to 1.
    pub brake: f32,
    /// Revolutions per minute.
    pub engine_rpm: f32,
    /// -1 reverse, 0 neutral.
    pub gear: i8,
    /// Of the air.
    pub drag_n: f32,
    /// In the order of [`VehiclePhysics::wheels`].
    pub wheels: Vec<WheelTelemetry>,
}
