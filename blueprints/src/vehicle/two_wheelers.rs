//! Motorcycles and bicycles, with their riders.
//!
//! **Source:** manufacturers' published dimensions, masses with driver, power, gear ratios, drag
//! and turning circles; heights of the centre of mass and brake shares usual for the class.

use super::design::{Chassis, Design, Gearbox, Look};
use super::engine::Engine;
use super::{BaseType, Driven};

#[rustfmt::skip]
static SPORT_BIKE: Chassis = Chassis {
    clearance_m: 0.2, grip: 1.1, ride_hz: 2.0, damping_ratio: 0.45, anti_roll_per_kg: 0.0,
    rim_kg: 6.0, brake_g: 1.35, brake_front_share: 0.75, hand_brake_g: 0.25,
    stiffness: (17.0, 21.0),
};
#[rustfmt::skip]
static CRUISER: Chassis = Chassis {
    clearance_m: 0.2, grip: 0.95, ride_hz: 1.8, damping_ratio: 0.45, anti_roll_per_kg: 0.0,
    rim_kg: 8.0, brake_g: 1.05, brake_front_share: 0.65, hand_brake_g: 0.25,
    stiffness: (16.0, 20.0),
};
#[rustfmt::skip]
static SCOOTER: Chassis = Chassis {
    clearance_m: 0.18, grip: 0.9, ride_hz: 1.9, damping_ratio: 0.45, anti_roll_per_kg: 0.0,
    rim_kg: 4.0, brake_g: 0.9, brake_front_share: 0.6, hand_brake_g: 0.2, stiffness: (15.0, 19.0),
};
#[rustfmt::skip]
static BICYCLE: Chassis = Chassis {
    clearance_m: 0.2, grip: 0.9, ride_hz: 2.5, damping_ratio: 0.5, anti_roll_per_kg: 0.0,
    rim_kg: 1.0, brake_g: 0.7, brake_front_share: 0.6, hand_brake_g: 0.2, stiffness: (14.0, 18.0),
};
#[rustfmt::skip]
static SIX_NINJA: Gearbox = Gearbox {
    forward: &[2.85, 2.2, 1.85, 1.6, 1.42, 1.3], reverse: 2.85, final_ratio: 5.11,
    shift_secs: 0.1,
};
#[rustfmt::skip]
static SIX_R6: Gearbox = Gearbox {
    forward: &[2.58, 2.0, 1.67, 1.44, 1.29, 1.15], reverse: 2.58, final_ratio: 5.83,
    shift_secs: 0.1,
};
#[rustfmt::skip]
static SIX_HARLEY: Gearbox = Gearbox {
    forward: &[3.34, 2.31, 1.72, 1.39, 1.18, 1.0], reverse: 3.34, final_ratio: 2.79,
    shift_secs: 0.25,
};
#[rustfmt::skip]
static FOUR_SCOOTER: Gearbox = Gearbox {
    forward: &[2.5, 1.7, 1.2, 0.9], reverse: 2.5, final_ratio: 8.0, shift_secs: 0.0,
};
#[rustfmt::skip]
static DIRECT: Gearbox = Gearbox {
    forward: &[1.0], reverse: 1.0, final_ratio: 1.0, shift_secs: 0.0,
};

// A table: one row a vehicle.
#[rustfmt::skip]
pub(super) static DESIGNS: &[Design] = &[
    // 14 kg with a rider of 75 kg.
    Design {
        id: "vehicle.bh.crossbike",
        look: Look {
            paints: &["20,78,217", "0,112,39", "255,202,0", "180,0,0"],
            drivers: &["2", "3", "7", "8"], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Bicycle, chassis: &BICYCLE, size_m: [1.75, 0.65, 1.15], wheelbase_m: 1.08,
        track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.35, mass_kg: 89.0, front_share: 0.45,
        centre_height_m: 1.05, turning_circle_m: 3.6, drag: (0.9, 0.5), driven: Driven::Rear,
        engine: Engine::Motor {
            torque_nm: 60.0, power_kw: 0.7, rpm_max: 345.0, inertia_kgm2: 0.01,
        },
        gearbox: &DIRECT,
    },
    // 10 kg with a rider of 75 kg.
    Design {
        id: "vehicle.diamondback.century",
        look: Look {
            paints: &["214,0,0", "50,96,242", "78,247,119"],
            drivers: &["4", "5", "6", "7"], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Bicycle, chassis: &BICYCLE, size_m: [1.7, 0.45, 1.15], wheelbase_m: 0.99,
        track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.335, mass_kg: 85.0, front_share: 0.45,
        centre_height_m: 1.05, turning_circle_m: 3.4, drag: (0.88, 0.4), driven: Driven::Rear,
        engine: Engine::Motor {
            torque_nm: 58.0, power_kw: 0.75, rpm_max: 410.0, inertia_kgm2: 0.01,
        },
        gearbox: &DIRECT,
    },
    // 20 kg with a rider of 70 kg.
    Design {
        id: "vehicle.gazelle.omafiets",
        look: Look {
            paints: &["0,0,0", "41,73,217", "202,88,176"],
            drivers: &["0", "1", "3", "5"], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Bicycle, chassis: &BICYCLE, size_m: [1.85, 0.6, 1.2], wheelbase_m: 1.12,
        track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.35, mass_kg: 90.0, front_share: 0.42,
        centre_height_m: 1.05, turning_circle_m: 3.8, drag: (1.0, 0.55), driven: Driven::Rear,
        engine: Engine::Motor {
            torque_nm: 60.0, power_kw: 0.65, rpm_max: 300.0, inertia_kgm2: 0.01,
        },
        gearbox: &DIRECT,
    },
    // FXDL of 2015: 302 kg with a rider of 80 kg, 57 kW.
    Design {
        id: "vehicle.harley-davidson.low_rider",
        look: Look {
            paints: &["67,67,67", "255,0,0", "255,154,0", "0,38,132"],
            drivers: &["0", "3", "7", "4"], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Motorcycle, chassis: &CRUISER, size_m: [2.36, 0.8, 1.28],
        wheelbase_m: 1.63, track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.31, mass_kg: 382.0,
        front_share: 0.47, centre_height_m: 0.58, turning_circle_m: 6.4, drag: (0.7, 0.75),
        driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 126.0, plateau_rpm: (3_000.0, 3_800.0), power_kw: 57.0, power_rpm: 5_000.0,
            idle_rpm: 900.0, rpm_max: 5_500.0, inertia_kgm2: 0.06,
        },
        gearbox: &SIX_HARLEY,
    },
    // ZX-6R 636 of 2013: 194 kg with a rider of 80 kg, 96.4 kW.
    Design {
        id: "vehicle.kawasaki.ninja",
        look: Look {
            paints: &["11,129,0", "255,203,39", "168,0,0", "0,0,0"],
            drivers: &["0", "7", "3", "4"], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Motorcycle, chassis: &SPORT_BIKE, size_m: [2.09, 0.71, 1.15],
        wheelbase_m: 1.395, track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.31, mass_kg: 274.0,
        front_share: 0.5, centre_height_m: 0.62, turning_circle_m: 6.5, drag: (0.6, 0.6),
        driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 71.0, plateau_rpm: (10_500.0, 11_800.0), power_kw: 96.4,
            power_rpm: 13_500.0, idle_rpm: 1_300.0, rpm_max: 16_000.0, inertia_kgm2: 0.012,
        },
        gearbox: &SIX_NINJA,
    },
    // 125 cm³: 110 kg with a rider of 80 kg, 6.5 kW.
    Design {
        id: "vehicle.vespa.zx125",
        look: Look {
            paints: &["255,203,39", "30,121,154", "168,0,0", "0,0,0", "208,208,208"],
            drivers: &["0", "2", "3", "6"], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Motorcycle, chassis: &SCOOTER, size_m: [1.8, 0.7, 1.15],
        wheelbase_m: 1.26, track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.218, mass_kg: 190.0,
        front_share: 0.4, centre_height_m: 0.62, turning_circle_m: 4.4, drag: (0.75, 0.65),
        driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 9.2, plateau_rpm: (5_200.0, 6_500.0), power_kw: 6.5, power_rpm: 7_500.0,
            idle_rpm: 1_600.0, rpm_max: 9_000.0, inertia_kgm2: 0.004,
        },
        gearbox: &FOUR_SCOOTER,
    },
    // YZF-R6 of 2017: 190 kg with a rider of 80 kg, 87 kW.
    Design {
        id: "vehicle.yamaha.yzf",
        look: Look {
            paints: &[
                "0,0,0", "206,206,206", "0,12,49", "42,99,159", "61,68,66", "33,55,61", "255,0,0",
                "58,21,21", "155,0,0", "255,213,0", "127,130,135", "141,0,58",
            ],
            drivers: &["0", "2", "3", "6"], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Motorcycle, chassis: &SPORT_BIKE, size_m: [2.04, 0.7, 1.15],
        wheelbase_m: 1.375, track_m: 0.0, tandem_m: 0.0, wheel_radius_m: 0.31, mass_kg: 270.0,
        front_share: 0.5, centre_height_m: 0.62, turning_circle_m: 6.6, drag: (0.6, 0.6),
        driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 61.7, plateau_rpm: (9_500.0, 11_000.0), power_kw: 87.1,
            power_rpm: 14_500.0, idle_rpm: 1_300.0, rpm_max: 16_500.0, inertia_kgm2: 0.011,
        },
        gearbox: &SIX_R6,
    },
];
