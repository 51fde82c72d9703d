//! Whether a vehicle's parameters are usable.

use schemas::{
    AckermannControl, AckermannGains, Error, ErrorCode, VehiclePhysics, WheelPhysics, limits,
};

use super::fit::Fit;
use crate::check::{range, vector};

/// A vehicle lighter than this is blown away by its own springs.
const MASS_KG: (f32, f32) = (10.0, 200_000.0);
const RPM_MAX: f32 = 100_000.0;
const TORQUE_NM_MAX: f32 = 1.0e6;
const BRAKE_NM_MAX: f32 = 1.0e7;
const RATIO_MAX: f32 = 1_000.0;
/// Farthest that a wheel or the centre of mass may be from the vehicle's origin.
const ARM_M_MAX: f32 = 20.0;
/// Just below a quarter turn.
const STEER_RAD_MAX: f32 = 1.57;
const ACCELERATION_MPS2_MAX: f32 = 1_000.0;
const GAIN_MAX: f32 = 1_000.0;

/// # Errors
/// `InvalidArgument` for parameters that this vehicle cannot have.
pub(crate) fn physics(physics: &VehiclePhysics, standard: &Fit) -> Result<(), Error> {
    curve("torque curve", &physics.torque_curve, (RPM_MAX, TORQUE_NM_MAX))?;
    curve("steering curve", &physics.steering_curve, (limits::SPEED_MPS_MAX, 1.0))?;
    count("forward gears", physics.forward_gears.len(), 1)?;
    count("wheels", physics.wheels.len(), 1)?;
    if physics.wheels.len() != standard.wheels.len() {
        return Err(Error::new(ErrorCode::InvalidArgument, "a vehicle keeps its wheels")
            .wanted(format!("{} wheels", standard.wheels.len()))
            .found(physics.wheels.len()));
    }
    for (what, value, low, high, unit) in [
        ("highest engine speed", physics.engine_rpm_max, 1.0, RPM_MAX, "rpm"),
        ("engine inertia", physics.engine_inertia_kgm2, 1.0e-3, 1.0e3, "kg m²"),
        ("damping at full throttle", physics.damping_full_throttle, 0.0, 1.0e3, "N m s"),
        (
            "damping with engaged clutch",
            physics.damping_closed_throttle_clutch_engaged,
            0.0,
            1.0e3,
            "N m s",
        ),
        (
            "damping with disengaged clutch",
            physics.damping_closed_throttle_clutch_disengaged,
            0.0,
            1.0e3,
            "N m s",
        ),
        ("time of a change of gear", physics.gear_switch_secs, 0.0, 10.0, "s"),
        ("clutch strength", physics.clutch_strength, 0.0, 1.0e6, "N m s"),
        ("final ratio", physics.final_ratio, 1.0e-3, RATIO_MAX, ""),
        ("mass", physics.mass_kg, MASS_KG.0, MASS_KG.1, "kg"),
        ("drag coefficient", physics.drag_coefficient, 0.0, 100.0, ""),
    ] {
        range(what, value, low, high, unit)?;
    }
    for gear in &physics.forward_gears {
        range("ratio of a gear", gear.ratio, 1.0e-3, RATIO_MAX, "")?;
        range("share for changing down", gear.down_share, 0.0, 10.0, "")?;
        range("share for changing up", gear.up_share, 0.0, 10.0, "")?;
    }
    vector("centre of mass", physics.centre_of_mass_m, ARM_M_MAX, "m from the origin")?;
    physics.wheels.iter().try_for_each(wheel)
}

fn wheel(wheel: &WheelPhysics) -> Result<(), Error> {
    vector("place of a wheel", wheel.position_m, ARM_M_MAX, "m from the origin")?;
    for (what, value, low, high, unit) in [
        ("friction of a tyre", wheel.tyre_friction, 0.0, 100.0, ""),
        ("damping of a wheel", wheel.damping_rate, 0.0, 1.0e3, "N m s"),
        ("angle of a wheel", wheel.steer_rad_max, 0.0, STEER_RAD_MAX, "rad"),
        ("radius of a wheel", wheel.radius_m, 0.05, 3.0, "m"),
        ("brake torque", wheel.brake_nm_max, 0.0, BRAKE_NM_MAX, "N m"),
        ("hand brake torque", wheel.hand_brake_nm_max, 0.0, BRAKE_NM_MAX, "N m"),
        ("load of the highest stiffness", wheel.lateral_stiffness_load_max, 1.0e-2, 1.0e3, ""),
        ("lateral stiffness", wheel.lateral_stiffness, 1.0e-2, 1.0e5, "per rad"),
        ("longitudinal stiffness", wheel.longitudinal_stiffness, 1.0e-2, 1.0e5, ""),
    ] {
        range(what, value, low, high, unit)?;
    }
    Ok(())
}

/// # Errors
/// `InvalidArgument` for a curve that is empty, too long, out of bounds or not ascending.
fn curve(what: &str, points: &[(f32, f32)], highest: (f32, f32)) -> Result<(), Error> {
    count(what, points.len(), 1)?;
    for &(at, value) in points {
        range(what, at, 0.0, highest.0, "")?;
        range(what, value, 0.0, highest.1, "")?;
    }
    if points.windows(2).all(|pair| pair[0].0 <= pair[1].0) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, format!("the {what} does not ascend"))
        .wanted("points in ascending order")
        .found(format!("{points:?}")))
}

fn count(what: &str, found: usize, least: usize) -> Result<(), Error> {
    if (least..=limits::VEHICLE_PARTS_MAX).contains(&found) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, format!("the number of {what} is out of range"))
        .wanted(format!("{least} to {}", limits::VEHICLE_PARTS_MAX))
        .found(found))
}

/// # Errors
/// `InvalidArgument` for a target that no vehicle could have.
pub(crate) fn ackermann(control: &AckermannControl) -> Result<(), Error> {
    let speed = limits::SPEED_MPS_MAX;
    for (what, value, low, high, unit) in [
        ("angle of the wheels", control.steer_rad, -STEER_RAD_MAX, STEER_RAD_MAX, "rad"),
        ("rate of the angle", control.steer_radps, -100.0, 100.0, "rad/s"),
        ("speed", control.speed_mps, -speed, speed, "m/s"),
        (
            "acceleration",
            control.acceleration_mps2,
            -ACCELERATION_MPS2_MAX,
            ACCELERATION_MPS2_MAX,
            "m/s²",
        ),
        ("jerk", control.jerk_mps3, -ACCELERATION_MPS2_MAX, ACCELERATION_MPS2_MAX, "m/s³"),
    ] {
        range(what, value, low, high, unit)?;
    }
    Ok(())
}

/// # Errors
/// `InvalidArgument` for gains beyond any use.
pub(crate) fn gains(gains: &AckermannGains) -> Result<(), Error> {
    for (what, value) in [
        ("speed_kp", gains.speed_kp),
        ("speed_ki", gains.speed_ki),
        ("speed_kd", gains.speed_kd),
        ("acceleration_kp", gains.acceleration_kp),
        ("acceleration_ki", gains.acceleration_ki),
        ("acceleration_kd", gains.acceleration_kd),
    ] {
        range(what, value, -GAIN_MAX, GAIN_MAX, "")?;
    }
    Ok(())
}
