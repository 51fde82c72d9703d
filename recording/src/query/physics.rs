//! Physics of a vehicle as text.

use std::fmt::{self, Write as _};

use super::info::Three;
use super::number::Number;
use crate::physics::{PhysicsControl, PhysicsWheel};

pub(super) fn write_physics(text: &mut String, one: &PhysicsControl) -> fmt::Result {
    writeln!(text, "  Id: {}", one.id)?;
    for (name, value) in [
        ("max_rpm", one.max_rpm),
        ("MOI", one.moi),
        ("damping_rate_full_throttle", one.damping_rate_full_throttle),
        (
            "damping_rate_zero_throttle_clutch_engaged",
            one.damping_rate_zero_throttle_clutch_engaged,
        ),
        (
            "damping_rate_zero_throttle_clutch_disengaged",
            one.damping_rate_zero_throttle_clutch_disengaged,
        ),
    ] {
        writeln!(text, "   {name} = {}", Number::from(value))?;
    }
    writeln!(text, "   use_gear_auto_box = {}", one.use_gear_autobox)?;
    // Not in logs: CARLA prints its default.
    writeln!(text, "   gear_switch_time = 0.5")?;
    for (name, value) in [
        ("clutch_strength", one.clutch_strength),
        ("final_ratio", one.final_ratio),
        ("mass", one.mass),
        ("drag_coefficient", one.drag_coefficient),
    ] {
        writeln!(text, "   {name} = {}", Number::from(value))?;
    }
    writeln!(text, "   center_of_mass = {}", Three::of(one.center_of_mass))?;
    write_curve(text, "torque_curve", &one.torque_curve)?;
    write_curve(text, "steering_curve", &one.steering_curve)?;
    writeln!(text, "   forward_gears:")?;
    for (index, gear) in one.forward_gears.iter().enumerate() {
        let [ratio, down, up] = [gear.ratio, gear.down_ratio, gear.up_ratio].map(Number::from);
        writeln!(text, "    gear {index}: ratio {ratio} down_ratio {down} up_ratio {up}")?;
    }
    writeln!(text, "   wheels:")?;
    let mut wheels = one.wheels.iter().enumerate();
    wheels.try_for_each(|(index, wheel)| write_wheel(text, index, wheel))
}

fn write_curve(text: &mut String, name: &str, curve: &[[f32; 2]]) -> fmt::Result {
    write!(text, "   {name} =")?;
    for [x, y] in curve {
        write!(text, " ({}, {})", Number::from(*x), Number::from(*y))?;
    }
    writeln!(text)
}

fn write_wheel(text: &mut String, index: usize, wheel: &PhysicsWheel) -> fmt::Result {
    write!(text, "    wheel {index}:")?;
    for (name, value) in [
        ("tire_friction", wheel.tire_friction),
        ("damping_rate", wheel.damping_rate),
        ("max_steer_angle", wheel.max_steer_angle),
        ("radius", wheel.radius),
        ("max_brake_torque", wheel.max_brake_torque),
        ("max_handbrake_torque", wheel.max_handbrake_torque),
    ] {
        write!(text, " {name} {}", Number::from(value))?;
    }
    writeln!(text, " position {}", Three(wheel.position))
}
