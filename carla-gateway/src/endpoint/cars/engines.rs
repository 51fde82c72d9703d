//! Engines and gearboxes of CARLA's cars.
//!
//! Three of them are those that recordings of CARLA with additional data have; what they
//! have in common is given to all others.

use schemas::{Gear, VehiclePhysics};

/// An engine with its gearbox, as CARLA's `VehiclePhysicsControl` has it.
struct Engine {
    /// What the ids of its blueprints begin with.
    blueprints: &'static str,
    /// (revolutions per minute, newton metres) at full throttle.
    torque_curve: &'static [(f32, f32)],
    /// Revolutions per minute.
    rpm_max: f32,
    /// Drag at full throttle, newton metre seconds.
    damping_full_throttle: f32,
    final_ratio: f32,
    /// Ratio, and shares of the highest engine speed to change down and up.
    gears: &'static [(f32, f32, f32)],
    /// Of the driven wheels, in metres.
    wheel_radius_m: f32,
}

const RECORDED: [Engine; 3] = [
    Engine {
        blueprints: "vehicle.tesla.model3",
        torque_curve: &[
            (0.0, 743.0),
            (9000.0, 743.0),
            (9500.0, 660.0),
            (10400.0, 605.0),
            (12500.0, 528.0),
            (15000.0, 502.0),
        ],
        rpm_max: 15000.0,
        damping_full_throttle: 0.15,
        final_ratio: 9.0,
        gears: &[(1.0, 0.5, 0.65)],
        wheel_radius_m: 0.37,
    },
    Engine {
        blueprints: "vehicle.lincoln.mkz",
        torque_curve: &[
            (1000.0, 347.0),
            (1500.0, 523.0),
            (2000.0, 606.0),
            (3000.0, 695.0),
            (4000.0, 677.0),
            (5300.0, 607.0),
            (6500.0, 466.0),
        ],
        rpm_max: 6500.0,
        damping_full_throttle: 0.05,
        final_ratio: 3.21,
        gears: &[
            (4.584, 0.23, 0.54),
            (2.964, 0.23, 0.5),
            (1.912, 0.23, 0.46),
            (1.446, 0.23, 0.46),
            (1.0, 0.23, 0.46),
            (0.746, 0.23, 0.46),
        ],
        wheel_radius_m: 0.355,
    },
    Engine {
        blueprints: "vehicle.nissan.patrol",
        torque_curve: &[
            (1000.0, 262.2),
            (1500.0, 531.05),
            (2500.0, 881.6),
            (3100.0, 974.7),
            (3800.0, 974.7),
            (4700.0, 897.75),
            (5500.0, 784.7),
            (6000.0, 632.7),
        ],
        rpm_max: 6000.0,
        damping_full_throttle: 0.15,
        final_ratio: 4.814,
        gears: &[
            (5.08, 0.25, 0.58),
            (2.804, 0.17, 0.54),
            (1.783, 0.17, 0.5),
            (1.26, 0.25, 0.5),
            (1.0, 0.25, 0.5),
            (0.835, 0.25, 0.5),
        ],
        wheel_radius_m: 0.39,
    },
];

/// What all three have: drag at closed throttle, newton metre seconds.
const DAMPING_ENGAGED: f32 = 2.0;
const DAMPING_DISENGAGED: f32 = 0.35;
/// Kilogram square metres.
const INERTIA_KGM2: f32 = 1.0;
const CLUTCH_STRENGTH: f32 = 10.0;
const SWITCH_SECS: f32 = 0.1;

/// What is given to the others: torque over the published one, of which the recorded ones have so
/// much; the drag at full throttle, and shares to change gears at.
const TORQUE_TIMES: f32 = 1.8;
const DAMPING_FULL_THROTTLE: f32 = 0.05;
const DOWN_SHARE: f32 = 0.23;
const UP_SHARE: f32 = 0.5;
/// Highest torque and speed of the engine to which those drags belong, of the Lincoln. Others have
/// as much drag for their torque at their highest speed.
const DRAG_TORQUE_NM: f32 = 695.0;
const DRAG_RPM_MAX: f32 = 6500.0;

/// Gives a car the engine and the gearbox that it has in CARLA.
///
/// The final ratio is that of CARLA over its wheels' radius, so that speeds belong to engine speeds
/// as they do there.
pub(super) fn fit(blueprint: &str, physics: &mut VehiclePhysics, wheel_radius_m: f32) {
    physics.gear_switch_secs = SWITCH_SECS;
    match RECORDED.iter().find(|engine| blueprint.starts_with(engine.blueprints)) {
        Some(engine) => fit_recorded(engine, physics, wheel_radius_m),
        None => fit_other(physics),
    }
}

fn fit_recorded(engine: &Engine, physics: &mut VehiclePhysics, wheel_radius_m: f32) {
    let gear =
        |&(ratio, down_share, up_share): &(f32, f32, f32)| Gear { ratio, down_share, up_share };
    physics.torque_curve = engine.torque_curve.to_vec();
    physics.engine_rpm_max = engine.rpm_max;
    physics.forward_gears = engine.gears.iter().map(gear).collect();
    physics.final_ratio = engine.final_ratio * wheel_radius_m / engine.wheel_radius_m;
    drag(physics, engine.damping_full_throttle, 1.0);
}

fn fit_other(physics: &mut VehiclePhysics) {
    for point in &mut physics.torque_curve {
        point.1 *= TORQUE_TIMES;
    }
    let highest_nm = physics.torque_curve.iter().map(|point| point.1).fold(0.0, f32::max);
    let speed = DRAG_RPM_MAX / physics.engine_rpm_max;
    drag(physics, DAMPING_FULL_THROTTLE, highest_nm / DRAG_TORQUE_NM * speed);
    if let [_, _, ..] = physics.forward_gears.as_slice() {
        for gear in &mut physics.forward_gears {
            (gear.down_share, gear.up_share) = (DOWN_SHARE, UP_SHARE);
        }
    }
}

/// Drag, inertia and clutch, for so many times the torque over the speed of the recorded ones.
fn drag(physics: &mut VehiclePhysics, full_throttle: f32, times: f32) {
    physics.damping_full_throttle = full_throttle * times;
    physics.damping_closed_throttle_clutch_engaged = DAMPING_ENGAGED * times;
    physics.damping_closed_throttle_clutch_disengaged = DAMPING_DISENGAGED * times;
    physics.engine_inertia_kgm2 = INERTIA_KGM2 * times;
    physics.clutch_strength = CLUTCH_STRENGTH * times;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(blueprint: &str) -> (VehiclePhysics, VehiclePhysics) {
        let model = crate::wheels::model(blueprint).unwrap();
        let mut physics = model.physics.clone();
        fit(blueprint, &mut physics, model.wheel_radius_m);
        (model.physics.clone(), physics)
    }

    #[test]
    fn recorded_engines_turn_as_fast_for_a_speed_as_in_carla() {
        for (blueprint, turns_per_m) in [
            ("vehicle.tesla.model3", 9.0 / 0.37),
            ("vehicle.lincoln.mkz_2020", 3.21 / 0.355),
            ("vehicle.nissan.patrol_2021", 4.814 / 0.39),
        ] {
            let radius_m = crate::wheels::model(blueprint).unwrap().wheel_radius_m;
            let found = fitted(blueprint).1.final_ratio / radius_m;
            assert!((found - turns_per_m).abs() < 1.0e-3, "{blueprint}: {found}");
        }
    }

    #[test]
    fn other_engines_have_more_torque_and_a_drag_that_belongs_to_it() {
        let highest_nm = |physics: &VehiclePhysics| {
            physics.torque_curve.iter().map(|point| point.1).fold(0.0, f32::max)
        };
        for blueprint in ["vehicle.audi.tt", "vehicle.carlamotors.firetruck"] {
            let (real, carla) = fitted(blueprint);
            assert!((highest_nm(&carla) / highest_nm(&real) - 1.8).abs() < 1.0e-3, "{blueprint}");
            // Coasting at the highest speed it brakes as hard as the Lincoln's for its torque.
            let drag_nm = carla.damping_closed_throttle_clutch_engaged * carla.engine_rpm_max;
            let share = drag_nm / highest_nm(&carla) / (2.0 * 6500.0 / 695.0);
            assert!((share - 1.0).abs() < 1.0e-3, "{blueprint}: {share}");
            assert!(carla.forward_gears.iter().all(|gear| gear.up_share == 0.5), "{blueprint}");
        }
    }

    #[test]
    fn a_single_gear_is_never_left() {
        let (real, carla) = fitted("vehicle.audi.etron");
        assert_eq!(real.forward_gears, carla.forward_gears);
    }
}
