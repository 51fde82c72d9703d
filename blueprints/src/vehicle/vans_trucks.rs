//! Vans, lorries and buses.
//!
//! **Source:** manufacturers' published dimensions, masses with driver, power, gear ratios, drag
//! and turning circles; heights of the centre of mass and brake shares usual for the class.

use super::design::{Chassis, Design, Gearbox, Look};
use super::engine::Engine;
use super::{BaseType, Driven};

#[rustfmt::skip]
static TRUCK: Chassis = Chassis {
    clearance_m: 0.35, grip: 0.8, ride_hz: 1.5, damping_ratio: 0.4, anti_roll_per_kg: 14.0,
    rim_kg: 60.0, brake_g: 0.85, brake_front_share: 0.55, hand_brake_g: 0.35,
    stiffness: (6.5, 9.0),
};
#[rustfmt::skip]
static VAN: Chassis = Chassis {
    clearance_m: 0.18, grip: 0.92, ride_hz: 1.5, damping_ratio: 0.38, anti_roll_per_kg: 10.0,
    rim_kg: 16.0, brake_g: 1.15, brake_front_share: 0.62, hand_brake_g: 0.4,
    stiffness: (11.0, 15.0),
};
#[rustfmt::skip]
static OLD_VAN: Chassis = Chassis {
    clearance_m: 0.18, grip: 0.85, ride_hz: 1.5, damping_ratio: 0.35, anti_roll_per_kg: 8.0,
    rim_kg: 12.0, brake_g: 0.95, brake_front_share: 0.62, hand_brake_g: 0.35,
    stiffness: (11.0, 15.0),
};
#[rustfmt::skip]
static BUS: Chassis = Chassis {
    clearance_m: 0.25, grip: 0.85, ride_hz: 1.4, damping_ratio: 0.4, anti_roll_per_kg: 12.0,
    rim_kg: 30.0, brake_g: 0.95, brake_front_share: 0.58, hand_brake_g: 0.35,
    stiffness: (8.0, 11.0),
};
#[rustfmt::skip]
static HEAVY: Chassis = Chassis {
    clearance_m: 0.2, grip: 1.0, ride_hz: 1.4, damping_ratio: 0.4, anti_roll_per_kg: 10.0,
    rim_kg: 18.0, brake_g: 1.3, brake_front_share: 0.62, hand_brake_g: 0.45,
    stiffness: (14.0, 19.0),
};
#[rustfmt::skip]
static SIX_LORRY: Gearbox = Gearbox {
    forward: &[6.2, 3.4, 2.06, 1.35, 1.0, 0.75], reverse: 5.7, final_ratio: 3.9, shift_secs: 0.5,
};
#[rustfmt::skip]
static TEN_HGV: Gearbox = Gearbox {
    forward: &[11.73, 9.04, 7.09, 5.54, 4.35, 3.44, 2.7, 2.08, 1.63, 1.27, 1.0], reverse: 13.17,
    final_ratio: 2.85, shift_secs: 0.4,
};
#[rustfmt::skip]
static SIX_FIRE: Gearbox = Gearbox {
    forward: &[3.49, 1.86, 1.41, 1.0, 0.75, 0.65], reverse: 5.03, final_ratio: 5.29,
    shift_secs: 0.3,
};
#[rustfmt::skip]
static SIX_FORD: Gearbox = Gearbox {
    forward: &[3.97, 2.32, 1.52, 1.15, 0.86, 0.67], reverse: 3.13, final_ratio: 4.56,
    shift_secs: 0.25,
};
#[rustfmt::skip]
static SIX_SPRINTER: Gearbox = Gearbox {
    forward: &[5.08, 2.61, 1.52, 1.0, 0.79, 0.68], reverse: 4.72, final_ratio: 3.92,
    shift_secs: 0.4,
};
#[rustfmt::skip]
static SIX_ROSA: Gearbox = Gearbox {
    forward: &[5.4, 3.79, 2.31, 1.47, 1.0, 0.7], reverse: 5.07, final_ratio: 4.44,
    shift_secs: 0.3,
};
#[rustfmt::skip]
static FOUR_T2: Gearbox = Gearbox {
    forward: &[3.78, 2.06, 1.26, 0.88], reverse: 3.78, final_ratio: 4.86, shift_secs: 0.4,
};
#[rustfmt::skip]
static SINGLE_9: Gearbox = Gearbox {
    forward: &[1.0], reverse: 1.0, final_ratio: 9.0, shift_secs: 0.0,
};

// A table: one row a vehicle.
#[rustfmt::skip]
pub(super) static DESIGNS: &[Design] = &[
    // A drinks lorry of 7.5 t, half loaded: 130 kW.
    Design {
        id: "vehicle.carlamotors.carlacola",
        look: Look {
            paints: &["255,68,0"],
            drivers: &[], special: "", generation: 1, lights: false, doors: false,
        },
        base: BaseType::Truck, chassis: &TRUCK, size_m: [5.2, 2.4, 2.47], wheelbase_m: 3.2,
        track_m: 1.9, tandem_m: 0.0, wheel_radius_m: 0.4, mass_kg: 5_500.0, front_share: 0.45,
        centre_height_m: 1.0, turning_circle_m: 13.0, drag: (0.6, 5.5), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 560.0, plateau_rpm: (1_200.0, 1_900.0), power_kw: 130.0,
            power_rpm: 2_400.0, idle_rpm: 650.0, rpm_max: 2_800.0, inertia_kgm2: 0.8,
        },
        gearbox: &SIX_LORRY,
    },
    // A rigid lorry with three axles, half loaded: 338 kW.
    Design {
        id: "vehicle.carlamotors.european_hgv",
        look: Look {
            paints: &[
                "231,0,0", "255,255,255", "28,28,28", "42,61,156", "127,127,127", "255,103,0",
            ],
            drivers: &[], special: "", generation: 2, lights: true, doors: false,
        },
        base: BaseType::Truck, chassis: &TRUCK, size_m: [7.94, 2.55, 3.46], wheelbase_m: 4.6,
        track_m: 2.05, tandem_m: 1.35, wheel_radius_m: 0.5, mass_kg: 16_000.0, front_share: 0.38,
        centre_height_m: 1.3, turning_circle_m: 17.0, drag: (0.55, 8.5), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 2_300.0, plateau_rpm: (1_000.0, 1_400.0), power_kw: 338.0,
            power_rpm: 1_750.0, idle_rpm: 550.0, rpm_max: 2_200.0, inertia_kgm2: 2.5,
        },
        gearbox: &TEN_HGV,
    },
    // A pumper of 14.5 t: 250 kW, six-speed automatic.
    Design {
        id: "vehicle.carlamotors.firetruck",
        look: Look {
            paints: &["234,0,0"],
            drivers: &[], special: "emergency", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Truck, chassis: &TRUCK, size_m: [8.47, 2.5, 3.2], wheelbase_m: 4.5,
        track_m: 2.05, tandem_m: 0.0, wheel_radius_m: 0.52, mass_kg: 14_500.0, front_share: 0.4,
        centre_height_m: 1.35, turning_circle_m: 17.0, drag: (0.7, 7.5), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 1_250.0, plateau_rpm: (1_200.0, 1_800.0), power_kw: 250.0,
            power_rpm: 2_300.0, idle_rpm: 650.0, rpm_max: 2_500.0, inertia_kgm2: 1.8,
        },
        gearbox: &SIX_FIRE,
    },
    // E-450 6.8 V10: 227 kW.
    Design {
        id: "vehicle.ford.ambulance",
        look: Look {
            paints: &["231,231,231"],
            drivers: &[], special: "emergency", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Van, chassis: &VAN, size_m: [6.36, 2.35, 2.43], wheelbase_m: 4.01,
        track_m: 1.74, tandem_m: 0.0, wheel_radius_m: 0.385, mass_kg: 5_000.0, front_share: 0.4,
        centre_height_m: 1.0, turning_circle_m: 15.0, drag: (0.5, 4.9), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 569.0, plateau_rpm: (3_000.0, 3_500.0), power_kw: 227.0,
            power_rpm: 4_250.0, idle_rpm: 650.0, rpm_max: 5_000.0, inertia_kgm2: 0.35,
        },
        gearbox: &SIX_FORD,
    },
    // 314 CDI of 2016, half loaded: 105 kW.
    Design {
        id: "vehicle.mercedes.sprinter",
        look: Look {
            paints: &["167,166,175", "255,255,255", "115,115,115"],
            drivers: &[], special: "", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Van, chassis: &VAN, size_m: [5.93, 2.02, 2.64], wheelbase_m: 3.665,
        track_m: 1.72, tandem_m: 0.0, wheel_radius_m: 0.34, mass_kg: 2_600.0, front_share: 0.52,
        centre_height_m: 0.85, turning_circle_m: 13.4, drag: (0.34, 4.2), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 330.0, plateau_rpm: (1_200.0, 2_400.0), power_kw: 105.0,
            power_rpm: 3_800.0, idle_rpm: 750.0, rpm_max: 4_600.0, inertia_kgm2: 0.25,
        },
        gearbox: &SIX_SPRINTER,
    },
    // Rosa of 2015, half full: 129 kW.
    Design {
        id: "vehicle.mitsubishi.fusorosa",
        look: Look {
            paints: &["255,255,255"],
            drivers: &[], special: "", generation: 2, lights: true, doors: false,
        },
        base: BaseType::Bus, chassis: &BUS, size_m: [7.73, 2.01, 2.73], wheelbase_m: 4.55,
        track_m: 1.67, tandem_m: 0.0, wheel_radius_m: 0.386, mass_kg: 6_000.0, front_share: 0.42,
        centre_height_m: 1.1, turning_circle_m: 16.4, drag: (0.55, 4.9), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 430.0, plateau_rpm: (1_600.0, 2_860.0), power_kw: 129.0,
            power_rpm: 2_900.0, idle_rpm: 650.0, rpm_max: 3_500.0, inertia_kgm2: 0.5,
        },
        gearbox: &SIX_ROSA,
    },
    // All-wheel drive of 2024: 447 kW.
    Design {
        id: "vehicle.tesla.cybertruck",
        look: Look {
            paints: &[],
            drivers: &[], special: "electric", generation: 2, lights: true, doors: false,
        },
        base: BaseType::Truck, chassis: &HEAVY, size_m: [5.68, 2.03, 1.8], wheelbase_m: 3.63,
        track_m: 1.72, tandem_m: 0.0, wheel_radius_m: 0.445, mass_kg: 3_180.0, front_share: 0.5,
        centre_height_m: 0.62, turning_circle_m: 13.3, drag: (0.34, 3.0), driven: Driven::All,
        engine: Engine::Motor {
            torque_nm: 1_000.0, power_kw: 447.0, rpm_max: 15_000.0, inertia_kgm2: 0.1,
        },
        gearbox: &SINGLE_9,
    },
    // 2.0 of 1976: 51 kW.
    Design {
        id: "vehicle.volkswagen.t2",
        look: Look {
            paints: &["73,12,12", "22,31,73", "215,89,0", "105,103,0", "0,33,5", "158,40,82"],
            drivers: &[], special: "", generation: 1, lights: true, doors: false,
        },
        base: BaseType::Van, chassis: &OLD_VAN, size_m: [4.51, 1.72, 1.94], wheelbase_m: 2.4,
        track_m: 1.4, tandem_m: 0.0, wheel_radius_m: 0.33, mass_kg: 1_350.0, front_share: 0.46,
        centre_height_m: 0.8, turning_circle_m: 11.3, drag: (0.44, 2.9), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 140.0, plateau_rpm: (2_600.0, 3_000.0), power_kw: 51.0, power_rpm: 4_200.0,
            idle_rpm: 800.0, rpm_max: 4_800.0, inertia_kgm2: 0.15,
        },
        gearbox: &FOUR_T2,
    },
    // 2.0 of 1976: 51 kW.
    Design {
        id: "vehicle.volkswagen.t2_2021",
        look: Look {
            paints: &["73,12,12", "22,31,73", "215,89,0", "105,103,0", "0,33,5", "158,40,82"],
            drivers: &[], special: "", generation: 2, lights: true, doors: true,
        },
        base: BaseType::Van, chassis: &OLD_VAN, size_m: [4.51, 1.72, 1.94], wheelbase_m: 2.4,
        track_m: 1.4, tandem_m: 0.0, wheel_radius_m: 0.33, mass_kg: 1_350.0, front_share: 0.46,
        centre_height_m: 0.8, turning_circle_m: 11.3, drag: (0.44, 2.9), driven: Driven::Rear,
        engine: Engine::Piston {
            torque_nm: 140.0, plateau_rpm: (2_600.0, 3_000.0), power_kw: 51.0, power_rpm: 4_200.0,
            idle_rpm: 800.0, rpm_max: 4_800.0, inertia_kgm2: 0.15,
        },
        gearbox: &FOUR_T2,
    },
];
