//! Physics of a vehicle as recordings have it.

use recording::{Gear, Long, PhysicsControl, PhysicsWheel, Vector};

use super::{VehiclePhysicsControl, Wheel};
use crate::dialect::Vector2D;

impl VehiclePhysicsControl {
    /// Of the vehicle with this id.
    pub(crate) fn recorded(&self, id: u32) -> PhysicsControl {
        let point = |point: &Vector2D| [point.x, point.y];
        let gear = |gear: &super::Gear| Gear {
            ratio: gear.ratio,
            down_ratio: gear.down_ratio,
            up_ratio: gear.up_ratio,
        };
        let centre = self.center_of_mass;
        PhysicsControl {
            id,
            max_rpm: self.max_rpm,
            moi: self.moi,
            damping_rate_full_throttle: self.damping_rate_full_throttle,
            damping_rate_zero_throttle_clutch_engaged: self
                .damping_rate_zero_throttle_clutch_engaged,
            damping_rate_zero_throttle_clutch_disengaged: self
                .damping_rate_zero_throttle_clutch_disengaged,
            use_gear_autobox: self.use_gear_autobox,
            clutch_strength: self.clutch_strength,
            final_ratio: self.final_ratio,
            mass: self.mass,
            drag_coefficient: self.drag_coefficient,
            center_of_mass: Vector { x: centre.x, y: centre.y, z: centre.z },
            torque_curve: Long(self.torque_curve.iter().map(point).collect()),
            forward_gears: Long(self.forward_gears.iter().map(gear).collect()),
            steering_curve: Long(self.steering_curve.iter().map(point).collect()),
            wheels: Long(self.wheels.iter().map(Wheel::recorded).collect()),
        }
    }
}

impl Wheel {
    fn recorded(&self) -> PhysicsWheel {
        PhysicsWheel {
            tire_friction: self.tire_friction,
            damping_rate: self.damping_rate,
            max_steer_angle: self.max_steer_angle,
            radius: self.radius,
            max_brake_torque: self.max_brake_torque,
            max_handbrake_torque: self.max_handbrake_torque,
            stiffness: [self.lat_stiff_max_load, self.lat_stiff_value, self.long_stiff_value],
            position: [self.position.x, self.position.y, self.position.z],
        }
    }
}
