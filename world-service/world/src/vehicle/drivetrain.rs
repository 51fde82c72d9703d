//! Engine, automatic gearbox and differential: from the throttle to the torque on the driven axle.

use std::f32::consts::TAU;

use schemas::VehicleControl;
use serde::{Deserialize, Serialize};

use super::spec::{EngineSpec, GearboxSpec};
use super::steering::interpolate;
use super::{VehicleSpec, WHEEL_COUNT};

/// Engine speed to which the torque converter lets the engine rise at full throttle, over idle.
const LAUNCH_RPM: f32 = 1_400.0;
/// Speed of the vehicle below which it changes between forward and reverse.
const REVERSE_MPS: f32 = 2.0;
/// Changes of gear are at least this far apart, so that the box does not hunt.
const SHIFT_INTERVAL_SECS: f32 = 0.6;
/// Engine speeds for shifting as shares of the highest: (closed throttle, full throttle).
const UPSHIFT: (f32, f32) = (0.36, 0.92);
const DOWNSHIFT: (f32, f32) = (0.17, 0.42);

/// Engine speed and gear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drivetrain {
    /// -1 reverse, 1 and up forward.
    pub gear: i8,
    /// Since the last change of gear; only its first second matters.
    pub since_shift_secs: f32,
}

impl Drivetrain {
    /// The gear that a driver who coasts at this speed would be in.
    pub(super) fn at_speed(spec: &VehicleSpec, forward_mps: f32) -> Self {
        let mut gear = 1;
        let rpm_in = |gear| rpm_at(spec, gear, forward_mps.max(0.0) / spec.wheel_radius_m);
        while gear < top_gear(&spec.gearbox) && rpm_in(gear) > UPSHIFT.0 * rpm_max(&spec.engine) {
            gear += 1;
        }
        Self { gear, since_shift_secs: SHIFT_INTERVAL_SECS }
    }

    /// Torque on all driven wheels together, newton metres; positive drives forward.
    pub(super) fn advance(
        &mut self,
        spec: &VehicleSpec,
        control: &VehicleControl,
        spins_radps: &[f32; WHEEL_COUNT],
        dt_secs: f32,
    ) -> f32 {
        let spin_radps = driven_spin_radps(spec, spins_radps);
        self.since_shift_secs = (self.since_shift_secs + dt_secs).min(SHIFT_INTERVAL_SECS);
        self.choose_direction(spec, control.reverse, spin_radps);
        self.shift(spec, control.throttle, spin_radps);
        let wrong_way = control.reverse != (self.gear < 0);
        if self.since_shift_secs < spec.gearbox.shift_secs || wrong_way {
            return 0.0;
        }
        let rpm = rpm_at(spec, self.gear, spin_radps);
        let ratio = ratio(&spec.gearbox, self.gear);
        engine_nm(&spec.engine, rpm, control.throttle) * ratio * spec.gearbox.efficiency
    }

    /// Inertia of the engine as the driven axle feels it under throttle; without, the converter slips.
    pub(super) fn inertia_at_wheel_kgm2(
        &self,
        spec: &VehicleSpec,
        control: &VehicleControl,
    ) -> f32 {
        if control.throttle <= 0.0 || control.brake > 0.0 {
            return 0.0;
        }
        let ratio = ratio(&spec.gearbox, self.gear);
        spec.engine.inertia_kgm2 * ratio * ratio
    }

    fn choose_direction(&mut self, spec: &VehicleSpec, reverse: bool, spin_radps: f32) {
        let slow = spin_radps.abs() * spec.wheel_radius_m < REVERSE_MPS;
        if slow && reverse != (self.gear < 0) {
            self.gear = if reverse { -1 } else { 1 };
        }
    }

    fn shift(&mut self, spec: &VehicleSpec, throttle: f32, spin_radps: f32) {
        if self.gear < 1 || self.since_shift_secs < SHIFT_INTERVAL_SECS {
            return;
        }
        let share = rpm_at(spec, self.gear, spin_radps) / rpm_max(&spec.engine);
        let at = |(closed, full): (f32, f32)| closed + (full - closed) * throttle;
        let wanted = if share > at(UPSHIFT) && self.gear < top_gear(&spec.gearbox) {
            self.gear + 1
        } else if share < at(DOWNSHIFT) && self.gear > 1 {
            self.gear - 1
        } else {
            return;
        };
        self.gear = wanted;
        self.since_shift_secs = 0.0;
    }
}

/// Torque of the engine; negative when it brakes.
fn engine_nm(engine: &EngineSpec, rpm: f32, throttle: f32) -> f32 {
    let launched_rpm = rpm.max(engine.idle_rpm + LAUNCH_RPM * throttle);
    let full_nm = if launched_rpm > rpm_max(engine) {
        0.0
    } else {
        interpolate(engine.torque_nm, launched_rpm)
    };
    // Below twice idle the converter slips, so that an idling engine neither drives nor brakes.
    let coupling = ((rpm - engine.idle_rpm) / engine.idle_rpm.max(500.0)).clamp(0.0, 1.0);
    full_nm * throttle - engine.drag_nm * coupling * (1.0 - throttle)
}

fn rpm_max(engine: &EngineSpec) -> f32 {
    engine.torque_nm.last().map_or(0.0, |&(rpm, _)| rpm)
}

fn rpm_at(spec: &VehicleSpec, gear: i8, spin_radps: f32) -> f32 {
    (spin_radps * ratio(&spec.gearbox, gear)).max(0.0) * 60.0 / TAU
}

/// Turns of the engine per turn of the wheel; negative in reverse.
fn ratio(gearbox: &GearboxSpec, gear: i8) -> f32 {
    let index = usize::try_from(gear - 1).ok();
    let of_gear = index.and_then(|index| gearbox.forward.get(index).copied());
    of_gear.unwrap_or(-gearbox.reverse) * gearbox.final_drive
}

fn top_gear(gearbox: &GearboxSpec) -> i8 {
    i8::try_from(gearbox.forward.len()).unwrap_or(i8::MAX)
}

/// Mean spin of the driven wheels: what an open differential passes to the gearbox.
fn driven_spin_radps(spec: &VehicleSpec, spins_radps: &[f32; WHEEL_COUNT]) -> f32 {
    spins_radps.iter().enumerate().map(|(wheel, spin)| spin * spec.driven.share(wheel)).sum()
}
