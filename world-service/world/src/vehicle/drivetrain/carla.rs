//! The gearbox and the clutch of CARLA's cars, which are those of PhysX vehicles.

use std::f32::consts::TAU;

use schemas::{Gear, Handling};

use super::{Drive, Drivetrain, damping_nms, ratio, shift_rpm, top_gear};
use crate::vehicle::fit::Fit;
use crate::vehicle::steering::interpolate;

/// The box begins no change earlier after the one before.
const LATENCY_SECS: f32 = 0.5;
/// Share of the highest engine speed above which the box leaves neutral.
const NEUTRAL_UP_SHARE: f32 = 0.15;

impl Drivetrain {
    /// Of a car that was just put somewhere: its engine has to rev up first.
    pub(super) const NEUTRAL: Self = Self { gear: 0, since_shift_secs: 0.0, engine_rpm: 0.0 };

    /// Whether a car in neutral stays so until its engine turns fast enough.
    pub(super) fn stays_in_neutral(&self, fit: &Fit) -> bool {
        fit.physics.handling == Handling::Carla && fit.physics.automatic_gearbox
    }

    /// By the speed of the engine, whatever the throttle.
    pub(super) fn shift_as_carla(&mut self, fit: &Fit, forward_mps: f32) {
        if self.since_shift_secs < LATENCY_SECS {
            return;
        }
        let at = |share: fn(&Gear) -> f32| shift_rpm(fit, self.gear, 1.0, share);
        let top = top_gear(&fit.physics);
        match self.gear {
            ..=-1 => {}
            0 if self.engine_rpm > NEUTRAL_UP_SHARE * fit.physics.engine_rpm_max => {
                self.engage(Self::at_speed(fit, forward_mps).gear);
            }
            0 => {}
            gear if gear < top && self.engine_rpm > at(|gear| gear.up_share) => {
                self.engage(gear + 1);
            }
            gear if gear > 1 && self.engine_rpm < at(|gear| gear.down_share) => {
                self.engage(gear - 1);
            }
            _ => {}
        }
    }

    /// The engine on the wheels as in PhysX, which CARLA's cars drive with: the clutch passes its
    /// strength times what it slips by, down to a standstill.
    ///
    /// Implicit in the slip: of what changes the wheels' spin within the substep, the clutch takes
    /// its part as if it were inertia.
    pub(super) fn slip(
        &mut self,
        fit: &Fit,
        throttle: f32,
        spin_radps: f32,
        dt_secs: f32,
    ) -> Drive {
        let physics = &fit.physics;
        let (ratio, strength) = (ratio(fit, self.gear), physics.clutch_strength);
        let wheels_radps = (spin_radps * ratio).max(0.0);
        let full_nm = interpolate(&physics.torque_curve, self.engine_rpm);
        let inertia_kgm2 = physics.engine_inertia_kgm2;
        let held_kgm2 = inertia_kgm2 + dt_secs * (damping_nms(physics, throttle) + strength);
        let engine_radps = self.engine_rpm * TAU / 60.0;
        let pushed = inertia_kgm2 * engine_radps + dt_secs * full_nm * throttle;
        let radps = (pushed + dt_secs * strength * wheels_radps) / held_kgm2;
        let highest_radps = physics.engine_rpm_max * TAU / 60.0;
        self.engine_rpm = radps.min(highest_radps) * 60.0 / TAU;
        let slip_nms = strength * (1.0 - dt_secs * strength / held_kgm2);
        Drive {
            torque_nm: strength * (radps.min(highest_radps) - wheels_radps) * ratio,
            inertia_kgm2: slip_nms * dt_secs * ratio * ratio,
        }
    }
}

#[cfg(test)]
mod tests {
    use blueprints::Class;
    use schemas::VehicleControl;

    use super::*;
    use crate::vehicle::Wheel;

    const STEP_SECS: f32 = 0.01;

    /// A Lincoln with CARLA's gearbox.
    fn lincoln() -> Fit {
        let blueprint = blueprints::find("vehicle.lincoln.mkz_2017").unwrap();
        let Class::Vehicle(model) = blueprint.class else { panic!("a vehicle") };
        let mut physics = model.physics.clone();
        physics.handling = Handling::Carla;
        physics.gear_switch_secs = 0.1;
        physics.clutch_strength = 10.0;
        physics.engine_inertia_kgm2 = 1.0;
        for gear in &mut physics.forward_gears {
            (gear.down_share, gear.up_share) = (0.2, 0.5);
        }
        Fit::new(model, physics)
    }

    fn wheels(fit: &Fit, mps: f32) -> Vec<Wheel> {
        let spin_radps = mps / fit.model.wheel_radius_m;
        vec![Wheel { spin_radps, ..Wheel::default() }; 4]
    }

    fn throttle(throttle: f32) -> VehicleControl {
        VehicleControl { throttle, ..VehicleControl::default() }
    }

    #[test]
    fn one_that_was_put_somewhere_stands_in_neutral_until_its_engine_has_revved_up() {
        let (fit, still) = (lincoln(), Vec::new());
        let mut drivetrain = Drivetrain::put(&fit, 0.0);
        let mut advance = |control: &VehicleControl| {
            let drive = drivetrain.advance(&fit, control, &still, STEP_SECS);
            (drivetrain.gear(&fit), drive.torque_nm)
        };
        for _ in 0..100 {
            assert_eq!(advance(&throttle(0.0)), (0, 0.0));
        }
        let revving = (0..200).take_while(|_| advance(&throttle(1.0)) == (0, 0.0)).count();
        assert!((20..70).contains(&revving), "{revving} steps");
        assert_eq!(advance(&throttle(1.0)).0, 1);
        assert!(advance(&throttle(0.0)).1 > 0.0);
    }

    #[test]
    fn one_that_moves_is_in_gear() {
        let fit = lincoln();
        assert!(Drivetrain::put(&fit, 0.5).gear(&fit) == 1);
        assert!(Drivetrain::put(&fit, 20.0).gear(&fit) > 1);
    }

    #[test]
    fn what_the_engine_turns_faster_in_the_gear_before_pushes_the_car() {
        let fit = lincoln();
        let mut drivetrain = Drivetrain::at_speed(&fit, 5.0);
        drivetrain.engine_rpm = 0.52 * fit.physics.engine_rpm_max;
        let wheels = wheels(&fit, 5.0);
        let mut told = Vec::new();
        while told.len() < 13 {
            let drive = drivetrain.advance(&fit, &throttle(1.0), &wheels, STEP_SECS);
            told.push((drivetrain.gear(&fit), drive.torque_nm, drivetrain.engine_rpm));
        }
        assert!(told[..9].iter().all(|&(gear, torque_nm, _)| (gear, torque_nm) == (0, 0.0)));
        // The throttle is closed meanwhile.
        assert!(told[..9].is_sorted_by(|a, b| a.2 >= b.2), "{told:?}");
        let (gear, pushed_nm, _) = told[11];
        assert_eq!(gear, 2);
        let settled = (0..300)
            .map(|_| drivetrain.advance(&fit, &throttle(1.0), &wheels, STEP_SECS).torque_nm)
            .last();
        assert!(pushed_nm > 1.5 * settled.unwrap(), "{pushed_nm} N m, then {settled:?}");
    }

    #[test]
    fn a_gear_that_a_driver_asks_for_is_there_at_once() {
        let fit = lincoln();
        let mut drivetrain = Drivetrain::put(&fit, 0.0);
        let third = VehicleControl { manual_gear: true, gear: 3, ..throttle(1.0) };
        drivetrain.advance(&fit, &third, &wheels(&fit, 0.0), STEP_SECS);
        assert_eq!(drivetrain.gear(&fit), 3);
        let back = VehicleControl { reverse: true, ..throttle(1.0) };
        let drive = drivetrain.advance(&fit, &back, &wheels(&fit, 0.0), STEP_SECS);
        assert!(drivetrain.gear(&fit) == -1 && drive.torque_nm < 0.0, "{drive:?}");
    }
}
