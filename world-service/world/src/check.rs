//! Whether the numbers of a command are usable.

use std::fmt::Display;

use schemas::{Error, ErrorCode, Pose, Vec3, VehicleControl, Weather, limits};

/// Fastest spin a command may give to a body; about ten turns per second.
pub(crate) const SPIN_RADPS_MAX: f32 = 60.0;
/// How far from 1 the length of a quaternion may be.
const QUATERNION_TOLERANCE: f32 = 1.0e-3;

/// # Errors
/// `InvalidArgument` unless `value` is a number from `low` to `high`.
pub(crate) fn range(
    what: &str,
    value: f32,
    low: f32,
    high: f32,
    unit: impl Display,
) -> Result<(), Error> {
    // NaN is in no range.
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, format!("{what} is out of range"))
        .wanted(format!("{low} to {high} {unit}"))
        .found(value))
}

/// # Errors
/// `InvalidArgument` unless the vector is finite and no longer than `longest`.
pub(crate) fn vector(what: &str, value: Vec3, longest: f32, unit: &str) -> Result<(), Error> {
    range(what, value.norm(), 0.0, longest, unit)
}

/// # Errors
/// `InvalidArgument` unless the position is within the limits and the rotation is one.
pub(crate) fn pose(pose: &Pose) -> Result<(), Error> {
    vector("position", pose.translation.vector, limits::COORDINATE_M_MAX, "m from the origin")?;
    let length = pose.rotation.coords.norm();
    range(
        "length of the rotation's quaternion",
        length,
        1.0 - QUATERNION_TOLERANCE,
        1.0 + QUATERNION_TOLERANCE,
        "",
    )
}

/// # Errors
/// `InvalidArgument` unless the length of a tick is within the limits.
pub(crate) fn dt(dt_secs: f64) -> Result<(), Error> {
    let allowed = limits::DT_SECS_MIN..=limits::DT_SECS_MAX;
    if allowed.contains(&dt_secs) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, "the step is out of range")
        .wanted(format!("{} to {} s", limits::DT_SECS_MIN, limits::DT_SECS_MAX))
        .found(format!("{dt_secs} s")))
}

/// # Errors
/// `InvalidArgument` for a pedal outside of 0 to 1 or a steer outside of -1 to 1.
pub(crate) fn control(control: &VehicleControl) -> Result<(), Error> {
    range("throttle", control.throttle, 0.0, 1.0, "")?;
    range("steer", control.steer, -1.0, 1.0, "")?;
    range("brake", control.brake, 0.0, 1.0, "")
}

/// # Errors
/// `InvalidArgument` for a percentage outside of 0 to 100 or a value that is not a finite number.
pub(crate) fn weather(weather: &Weather) -> Result<(), Error> {
    let percentages = [
        ("cloudiness", weather.cloudiness_percent),
        ("precipitation", weather.precipitation_percent),
        ("precipitation deposits", weather.precipitation_deposits_percent),
        ("wind intensity", weather.wind_intensity_percent),
        ("fog density", weather.fog_density_percent),
        ("wetness", weather.wetness_percent),
        ("dust storm", weather.dust_storm_percent),
    ];
    for (what, value) in percentages {
        range(what, value, 0.0, 100.0, "%")?;
    }
    let numbers = [
        ("sun azimuth", weather.sun_azimuth_rad),
        ("sun altitude", weather.sun_altitude_rad),
        ("fog distance", weather.fog_distance_m),
        ("fog falloff", weather.fog_falloff),
        ("scattering intensity", weather.scattering_intensity),
        ("Mie scattering scale", weather.mie_scattering_scale),
        ("Rayleigh scattering scale", weather.rayleigh_scattering_scale),
    ];
    for (what, value) in numbers {
        range(what, value, f32::MIN, f32::MAX, "")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_is_out_of_every_range() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(range("x", value, -1.0, 1.0, "m").is_err());
            assert!(vector("x", Vec3::new(0.0, value, 0.0), 1.0e30, "m").is_err());
            assert!(weather(&Weather { fog_falloff: value, ..Weather::CLEAR_NOON }).is_err());
        }
    }

    #[test]
    fn a_refusal_names_the_limit_and_the_value() {
        let refusal = control(&VehicleControl { steer: -1.5, ..Default::default() }).unwrap_err();
        assert_eq!(refusal.to_string(), "steer is out of range; wanted -1 to 1 , found -1.5");
    }
}
