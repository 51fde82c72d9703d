//! What a vehicle is made of and measures.

use schemas::{
    AckermannGains, Gear, Handling, Vec3, VehiclePhysics, VehicleTelemetry, WheelPhysics,
    WheelTelemetry,
};

pub(crate) fn gains() -> AckermannGains {
    AckermannGains {
        speed_kp: 0.15,
        speed_ki: 0.0,
        speed_kd: 0.25,
        acceleration_kp: 0.01,
        acceleration_ki: 0.02,
        acceleration_kd: 0.03,
    }
}

pub(crate) fn physics() -> VehiclePhysics {
    let wheel = WheelPhysics {
        tyre_friction: 3.5,
        damping_rate: 0.25,
        steer_rad_max: 1.2,
        radius_m: 0.335,
        brake_nm_max: 800.0,
        hand_brake_nm_max: 1_600.0,
        lateral_stiffness_load_max: 3.0,
        lateral_stiffness: 20.0,
        longitudinal_stiffness: 3_000.0,
        position_m: Vec3::new(1.4, 0.8, 0.3),
    };
    VehiclePhysics {
        torque_curve: vec![(0.0, 300.0), (6_000.0, 200.0)],
        engine_rpm_max: 6_000.0,
        engine_inertia_kgm2: 1.0,
        damping_full_throttle: 0.15,
        damping_closed_throttle_clutch_engaged: 2.0,
        damping_closed_throttle_clutch_disengaged: 0.35,
        automatic_gearbox: true,
        gear_switch_secs: 0.5,
        clutch_strength: 10.0,
        final_ratio: 4.0,
        forward_gears: vec![Gear { ratio: 3.6, down_share: 0.5, up_share: 0.65 }],
        mass_kg: 1_800.0,
        drag_coefficient: 0.3,
        centre_of_mass_m: Vec3::new(0.1, 0.0, 0.5),
        steering_curve: vec![(0.0, 1.0), (33.0, 0.7)],
        wheels: vec![wheel; 4],
        sweep_wheel_collision: true,
        handling: Handling::Carla,
        anti_lock: true,
        stability_control: true,
    }
}

pub(crate) fn telemetry() -> VehicleTelemetry {
    let wheel = WheelTelemetry { load_n: 4_400.0, spin_radps: 30.0, ..Default::default() };
    VehicleTelemetry {
        speed_mps: 10.0,
        steer: -0.5,
        engine_rpm: 2_000.0,
        gear: 3,
        drag_n: 60.0,
        wheels: vec![wheel; 4],
        ..VehicleTelemetry::default()
    }
}
