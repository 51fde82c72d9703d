//! A vehicle as its maker publishes it, and what follows for the model.

use nalgebra::ComplexField;
use schemas::{Gear, Handling, Vec3, VehiclePhysics, WheelPhysics};

use super::engine::Engine;
use super::{BaseType, Driven, VehicleModel};

/// Standard gravity, metres per second squared.
const GRAVITY_MPS2: f32 = 9.81;
/// From the middle of the outer front wheel to its outer edge, which draws the turning circle.
const HALF_TYRE_M: f32 = 0.1;
/// Slip of the clutch at the engine's highest torque, in radians per second.
const CLUTCH_SLIP_RADPS: f32 = 15.0;
/// Drag of a disengaged engine over that of an engaged one.
const DISENGAGED_SHARE: f32 = 0.4;
/// Resistance of a free wheel's bearing, newton metre seconds.
const BEARING_NMS: f32 = 0.25;
/// (speed in metres per second, share of full lock that full control reaches): CARLA's default
/// steering curve of 20, 60 and 120 km/h.
const STEERING_CURVE: [(f32, f32); 4] = [(0.0, 1.0), (5.56, 0.9), (16.67, 0.8), (33.33, 0.7)];

/// Models older than anti-lock brakes, and one that need not have them; riders of two-wheelers
/// keep their wheels from locking by hand.
const WITHOUT_ANTI_LOCK: [&str; 3] =
    ["vehicle.ford.mustang", "vehicle.micro.microlino", "vehicle.volkswagen.t2"];
/// Further models from before stability control.
const WITHOUT_STABILITY_CONTROL: [&str; 2] = ["vehicle.ford.crown", "vehicle.nissan.patrol"];

fn has_none(id: &str) -> bool {
    WITHOUT_ANTI_LOCK.contains(&id) || WITHOUT_STABILITY_CONTROL.contains(&id)
}

/// What a client sees of a vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub paints: &'static [&'static str],
    pub drivers: &'static [&'static str],
    pub special: &'static str,
    pub generation: u8,
    pub lights: bool,
    pub doors: bool,
}

/// An automatic gearbox with its final drive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gearbox {
    pub forward: &'static [f32],
    pub reverse: f32,
    pub final_ratio: f32,
    pub shift_secs: f32,
}

/// What vehicles of a class share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chassis {
    pub clearance_m: f32,
    /// Friction of the tyres over that of the road.
    pub grip: f32,
    pub ride_hz: f32,
    pub damping_ratio: f32,
    /// Of the anti-roll bar, newtons per metre and kilogram.
    pub anti_roll_per_kg: f32,
    /// Mass of a wheel that would have its inertia at the rolling radius.
    pub rim_kg: f32,
    /// Deceleration for which the service brakes have torque, over gravity.
    pub brake_g: f32,
    pub brake_front_share: f32,
    /// The same of the hand brake, on the rear wheels alone.
    pub hand_brake_g: f32,
    /// Lateral slip stiffness over load, per radian, of front and rear. The front is softer, as
    /// steering and bushings yield: that makes a vehicle understeer, and stable at speed.
    pub stiffness: (f32, f32),
}

/// One vehicle as published, with driver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Design {
    pub id: &'static str,
    pub look: Look,
    pub base: BaseType,
    pub chassis: &'static Chassis,
    /// Length, width, height.
    pub size_m: [f32; 3],
    pub wheelbase_m: f32,
    pub track_m: f32,
    /// Between two rear axles; 0 for a single one.
    pub tandem_m: f32,
    pub wheel_radius_m: f32,
    pub mass_kg: f32,
    /// Share of the weight on the front wheels.
    pub front_share: f32,
    pub centre_height_m: f32,
    /// Diameter between kerbs.
    pub turning_circle_m: f32,
    /// Drag coefficient and frontal area in square metres.
    pub drag: (f32, f32),
    pub driven: Driven,
    pub engine: Engine,
    pub gearbox: &'static Gearbox,
}

impl Design {
    pub(super) fn model(&self) -> VehicleModel {
        let [length_m, width_m, height_m] = self.size_m;
        VehicleModel {
            base: self.base,
            length_m,
            width_m,
            height_m,
            ground_clearance_m: self.chassis.clearance_m,
            wheelbase_m: self.wheelbase_m,
            track_m: self.track_m,
            wheel_radius_m: self.wheel_radius_m,
            wheel_inertia_kgm2: self.chassis.rim_kg * self.wheel_radius_m * self.wheel_radius_m,
            frontal_area_m2: self.drag.1,
            ride_hz: self.chassis.ride_hz,
            damping_ratio: self.chassis.damping_ratio,
            anti_roll_n_per_m: self.chassis.anti_roll_per_kg * self.mass_kg,
            driven: self.driven,
            idle_rpm: self.engine.idle_rpm(),
            reverse_ratio: self.gearbox.reverse,
            efficiency: self.engine.efficiency(),
            physics: self.physics(),
        }
    }

    fn physics(&self) -> VehiclePhysics {
        let drag_nms = self.engine.drag_nms();
        let forward_m = (self.front_share - 0.5) * self.wheelbase_m;
        VehiclePhysics {
            torque_curve: self.engine.torque_curve(),
            engine_rpm_max: self.engine.rpm_max(),
            engine_inertia_kgm2: self.engine.inertia_kgm2(),
            // Published torque is what is left after the engine's own drag.
            damping_full_throttle: 0.0,
            damping_closed_throttle_clutch_engaged: drag_nms,
            damping_closed_throttle_clutch_disengaged: DISENGAGED_SHARE * drag_nms,
            automatic_gearbox: true,
            gear_switch_secs: self.gearbox.shift_secs,
            clutch_strength: self.engine.torque_nm() / CLUTCH_SLIP_RADPS,
            final_ratio: self.gearbox.final_ratio,
            forward_gears: self.gearbox.forward.iter().map(|&ratio| gear(ratio)).collect(),
            mass_kg: self.mass_kg,
            drag_coefficient: self.drag.0,
            centre_of_mass_m: Vec3::new(forward_m, 0.0, self.centre_height_m),
            steering_curve: STEERING_CURVE.to_vec(),
            wheels: self.wheels(),
            sweep_wheel_collision: false,
            handling: Handling::Real,
            anti_lock: !WITHOUT_ANTI_LOCK.contains(&self.id),
            stability_control: self.track_m > 0.0 && !has_none(self.id),
        }
    }

    /// Front left, front right, rear left, rear right, …; front and rear of two-wheelers.
    fn wheels(&self) -> Vec<WheelPhysics> {
        let half_base_m = self.wheelbase_m / 2.0;
        let half_tandem_m = self.tandem_m / 2.0;
        let axles_x_m: &[f32] = if self.tandem_m > 0.0 {
            &[half_base_m, half_tandem_m - half_base_m, -half_tandem_m - half_base_m]
        } else {
            &[half_base_m, -half_base_m]
        };
        let sides: &[f32] = if self.track_m > 0.0 { &[0.5, -0.5] } else { &[0.0] };
        let rear_count = ((axles_x_m.len() - 1) * sides.len()) as f32;
        let mut wheels = Vec::new();
        for &x_m in axles_x_m {
            for side in sides {
                let position_m = Vec3::new(x_m, side * self.track_m, self.wheel_radius_m);
                wheels.push(self.wheel(position_m, sides.len() as f32, rear_count));
            }
        }
        wheels
    }

    fn wheel(&self, position_m: Vec3, front_count: f32, rear_count: f32) -> WheelPhysics {
        let chassis = self.chassis;
        let is_front = position_m.x > 0.0;
        let torque_of_g_nm = self.mass_kg * GRAVITY_MPS2 * self.wheel_radius_m;
        let share = if is_front {
            chassis.brake_front_share / front_count
        } else {
            (1.0 - chassis.brake_front_share) / rear_count
        };
        let hand_share = if is_front { 0.0 } else { 1.0 / rear_count };
        WheelPhysics {
            tyre_friction: chassis.grip,
            damping_rate: BEARING_NMS,
            steer_rad_max: if is_front { self.full_lock_rad() } else { 0.0 },
            radius_m: self.wheel_radius_m,
            brake_nm_max: chassis.brake_g * torque_of_g_nm * share,
            hand_brake_nm_max: chassis.hand_brake_g * torque_of_g_nm * hand_share,
            lateral_stiffness_load_max: 2.0,
            lateral_stiffness: if is_front { chassis.stiffness.0 } else { chassis.stiffness.1 },
            longitudinal_stiffness: 22.0,
            position_m,
        }
    }

    /// Mean angle of the front wheels at which the outer one draws the turning circle.
    fn full_lock_rad(&self) -> f32 {
        let outer_m = self.turning_circle_m / 2.0 - HALF_TYRE_M;
        let base_m = self.wheelbase_m;
        let rear_m = (outer_m * outer_m - base_m * base_m).sqrt() - self.track_m / 2.0;
        ComplexField::atan(base_m / rear_m)
    }
}

fn gear(ratio: f32) -> Gear {
    Gear { ratio, down_share: 0.42, up_share: 0.92 }
}
