//! Chassis and gearboxes of passenger cars.

use crate::vehicle::design::{Chassis, Design, Gearbox, Look};
use crate::vehicle::engine::Engine;
use crate::vehicle::{BaseType, Driven};

#[rustfmt::skip]
pub(super) static SALOON: Chassis = Chassis {
    clearance_m: 0.16, grip: 1.08, ride_hz: 1.35, damping_ratio: 0.38, anti_roll_per_kg: 7.8,
    rim_kg: 11.6, brake_g: 1.39, brake_front_share: 0.68, hand_brake_g: 0.52,
    stiffness: (15.0, 20.0),
};
#[rustfmt::skip]
pub(super) static COMPACT: Chassis = Chassis {
    clearance_m: 0.15, grip: 1.02, ride_hz: 1.45, damping_ratio: 0.38, anti_roll_per_kg: 8.0,
    rim_kg: 10.0, brake_g: 1.35, brake_front_share: 0.72, hand_brake_g: 0.45,
    stiffness: (14.0, 19.0),
};
#[rustfmt::skip]
pub(super) static HOT: Chassis = Chassis {
    clearance_m: 0.13, grip: 1.12, ride_hz: 1.6, damping_ratio: 0.42, anti_roll_per_kg: 10.0,
    rim_kg: 11.0, brake_g: 1.45, brake_front_share: 0.72, hand_brake_g: 0.45,
    stiffness: (15.5, 20.5),
};
#[rustfmt::skip]
pub(super) static SPORT: Chassis = Chassis {
    clearance_m: 0.13, grip: 1.2, ride_hz: 1.6, damping_ratio: 0.42, anti_roll_per_kg: 10.0,
    rim_kg: 11.6, brake_g: 1.6, brake_front_share: 0.66, hand_brake_g: 0.55,
    stiffness: (16.0, 21.0),
};
#[rustfmt::skip]
pub(super) static MUSCLE: Chassis = Chassis {
    clearance_m: 0.14, grip: 1.04, ride_hz: 1.45, damping_ratio: 0.4, anti_roll_per_kg: 9.0,
    rim_kg: 12.5, brake_g: 1.4, brake_front_share: 0.67, hand_brake_g: 0.5,
    stiffness: (15.0, 20.0),
};
#[rustfmt::skip]
pub(super) static HEAVY: Chassis = Chassis {
    clearance_m: 0.2, grip: 1.02, ride_hz: 1.4, damping_ratio: 0.4, anti_roll_per_kg: 10.0,
    rim_kg: 14.0, brake_g: 1.35, brake_front_share: 0.62, hand_brake_g: 0.45,
    stiffness: (15.0, 20.0),
};
#[rustfmt::skip]
pub(super) static OFF_ROAD: Chassis = Chassis {
    clearance_m: 0.24, grip: 0.92, ride_hz: 1.35, damping_ratio: 0.4, anti_roll_per_kg: 10.0,
    rim_kg: 15.0, brake_g: 1.2, brake_front_share: 0.66, hand_brake_g: 0.45,
    stiffness: (13.0, 17.5),
};
#[rustfmt::skip]
pub(super) static TINY: Chassis = Chassis {
    clearance_m: 0.15, grip: 0.92, ride_hz: 1.6, damping_ratio: 0.4, anti_roll_per_kg: 9.0,
    rim_kg: 8.0, brake_g: 1.1, brake_front_share: 0.62, hand_brake_g: 0.4,
    stiffness: (13.0, 18.0),
};
#[rustfmt::skip]
pub(super) static FIVE_COMPACT: Gearbox = Gearbox {
    forward: &[3.45, 1.94, 1.28, 0.97, 0.8], reverse: 3.17, final_ratio: 3.94, shift_secs: 0.3,
};
#[rustfmt::skip]
pub(super) static SIX_SALOON: Gearbox = Gearbox {
    forward: &[4.58, 2.96, 1.91, 1.45, 1.0, 0.75], reverse: 2.94, final_ratio: 3.06,
    shift_secs: 0.25,
};
#[rustfmt::skip]
pub(super) static SIX_IMPALA: Gearbox = Gearbox {
    forward: &[4.58, 2.96, 1.91, 1.45, 1.0, 0.75], reverse: 2.94, final_ratio: 2.77,
    shift_secs: 0.25,
};
#[rustfmt::skip]
pub(super) static SIX_TT: Gearbox = Gearbox {
    forward: &[2.92, 1.79, 1.14, 0.82, 0.64, 0.53], reverse: 2.6, final_ratio: 4.77,
    shift_secs: 0.15,
};
#[rustfmt::skip]
pub(super) static SIX_BMW: Gearbox = Gearbox {
    forward: &[4.15, 2.37, 1.56, 1.16, 0.86, 0.69], reverse: 3.39, final_ratio: 3.75,
    shift_secs: 0.2,
};
#[rustfmt::skip]
pub(super) static SIX_LEON: Gearbox = Gearbox {
    forward: &[3.62, 1.95, 1.28, 0.97, 0.78, 0.65], reverse: 3.18, final_ratio: 3.65,
    shift_secs: 0.3,
};
#[rustfmt::skip]
pub(super) static SIX_MINI: Gearbox = Gearbox {
    forward: &[3.31, 2.13, 1.48, 1.14, 0.95, 0.82], reverse: 3.23, final_ratio: 3.65,
    shift_secs: 0.25,
};
#[rustfmt::skip]
pub(super) static SEVEN_MERCEDES: Gearbox = Gearbox {
    forward: &[4.38, 2.86, 1.92, 1.37, 1.0, 0.82, 0.73], reverse: 3.42, final_ratio: 3.07,
    shift_secs: 0.2,
};
#[rustfmt::skip]
pub(super) static SEVEN_PATROL: Gearbox = Gearbox {
    forward: &[4.89, 3.17, 2.03, 1.41, 1.0, 0.86, 0.77], reverse: 4.04, final_ratio: 3.36,
    shift_secs: 0.2,
};
#[rustfmt::skip]
pub(super) static EIGHT_CHARGER: Gearbox = Gearbox {
    forward: &[4.714, 3.143, 2.1, 1.67, 1.29, 1.0, 0.84, 0.67], reverse: 3.3, final_ratio: 2.62,
    shift_secs: 0.15,
};
#[rustfmt::skip]
pub(super) static FIVE_MOPAR: Gearbox = Gearbox {
    forward: &[3.59, 2.19, 1.41, 1.0, 0.83], reverse: 3.16, final_ratio: 2.82, shift_secs: 0.2,
};
#[rustfmt::skip]
pub(super) static FIVE_JEEP: Gearbox = Gearbox {
    forward: &[3.59, 2.19, 1.41, 1.0, 0.83], reverse: 3.16, final_ratio: 3.73, shift_secs: 0.2,
};
#[rustfmt::skip]
pub(super) static FIVE_MUSTANG: Gearbox = Gearbox {
    forward: &[3.38, 2.0, 1.32, 1.0, 0.68], reverse: 3.38, final_ratio: 3.55, shift_secs: 0.25,
};
#[rustfmt::skip]
pub(super) static FIVE_PATROL: Gearbox = Gearbox {
    forward: &[4.06, 2.36, 1.49, 1.0, 0.86], reverse: 4.25, final_ratio: 4.11, shift_secs: 0.35,
};
#[rustfmt::skip]
pub(super) static FOUR_FORD: Gearbox = Gearbox {
    forward: &[2.84, 1.55, 1.0, 0.7], reverse: 2.33, final_ratio: 3.27, shift_secs: 0.3,
};
#[rustfmt::skip]
pub(super) static SINGLE_9: Gearbox = Gearbox {
    forward: &[1.0], reverse: 1.0, final_ratio: 9.0, shift_secs: 0.0,
};
#[rustfmt::skip]
pub(super) static SINGLE_8_6: Gearbox = Gearbox {
    forward: &[1.0], reverse: 1.0, final_ratio: 8.6, shift_secs: 0.0,
};

/// Lincoln MKZ 2.5 of 2017: 160 kW.
#[rustfmt::skip]
pub(super) const MKZ: Design = Design {
    id: "vehicle.lincoln.mkz",
    look: Look {
        paints: &["0,0,0", "16,16,16"],
        drivers: &[], special: "", generation: 2, lights: true, doors: true,
    },
    base: BaseType::Car, chassis: &SALOON, size_m: [4.92, 1.86, 1.48], wheelbase_m: 2.85,
    track_m: 1.59, tandem_m: 0.0, wheel_radius_m: 0.335, mass_kg: 1_800.0, front_share: 0.56,
    centre_height_m: 0.53, turning_circle_m: 11.3, drag: (0.285, 2.32), driven: Driven::Front,
    engine: Engine::Piston {
        torque_nm: 288.0, plateau_rpm: (3_600.0, 4_200.0), power_kw: 160.0,
        power_rpm: 6_000.0, idle_rpm: 750.0, rpm_max: 6_500.0, inertia_kgm2: 0.16,
    },
    gearbox: &SIX_SALOON,
};

/// Dodge Charger R/T 5.7 V8 of 2020: 276 kW.
#[rustfmt::skip]
pub(super) const CHARGER: Design = Design {
    id: "vehicle.dodge.charger_2020",
    look: Look {
        paints: &["73,0,0", "0,39,105", "0,0,0", "211,142,0"],
        drivers: &[], special: "", generation: 2, lights: true, doors: true,
    },
    base: BaseType::Car, chassis: &MUSCLE, size_m: [5.04, 1.91, 1.48], wheelbase_m: 3.052,
    track_m: 1.61, tandem_m: 0.0, wheel_radius_m: 0.363, mass_kg: 2_000.0, front_share: 0.54,
    centre_height_m: 0.55, turning_circle_m: 11.5, drag: (0.32, 2.4), driven: Driven::Rear,
    engine: Engine::Piston {
        torque_nm: 534.0, plateau_rpm: (3_800.0, 4_400.0), power_kw: 276.0,
        power_rpm: 5_250.0, idle_rpm: 650.0, rpm_max: 6_000.0, inertia_kgm2: 0.25,
    },
    gearbox: &EIGHT_CHARGER,
};
