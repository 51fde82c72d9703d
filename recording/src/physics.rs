//! Physics of a vehicle, as a log has it.

use crate::bytes::{Cursor, Field, Long, Malformed, record};
use crate::record::Vector;

record! {
    /// One gear.
    Gear {
        /// Of engine speed to that of the shaft.
        ratio: f32,
        /// Share of the maximal engine speed below which the gear is left downwards.
        down_ratio: f32,
        /// Share of the maximal engine speed above which the gear is left upwards.
        up_ratio: f32,
    }
}

/// One wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhysicsWheel {
    /// As CARLA's `tire_friction`.
    pub tire_friction: f32,
    /// As CARLA's `damping_rate`.
    pub damping_rate: f32,
    /// In degrees.
    pub max_steer_angle: f32,
    /// In cm.
    pub radius: f32,
    /// In Nm.
    pub max_brake_torque: f32,
    /// In Nm.
    pub max_handbrake_torque: f32,
    /// As CARLA's `lat_stiff_max_load`, `lat_stiff_value` and `long_stiff_value`.
    pub stiffness: [f32; 3],
    /// In cm, in the world.
    pub position: [f32; 3],
}

impl Field for PhysicsWheel {
    const BYTES_MIN: usize = 36;

    fn put(&self, out: &mut Vec<u8>) {
        let Self { tire_friction, damping_rate, max_steer_angle, radius, .. } = *self;
        [tire_friction, damping_rate, max_steer_angle, radius].put(out);
        [self.max_brake_torque, self.max_handbrake_torque].put(out);
        [self.stiffness, self.position].put(out);
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let [tire_friction, damping_rate, max_steer_angle, radius] = Field::take(cursor)?;
        let [max_brake_torque, max_handbrake_torque] = Field::take(cursor)?;
        let stiffness = if cursor.layout.short_wheels { [0.0; 3] } else { Field::take(cursor)? };
        let position = Field::take(cursor)?;
        Ok(Self {
            tire_friction,
            damping_rate,
            max_steer_angle,
            radius,
            max_brake_torque,
            max_handbrake_torque,
            stiffness,
            position,
        })
    }
}

record! {
    /// The physics of a vehicle; numbers as in CARLA's `VehiclePhysicsControl`.
    PhysicsControl {
        /// Which vehicle.
        id: u32,
        /// Of the engine.
        max_rpm: f32,
        /// Of the engine, in kg m².
        moi: f32,
        /// Of the engine.
        damping_rate_full_throttle: f32,
        /// Of the engine.
        damping_rate_zero_throttle_clutch_engaged: f32,
        /// Of the engine.
        damping_rate_zero_throttle_clutch_disengaged: f32,
        /// Whether it shifts by itself.
        use_gear_autobox: bool,
        /// Of the clutch.
        clutch_strength: f32,
        /// Of the axle.
        final_ratio: f32,
        /// In kg.
        mass: f32,
        /// In air.
        drag_coefficient: f32,
        /// In metres, in the frame of the vehicle.
        center_of_mass: Vector,
        /// Revolutions per minute and Nm.
        torque_curve: Long<[f32; 2]>,
        /// From the first on.
        forward_gears: Long<Gear>,
        /// km/h and share of the steering angle.
        steering_curve: Long<[f32; 2]>,
        /// From the front left on.
        wheels: Long<PhysicsWheel>,
    }
}
