//! Vehicles as data.
//!
//! **Source:** manufacturers' published dimensions, masses, gear ratios and power; inertia from the
//! box of the body scaled to the yaw radius of gyration common for its class (about 0.25 of the
//! length); suspension for a ride frequency of 1.3 to 1.6 Hz.

use super::{Blueprint, BodySpec};
use crate::vehicle::{Driven, EngineSpec, GearboxSpec, VehicleSpec};

pub(super) fn all() -> impl Iterator<Item = Blueprint> {
    [
        ("vehicle.audi.tt", &AUDI_TT),
        ("vehicle.lincoln.mkz", &LINCOLN_MKZ),
        ("vehicle.lincoln.mkz_2017", &LINCOLN_MKZ),
        ("vehicle.lincoln.mkz_2020", &LINCOLN_MKZ),
        ("vehicle.tesla.model3", &TESLA_MODEL3),
    ]
    .into_iter()
    .map(|(id, spec)| Blueprint { id: id.to_owned(), body: BodySpec::Vehicle(spec) })
}

/// Lincoln MKZ of 2017 with driver: 4.92 × 1.86 × 1.48 m, 1,800 kg, front-wheel drive, six-speed
/// automatic, 160 kW.
static LINCOLN_MKZ: VehicleSpec = VehicleSpec {
    length_m: 4.92,
    width_m: 1.86,
    height_m: 1.48,
    ground_clearance_m: 0.16,
    wheelbase_m: 2.85,
    track_m: 1.59,
    wheel_radius_m: 0.335,
    wheel_inertia_kgm2: 1.3,
    mass_kg: 1_800.0,
    centre_of_mass_forward_m: 0.17,
    centre_of_mass_height_m: 0.53,
    ride_hz: 1.35,
    damping_ratio: 0.38,
    anti_roll_n_per_m: 14_000.0,
    steer_rad_max: 0.61,
    grip: 1.04,
    driven: Driven::Front,
    engine: EngineSpec {
        torque_nm: &[
            (1_000.0, 200.0),
            (2_000.0, 260.0),
            (3_000.0, 282.0),
            (4_000.0, 288.0),
            (5_000.0, 280.0),
            (6_000.0, 255.0),
            (6_500.0, 220.0),
        ],
        idle_rpm: 750.0,
        drag_nm: 22.0,
        inertia_kgm2: 0.16,
    },
    gearbox: GearboxSpec {
        forward: &[4.58, 2.96, 1.91, 1.45, 1.0, 0.75],
        reverse: 2.94,
        final_drive: 3.06,
        efficiency: 0.9,
        shift_secs: 0.25,
    },
    brake_nm: 8_400.0,
    brake_front_share: 0.68,
    hand_brake_nm: 3_000.0,
    drag_area_m2: 0.66,
};

/// Tesla Model 3 with driver: 4.69 × 1.85 × 1.44 m, 1,830 kg, rear-wheel drive, one gear, 190 kW.
static TESLA_MODEL3: VehicleSpec = VehicleSpec {
    length_m: 4.69,
    width_m: 1.85,
    height_m: 1.44,
    ground_clearance_m: 0.14,
    wheelbase_m: 2.875,
    track_m: 1.58,
    wheel_radius_m: 0.334,
    wheel_inertia_kgm2: 1.4,
    mass_kg: 1_830.0,
    centre_of_mass_forward_m: -0.06,
    centre_of_mass_height_m: 0.46,
    ride_hz: 1.5,
    damping_ratio: 0.4,
    anti_roll_n_per_m: 15_000.0,
    steer_rad_max: 0.6,
    grip: 1.06,
    driven: Driven::Rear,
    engine: EngineSpec {
        torque_nm: &[
            (0.0, 340.0),
            (5_000.0, 340.0),
            (8_000.0, 222.0),
            (12_000.0, 148.0),
            (16_000.0, 105.0),
        ],
        idle_rpm: 0.0,
        drag_nm: 14.0,
        inertia_kgm2: 0.03,
    },
    gearbox: GearboxSpec {
        forward: &[1.0],
        reverse: 1.0,
        final_drive: 9.0,
        efficiency: 0.95,
        shift_secs: 0.0,
    },
    brake_nm: 8_600.0,
    brake_front_share: 0.65,
    hand_brake_nm: 3_000.0,
    drag_area_m2: 0.53,
};

/// Audi TT of 2015 with driver: 4.18 × 1.83 × 1.35 m, 1,410 kg, all-wheel drive, six-speed, 169 kW.
static AUDI_TT: VehicleSpec = VehicleSpec {
    length_m: 4.18,
    width_m: 1.83,
    height_m: 1.35,
    ground_clearance_m: 0.13,
    wheelbase_m: 2.505,
    track_m: 1.56,
    wheel_radius_m: 0.325,
    wheel_inertia_kgm2: 1.2,
    mass_kg: 1_410.0,
    centre_of_mass_forward_m: 0.2,
    centre_of_mass_height_m: 0.48,
    ride_hz: 1.6,
    damping_ratio: 0.42,
    anti_roll_n_per_m: 14_000.0,
    steer_rad_max: 0.6,
    grip: 1.1,
    driven: Driven::All,
    engine: EngineSpec {
        torque_nm: &[
            (1_000.0, 190.0),
            (1_600.0, 370.0),
            (4_300.0, 370.0),
            (5_500.0, 290.0),
            (6_200.0, 255.0),
            (6_600.0, 220.0),
        ],
        idle_rpm: 800.0,
        drag_nm: 22.0,
        inertia_kgm2: 0.15,
    },
    gearbox: GearboxSpec {
        forward: &[2.92, 1.79, 1.14, 0.82, 0.64, 0.53],
        reverse: 2.6,
        final_drive: 4.77,
        efficiency: 0.9,
        shift_secs: 0.15,
    },
    brake_nm: 7_200.0,
    brake_front_share: 0.66,
    hand_brake_nm: 2_600.0,
    drag_area_m2: 0.64,
};
