//! Parameters and measurements of vehicles.

use flatbuffers::{FlatBufferBuilder, Vector, WIPOffset};

use super::check_count;
use super::parts::{finite, handling_in, handling_out, vec3_in, vec3_out};
use crate::generated as fb;
use crate::limits::VEHICLE_PARTS_MAX;
use crate::{AckermannControl, AckermannGains, Error, Gear, VehiclePhysics, VehicleTelemetry};
use crate::{WheelPhysics, WheelTelemetry};

pub(super) fn ackermann_out(value: &AckermannControl) -> fb::AckermannControl {
    fb::AckermannControl::new(
        value.steer_rad,
        value.steer_radps,
        value.speed_mps,
        value.acceleration_mps2,
        value.jerk_mps3,
    )
}

pub(super) fn ackermann_in(raw: &fb::AckermannControl) -> Result<AckermannControl, Error> {
    Ok(AckermannControl {
        steer_rad: finite(raw.steer_rad(), "steer_rad")?,
        steer_radps: finite(raw.steer_radps(), "steer_radps")?,
        speed_mps: finite(raw.speed_mps(), "speed_mps")?,
        acceleration_mps2: finite(raw.acceleration_mps2(), "acceleration_mps2")?,
        jerk_mps3: finite(raw.jerk_mps3(), "jerk_mps3")?,
    })
}

pub(super) fn gains_out(value: &AckermannGains) -> fb::AckermannGains {
    fb::AckermannGains::new(
        value.speed_kp,
        value.speed_ki,
        value.speed_kd,
        value.acceleration_kp,
        value.acceleration_ki,
        value.acceleration_kd,
    )
}

pub(super) fn gains_in(raw: &fb::AckermannGains) -> Result<AckermannGains, Error> {
    Ok(AckermannGains {
        speed_kp: finite(raw.speed_kp(), "speed_kp")?,
        speed_ki: finite(raw.speed_ki(), "speed_ki")?,
        speed_kd: finite(raw.speed_kd(), "speed_kd")?,
        acceleration_kp: finite(raw.acceleration_kp(), "acceleration_kp")?,
        acceleration_ki: finite(raw.acceleration_ki(), "acceleration_ki")?,
        acceleration_kd: finite(raw.acceleration_kd(), "acceleration_kd")?,
    })
}

pub(super) fn physics_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    physics: &VehiclePhysics,
) -> WIPOffset<fb::VehiclePhysics<'a>> {
    let torque_curve = Some(curve_out(b, &physics.torque_curve));
    let steering_curve = Some(curve_out(b, &physics.steering_curve));
    let gear = |gear: &Gear| fb::Gear::new(gear.ratio, gear.down_share, gear.up_share);
    let gears: Vec<fb::Gear> = physics.forward_gears.iter().map(gear).collect();
    let forward_gears = Some(b.create_vector(&gears));
    let wheels: Vec<fb::WheelPhysics> = physics.wheels.iter().map(wheel_out).collect();
    let wheels = Some(b.create_vector(&wheels));
    let args = fb::VehiclePhysicsArgs {
        torque_curve,
        engine_rpm_max: physics.engine_rpm_max,
        engine_inertia_kgm2: physics.engine_inertia_kgm2,
        damping_full_throttle: physics.damping_full_throttle,
        damping_closed_throttle_clutch_engaged: physics.damping_closed_throttle_clutch_engaged,
        damping_closed_throttle_clutch_disengaged: physics
            .damping_closed_throttle_clutch_disengaged,
        automatic_gearbox: physics.automatic_gearbox,
        gear_switch_secs: physics.gear_switch_secs,
        clutch_strength: physics.clutch_strength,
        final_ratio: physics.final_ratio,
        forward_gears,
        mass_kg: physics.mass_kg,
        drag_coefficient: physics.drag_coefficient,
        centre_of_mass_in_vehicle_m: Some(&vec3_out(&physics.centre_of_mass_m)),
        steering_curve,
        wheels,
        sweep_wheel_collision: physics.sweep_wheel_collision,
        handling: handling_out(physics.handling),
        anti_lock: physics.anti_lock,
        stability_control: physics.stability_control,
    };
    fb::VehiclePhysics::create(b, &args)
}

pub(super) fn physics_in(raw: &fb::VehiclePhysics<'_>) -> Result<VehiclePhysics, Error> {
    check_count("gears", raw.forward_gears().len(), VEHICLE_PARTS_MAX)?;
    check_count("wheels", raw.wheels().len(), VEHICLE_PARTS_MAX)?;
    Ok(VehiclePhysics {
        torque_curve: curve_in(raw.torque_curve())?,
        engine_rpm_max: finite(raw.engine_rpm_max(), "engine_rpm_max")?,
        engine_inertia_kgm2: finite(raw.engine_inertia_kgm2(), "engine_inertia_kgm2")?,
        damping_full_throttle: finite(raw.damping_full_throttle(), "damping")?,
        damping_closed_throttle_clutch_engaged: finite(
            raw.damping_closed_throttle_clutch_engaged(),
            "damping",
        )?,
        damping_closed_throttle_clutch_disengaged: finite(
            raw.damping_closed_throttle_clutch_disengaged(),
            "damping",
        )?,
        automatic_gearbox: raw.automatic_gearbox(),
        gear_switch_secs: finite(raw.gear_switch_secs(), "gear_switch_secs")?,
        clutch_strength: finite(raw.clutch_strength(), "clutch_strength")?,
        final_ratio: finite(raw.final_ratio(), "final_ratio")?,
        forward_gears: raw.forward_gears().iter().map(gear_in).collect::<Result<_, _>>()?,
        mass_kg: finite(raw.mass_kg(), "mass_kg")?,
        drag_coefficient: finite(raw.drag_coefficient(), "drag_coefficient")?,
        centre_of_mass_m: vec3_in(raw.centre_of_mass_in_vehicle_m(), "centre of mass")?,
        steering_curve: curve_in(raw.steering_curve())?,
        wheels: raw.wheels().iter().map(wheel_in).collect::<Result<_, _>>()?,
        sweep_wheel_collision: raw.sweep_wheel_collision(),
        handling: handling_in(raw.handling())?,
        anti_lock: raw.anti_lock(),
        stability_control: raw.stability_control(),
    })
}

fn curve_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    curve: &[(f32, f32)],
) -> WIPOffset<Vector<'a, fb::CurvePoint>> {
    let points: Vec<fb::CurvePoint> =
        curve.iter().map(|(x, y)| fb::CurvePoint::new(*x, *y)).collect();
    b.create_vector(&points)
}

fn curve_in(raw: Vector<'_, fb::CurvePoint>) -> Result<Vec<(f32, f32)>, Error> {
    check_count("points of a curve", raw.len(), VEHICLE_PARTS_MAX)?;
    raw.iter().map(|point| Ok((finite(point.x(), "curve")?, finite(point.y(), "curve")?))).collect()
}

fn gear_in(raw: &fb::Gear) -> Result<Gear, Error> {
    Ok(Gear {
        ratio: finite(raw.ratio(), "gear ratio")?,
        down_share: finite(raw.down_share(), "down_share")?,
        up_share: finite(raw.up_share(), "up_share")?,
    })
}

fn wheel_out(wheel: &WheelPhysics) -> fb::WheelPhysics {
    fb::WheelPhysics::new(
        wheel.tyre_friction,
        wheel.damping_rate,
        wheel.steer_rad_max,
        wheel.radius_m,
        wheel.brake_nm_max,
        wheel.hand_brake_nm_max,
        wheel.lateral_stiffness_load_max,
        wheel.lateral_stiffness,
        wheel.longitudinal_stiffness,
        &vec3_out(&wheel.position_m),
    )
}

fn wheel_in(raw: &fb::WheelPhysics) -> Result<WheelPhysics, Error> {
    Ok(WheelPhysics {
        tyre_friction: finite(raw.tyre_friction(), "tyre_friction")?,
        damping_rate: finite(raw.damping_rate(), "damping_rate")?,
        steer_rad_max: finite(raw.steer_rad_max(), "steer_rad_max")?,
        radius_m: finite(raw.radius_m(), "radius_m")?,
        brake_nm_max: finite(raw.brake_nm_max(), "brake_nm_max")?,
        hand_brake_nm_max: finite(raw.hand_brake_nm_max(), "hand_brake_nm_max")?,
        lateral_stiffness_load_max: finite(raw.lateral_stiffness_load_max(), "stiffness")?,
        lateral_stiffness: finite(raw.lateral_stiffness(), "stiffness")?,
        longitudinal_stiffness: finite(raw.longitudinal_stiffness(), "stiffness")?,
        position_m: vec3_in(raw.position_in_vehicle_m(), "wheel position")?,
    })
}

pub(super) fn telemetry_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    telemetry: &VehicleTelemetry,
) -> WIPOffset<fb::VehicleTelemetry<'a>> {
    let wheel = |wheel: &WheelTelemetry| {
        fb::WheelTelemetry::new(
            wheel.tyre_friction,
            wheel.lateral_slip,
            wheel.longitudinal_slip,
            wheel.spin_radps,
            wheel.load_n,
            wheel.load_share,
            wheel.torque_nm,
            wheel.longitudinal_force_n,
            wheel.lateral_force_n,
            wheel.longitudinal_force_share,
            wheel.lateral_force_share,
        )
    };
    let wheels: Vec<fb::WheelTelemetry> = telemetry.wheels.iter().map(wheel).collect();
    let wheels = Some(b.create_vector(&wheels));
    let args = fb::VehicleTelemetryArgs {
        speed_mps: telemetry.speed_mps,
        steer: telemetry.steer,
        throttle: telemetry.throttle,
        brake: telemetry.brake,
        engine_rpm: telemetry.engine_rpm,
        gear: telemetry.gear,
        drag_n: telemetry.drag_n,
        wheels,
    };
    fb::VehicleTelemetry::create(b, &args)
}

pub(super) fn telemetry_in(raw: &fb::VehicleTelemetry<'_>) -> Result<VehicleTelemetry, Error> {
    check_count("wheels", raw.wheels().len(), VEHICLE_PARTS_MAX)?;
    let wheel = |raw: &fb::WheelTelemetry| WheelTelemetry {
        tyre_friction: raw.tyre_friction(),
        lateral_slip: raw.lateral_slip(),
        longitudinal_slip: raw.longitudinal_slip(),
        spin_radps: raw.spin_radps(),
        load_n: raw.load_n(),
        load_share: raw.load_share(),
        torque_nm: raw.torque_nm(),
        longitudinal_force_n: raw.longitudinal_force_n(),
        lateral_force_n: raw.lateral_force_n(),
        longitudinal_force_share: raw.longitudinal_force_share(),
        lateral_force_share: raw.lateral_force_share(),
    };
    Ok(VehicleTelemetry {
        speed_mps: finite(raw.speed_mps(), "speed_mps")?,
        steer: finite(raw.steer(), "steer")?,
        throttle: finite(raw.throttle(), "throttle")?,
        brake: finite(raw.brake(), "brake")?,
        engine_rpm: finite(raw.engine_rpm(), "engine_rpm")?,
        gear: raw.gear(),
        drag_n: finite(raw.drag_n(), "drag_n")?,
        wheels: raw.wheels().iter().map(wheel).collect(),
    })
}
