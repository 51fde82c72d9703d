//! Passenger cars.
//!
//! **Source:** manufacturers' published dimensions, masses with driver, power, gear ratios, drag
//! and turning circles; heights of the centre of mass and brake shares usual for the class.

mod parts;

use super::design::{Design, Look};
use super::engine::Engine;
use super::{BaseType, Driven};
use parts::*;

// A table: one row a vehicle.
#[rustfmt::skip]
pub(super) static DESIGNS: &[Design] = &[
    // 1.4 of 2000: 55 kW.
    Design {
        id: "vehicle.audi.a2",
        look: Look {
            paints: &["168,0,27", "0,39,105", "16,44,21", "33,33,33"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &COMPACT, size_m: [3.83, 1.67, 1.55], wheelbase_m: 2.405,
        track_m: 1.45, tandem_m: 0.0, wheel_radius_m: 0.286, mass_kg: 1_070.0, front_share: 0.6,
        centre_height_m: 0.56, turning_circle_m: 10.5, drag: (0.28, 2.18), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 126.0, plateau_rpm: (3_000.0, 3_600.0), power_kw: 55.0, power_rpm: 5_000.0,
            idle_rpm: 750.0, rpm_max: 6_000.0, inertia_kgm2: 0.1,
        },
        gearbox: &FIVE_COMPACT,
    },
    // 55 quattro of 2019: 300 kW for seconds.
    Design {
        id: "vehicle.audi.etron",
        look: Look {
            paints: &["168,0,27", "0,39,105", "33,33,33", "195,168,228"],
            drivers: &[], special: "electric", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Car, chassis: &HEAVY, size_m: [4.9, 1.94, 1.63], wheelbase_m: 2.928,
        track_m: 1.65, tandem_m: 0.0, wheel_radius_m: 0.381, mass_kg: 2_565.0, front_share: 0.5,
        centre_height_m: 0.55, turning_circle_m: 12.2, drag: (0.28, 2.65), driven: Driven::All,
        engine: Engine::Motor {
            torque_nm: 664.0, power_kw: 300.0, rpm_max: 13_300.0, inertia_kgm2: 0.1,
        },
        gearbox: &SINGLE_9,
    },
    // 2.0 TFSI quattro of 2015: 169 kW.
    Design {
        id: "vehicle.audi.tt",
        look: Look {
            paints: &["168,0,27", "0,39,105", "16,44,21", "33,33,33"],
            drivers: &[], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Car, chassis: &SPORT, size_m: [4.18, 1.83, 1.35], wheelbase_m: 2.505,
        track_m: 1.56, tandem_m: 0.0, wheel_radius_m: 0.325, mass_kg: 1_410.0, front_share: 0.58,
        centre_height_m: 0.48, turning_circle_m: 11.0, drag: (0.3, 2.13), driven: Driven::All,
        engine: Engine::Piston {
            torque_nm: 370.0, plateau_rpm: (1_600.0, 4_300.0), power_kw: 169.0,
            power_rpm: 5_500.0, idle_rpm: 800.0, rpm_max: 6_600.0, inertia_kgm2: 0.15,
        },
        gearbox: &SIX_TT,
    },
    // 218i Gran Tourer of 2015: 100 kW.
    Design {
        id: "vehicle.bmw.grandtourer",
        look: Look {
            paints: &["109,109,109", "12,38,88", "68,68,77", "255,255,255", "255,21,0", "0,0,0"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &COMPACT, size_m: [4.56, 1.8, 1.61], wheelbase_m: 2.78,
        track_m: 1.56, tandem_m: 0.0, wheel_radius_m: 0.326, mass_kg: 1_570.0, front_share: 0.57,
        centre_height_m: 0.58, turning_circle_m: 11.8, drag: (0.29, 2.35), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 220.0, plateau_rpm: (1_250.0, 4_300.0), power_kw: 100.0,
            power_rpm: 4_600.0, idle_rpm: 750.0, rpm_max: 6_500.0, inertia_kgm2: 0.13,
        },
        gearbox: &SIX_BMW,
    },
    // 3.6 V6 of 2014: 227 kW.
    Design {
        id: "vehicle.chevrolet.impala",
        look: Look {
            paints: &["61,86,143", "0,12,49", "0,0,0", "71,12,12"],
            drivers: &[], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Car, chassis: &SALOON, size_m: [5.11, 1.85, 1.5], wheelbase_m: 2.837,
        track_m: 1.58, tandem_m: 0.0, wheel_radius_m: 0.347, mass_kg: 1_800.0, front_share: 0.6,
        centre_height_m: 0.55, turning_circle_m: 11.8, drag: (0.29, 2.4), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 358.0, plateau_rpm: (4_800.0, 5_300.0), power_kw: 227.0,
            power_rpm: 6_800.0, idle_rpm: 700.0, rpm_max: 7_200.0, inertia_kgm2: 0.18,
        },
        gearbox: &SIX_IMPALA,
    },
    // PureTech 82 of 2017: 61 kW.
    Design {
        id: "vehicle.citroen.c3",
        look: Look {
            paints: &["217,217,217", "168,0,27", "0,39,105", "16,44,21", "33,33,33"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &COMPACT, size_m: [3.99, 1.75, 1.47], wheelbase_m: 2.54,
        track_m: 1.47, tandem_m: 0.0, wheel_radius_m: 0.31, mass_kg: 1_125.0, front_share: 0.62,
        centre_height_m: 0.55, turning_circle_m: 10.9, drag: (0.3, 2.1), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 118.0, plateau_rpm: (2_500.0, 3_000.0), power_kw: 61.0, power_rpm: 5_750.0,
            idle_rpm: 750.0, rpm_max: 6_300.0, inertia_kgm2: 0.09,
        },
        gearbox: &FIVE_COMPACT,
    },
    CHARGER,
    // 5.7 V8 of 2008: 254 kW.
    Design {
        id: "vehicle.dodge.charger_police",
        look: Look {
            paints: &["0,0,0", "8,53,0"],
            drivers: &[], special: "emergency", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Car, chassis: &MUSCLE, size_m: [5.08, 1.89, 1.48], wheelbase_m: 3.05,
        track_m: 1.6, tandem_m: 0.0, wheel_radius_m: 0.355, mass_kg: 1_950.0, front_share: 0.54,
        centre_height_m: 0.55, turning_circle_m: 11.9, drag: (0.33, 2.4), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 525.0, plateau_rpm: (3_800.0, 4_200.0), power_kw: 254.0,
            power_rpm: 5_000.0, idle_rpm: 650.0, rpm_max: 5_800.0, inertia_kgm2: 0.25,
        },
        gearbox: &FIVE_MOPAR,
    },
    // Pursuit 5.7 V8 of 2020: 276 kW.
    Design {
        id: "vehicle.dodge.charger_police_2020",
        look: Look {
            paints: &["0,0,0"],
            drivers: &[], special: "emergency", generation: 2, lights: true, doors: true,
        },
        size_m: [5.04, 1.91, 1.5], mass_kg: 2_080.0, centre_height_m: 0.56,
        drag: (0.33, 2.4),
        ..CHARGER
    },
    // Crown Victoria 4.6 V8 of 2008, a taxi: 178 kW.
    Design {
        id: "vehicle.ford.crown",
        look: Look {
            paints: &["255,185,0"],
            drivers: &[], special: "taxi", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Car, chassis: &SALOON, size_m: [5.39, 1.99, 1.48], wheelbase_m: 2.913,
        track_m: 1.63, tandem_m: 0.0, wheel_radius_m: 0.345, mass_kg: 1_960.0, front_share: 0.56,
        centre_height_m: 0.57, turning_circle_m: 12.2, drag: (0.34, 2.4), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 373.0, plateau_rpm: (3_700.0, 4_200.0), power_kw: 178.0,
            power_rpm: 4_900.0, idle_rpm: 650.0, rpm_max: 5_500.0, inertia_kgm2: 0.22,
        },
        gearbox: &FOUR_FORD,
    },
    // GT 4.6 V8 of 2006: 224 kW.
    Design {
        id: "vehicle.ford.mustang",
        look: Look {
            paints: &["0,12,58", "85,0,0", "160,160,160", "0,21,0", "0,0,0"],
            drivers: &[], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Car, chassis: &MUSCLE, size_m: [4.78, 1.88, 1.38], wheelbase_m: 2.72,
        track_m: 1.57, tandem_m: 0.0, wheel_radius_m: 0.343, mass_kg: 1_650.0, front_share: 0.53,
        centre_height_m: 0.52, turning_circle_m: 11.5, drag: (0.38, 2.2), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 434.0, plateau_rpm: (4_200.0, 4_700.0), power_kw: 224.0,
            power_rpm: 5_750.0, idle_rpm: 700.0, rpm_max: 6_250.0, inertia_kgm2: 0.2,
        },
        gearbox: &FIVE_MUSTANG,
    },
    // 3.6 V6, two doors, of 2013: 209 kW.
    Design {
        id: "vehicle.jeep.wrangler_rubicon",
        look: Look {
            paints: &["217,217,217", "168,0,27", "0,39,105", "16,44,21", "33,33,33"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &OFF_ROAD, size_m: [4.17, 1.87, 1.8], wheelbase_m: 2.424,
        track_m: 1.57, tandem_m: 0.0, wheel_radius_m: 0.407, mass_kg: 1_910.0, front_share: 0.52,
        centre_height_m: 0.72, turning_circle_m: 10.4, drag: (0.5, 2.7), driven: Driven::All,
        engine: Engine::Piston {
            torque_nm: 347.0, plateau_rpm: (4_500.0, 5_000.0), power_kw: 209.0,
            power_rpm: 6_350.0, idle_rpm: 650.0, rpm_max: 6_600.0, inertia_kgm2: 0.19,
        },
        gearbox: &FIVE_JEEP,
    },
    // CARLA 0.10's name of the car.
    MKZ,
    // 2.5 of 2017: 160 kW.
    Design {
        id: "vehicle.lincoln.mkz_2017",
        look: Look {
            paints: &["16,16,16"],
            drivers: &[], special: "", generation: 1, lights: true, doors: false,
        },
        ..MKZ
    },
    // 2.5 of 2020: 160 kW.
    Design {
        id: "vehicle.lincoln.mkz_2020",
        look: Look {
            paints: &["0,0,0"],
            drivers: &["0"], special: "", generation: 2, lights: true, doors: true,
        },
        ..MKZ
    },
    // C 300 Coupé of 2016: 180 kW.
    Design {
        id: "vehicle.mercedes.coupe",
        look: Look {
            paints: &["217,217,217", "168,0,27", "0,39,105", "16,44,21", "33,33,33"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &SALOON, size_m: [4.69, 1.81, 1.41], wheelbase_m: 2.84,
        track_m: 1.57, tandem_m: 0.0, wheel_radius_m: 0.33, mass_kg: 1_640.0, front_share: 0.53,
        centre_height_m: 0.52, turning_circle_m: 11.2, drag: (0.27, 2.15), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 370.0, plateau_rpm: (1_300.0, 4_000.0), power_kw: 180.0,
            power_rpm: 5_500.0, idle_rpm: 700.0, rpm_max: 6_300.0, inertia_kgm2: 0.15,
        },
        gearbox: &SEVEN_MERCEDES,
    },
    // C 300 Coupé of 2018: 190 kW.
    Design {
        id: "vehicle.mercedes.coupe_2020",
        look: Look {
            paints: &["73,0,0", "0,21,81", "0,0,0", "187,187,187"],
            drivers: &[], special: "", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Car, chassis: &SALOON, size_m: [4.7, 1.81, 1.41], wheelbase_m: 2.84,
        track_m: 1.57, tandem_m: 0.0, wheel_radius_m: 0.33, mass_kg: 1_660.0, front_share: 0.53,
        centre_height_m: 0.52, turning_circle_m: 11.2, drag: (0.27, 2.15), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 370.0, plateau_rpm: (1_650.0, 4_000.0), power_kw: 190.0,
            power_rpm: 5_800.0, idle_rpm: 700.0, rpm_max: 6_300.0, inertia_kgm2: 0.15,
        },
        gearbox: &SEVEN_MERCEDES,
    },
    // of 2022: 12.5 kW.
    Design {
        id: "vehicle.micro.microlino",
        look: Look {
            paints: &["21,158,255", "145,255,181", "255,33,0", "255,208,0", "181,255,0"],
            drivers: &[], special: "electric", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &TINY, size_m: [2.52, 1.47, 1.5], wheelbase_m: 1.57,
        track_m: 1.25, tandem_m: 0.0, wheel_radius_m: 0.275, mass_kg: 570.0, front_share: 0.45,
        centre_height_m: 0.52, turning_circle_m: 8.0, drag: (0.45, 1.9), driven: Driven::Rear,
        engine: Engine::Motor {
            torque_nm: 60.0, power_kw: 12.5, rpm_max: 8_200.0, inertia_kgm2: 0.01,
        },
        gearbox: &SINGLE_9,
    },
    // R56 of 2007: 128 kW.
    Design {
        id: "vehicle.mini.cooper_s",
        look: Look {
            paints: &["217,217,217", "168,0,27", "0,39,105", "16,44,21", "33,33,33"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &HOT, size_m: [3.71, 1.68, 1.41], wheelbase_m: 2.467,
        track_m: 1.46, tandem_m: 0.0, wheel_radius_m: 0.306, mass_kg: 1_205.0, front_share: 0.62,
        centre_height_m: 0.51, turning_circle_m: 10.7, drag: (0.36, 2.0), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 240.0, plateau_rpm: (1_600.0, 5_000.0), power_kw: 128.0,
            power_rpm: 5_500.0, idle_rpm: 750.0, rpm_max: 6_500.0, inertia_kgm2: 0.12,
        },
        gearbox: &SIX_MINI,
    },
    // F56 of 2021: 141 kW.
    Design {
        id: "vehicle.mini.cooper_s_2021",
        look: Look {
            paints: &["73,0,0", "22,31,73", "215,88,0", "0,28,0"],
            drivers: &[], special: "", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Car, chassis: &HOT, size_m: [3.85, 1.73, 1.41], wheelbase_m: 2.495,
        track_m: 1.49, tandem_m: 0.0, wheel_radius_m: 0.31, mass_kg: 1_285.0, front_share: 0.62,
        centre_height_m: 0.51, turning_circle_m: 10.8, drag: (0.33, 2.07), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 280.0, plateau_rpm: (1_350.0, 4_600.0), power_kw: 141.0,
            power_rpm: 5_000.0, idle_rpm: 750.0, rpm_max: 6_500.0, inertia_kgm2: 0.13,
        },
        gearbox: &SIX_MINI,
    },
    // K12 1.2 of 2005: 59 kW.
    Design {
        id: "vehicle.nissan.micra",
        look: Look {
            paints: &["243,243,243", "83,83,86", "187,0,0", "28,0,46", "0,0,0", "17,21,99"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &COMPACT, size_m: [3.72, 1.66, 1.54], wheelbase_m: 2.43,
        track_m: 1.46, tandem_m: 0.0, wheel_radius_m: 0.293, mass_kg: 1_010.0, front_share: 0.61,
        centre_height_m: 0.55, turning_circle_m: 9.8, drag: (0.33, 2.15), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 110.0, plateau_rpm: (3_800.0, 4_200.0), power_kw: 59.0, power_rpm: 5_200.0,
            idle_rpm: 700.0, rpm_max: 6_300.0, inertia_kgm2: 0.09,
        },
        gearbox: &FIVE_COMPACT,
    },
    // Y61 3.0 diesel of 2004: 118 kW.
    Design {
        id: "vehicle.nissan.patrol",
        look: Look {
            paints: &["183,187,162", "0,0,0", "66,52,33", "22,24,43", "201,147,0"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &OFF_ROAD, size_m: [5.05, 1.94, 1.86], wheelbase_m: 2.97,
        track_m: 1.61, tandem_m: 0.0, wheel_radius_m: 0.39, mass_kg: 2_500.0, front_share: 0.5,
        centre_height_m: 0.75, turning_circle_m: 12.2, drag: (0.45, 3.0), driven: Driven::All,
        engine: Engine::Piston {
            torque_nm: 354.0, plateau_rpm: (1_800.0, 2_600.0), power_kw: 118.0,
            power_rpm: 3_600.0, idle_rpm: 750.0, rpm_max: 4_300.0, inertia_kgm2: 0.3,
        },
        gearbox: &FIVE_PATROL,
    },
    // Y62 5.6 V8 of 2021: 298 kW.
    Design {
        id: "vehicle.nissan.patrol_2021",
        look: Look {
            paints: &["217,217,217", "159,0,0", "0,38,105", "12,42,12", "0,0,0"],
            drivers: &[], special: "", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Car, chassis: &OFF_ROAD, size_m: [5.32, 2.0, 1.94], wheelbase_m: 3.075,
        track_m: 1.7, tandem_m: 0.0, wheel_radius_m: 0.397, mass_kg: 2_850.0, front_share: 0.51,
        centre_height_m: 0.76, turning_circle_m: 12.5, drag: (0.38, 3.2), driven: Driven::All,
        engine: Engine::Piston {
            torque_nm: 560.0, plateau_rpm: (3_800.0, 4_300.0), power_kw: 298.0,
            power_rpm: 5_800.0, idle_rpm: 650.0, rpm_max: 6_200.0, inertia_kgm2: 0.28,
        },
        gearbox: &SEVEN_PATROL,
    },
    // 1.4 TSI of 2013: 103 kW.
    Design {
        id: "vehicle.seat.leon",
        look: Look {
            paints: &["42,61,214", "21,38,98", "38,38,38", "79,33,85", "155,0,0", "0,0,0"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &COMPACT, size_m: [4.26, 1.82, 1.46], wheelbase_m: 2.636,
        track_m: 1.53, tandem_m: 0.0, wheel_radius_m: 0.316, mass_kg: 1_330.0, front_share: 0.6,
        centre_height_m: 0.54, turning_circle_m: 10.3, drag: (0.3, 2.2), driven: Driven::Front,
        engine: Engine::Piston {
            torque_nm: 250.0, plateau_rpm: (1_500.0, 3_500.0), power_kw: 103.0,
            power_rpm: 4_700.0, idle_rpm: 750.0, rpm_max: 6_400.0, inertia_kgm2: 0.12,
        },
        gearbox: &SIX_LEON,
    },
    // Rear-wheel drive of 2019: 190 kW.
    Design {
        id: "vehicle.tesla.model3",
        look: Look {
            paints: &["17,37,103", "75,86,173", "180,42,42", "0,0,0", "137,0,0"],
            drivers: &[], special: "electric", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Car, chassis: &SALOON, size_m: [4.69, 1.85, 1.44], wheelbase_m: 2.875,
        track_m: 1.58, tandem_m: 0.0, wheel_radius_m: 0.334, mass_kg: 1_830.0, front_share: 0.48,
        centre_height_m: 0.46, turning_circle_m: 11.8, drag: (0.23, 2.3), driven: Driven::Rear,
        engine: Engine::Motor {
            torque_nm: 340.0, power_kw: 190.0, rpm_max: 16_000.0, inertia_kgm2: 0.03,
        },
        gearbox: &SINGLE_9,
    },
    // XW30 of 2010: 100 kW together, of which the battery gives little for long.
    Design {
        id: "vehicle.toyota.prius",
        look: Look {
            paints: &[
                "255,0,0", "215,255,143", "96,102,99", "28,46,58", "23,51,236", "227,227,227",
                "0,0,0",
            ],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Car, chassis: &COMPACT, size_m: [4.48, 1.75, 1.49], wheelbase_m: 2.7,
        track_m: 1.52, tandem_m: 0.0, wheel_radius_m: 0.317, mass_kg: 1_450.0, front_share: 0.61,
        centre_height_m: 0.54, turning_circle_m: 10.4, drag: (0.25, 2.2), driven: Driven::Front,
        engine: Engine::Motor {
            torque_nm: 150.0, power_kw: 85.0, rpm_max: 12_000.0, inertia_kgm2: 0.04,
        },
        gearbox: &SINGLE_8_6,
    },
];
