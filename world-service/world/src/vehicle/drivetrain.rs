//! Engine, clutch, gearbox and differential: from the throttle to the torque on the driven wheels.

mod carla;

use std::f32::consts::TAU;

use schemas::{Gear, Handling, VehicleControl, VehiclePhysics};
use serde::{Deserialize, Serialize};

use super::Wheel;
use super::fit::Fit;
use super::steering::interpolate;

/// Share of the span from idle to the highest speed to which the clutch lets the engine rise when
/// it starts at full throttle: as a torque converter does, and as a motorcyclist does.
const LAUNCH_SHARE: f32 = 0.24;
const RIDER_LAUNCH_SHARE: f32 = 0.5;
/// Changes of gear are at least this far apart, so that the box does not hunt.
const SHIFT_INTERVAL_SECS: f32 = 0.6;
/// Engine speed for shifting with closed throttle over that at full throttle...
const CLOSED_SHARE: f32 = 0.4;
/// ...and the least of it over idle, for engines with a narrow band.
const CLOSED_OVER_IDLE: f32 = 1.8;
/// Engine speed over idle at which the clutch is entirely closed, of engines with little idle.
const COUPLING_RPM_MIN: f32 = 500.0;

/// Engine speed and gear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drivetrain {
    /// -1 reverse, 0 neutral, 1 and up forward.
    pub gear: i8,
    /// Since the last change of gear; only the time until the next one may begin matters.
    pub since_shift_secs: f32,
    /// Revolutions per minute.
    pub engine_rpm: f32,
}

/// What the driven wheels feel together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drive {
    /// Positive drives forward.
    pub torque_nm: f32,
    /// Of the engine, as far as it is held to the wheels.
    pub inertia_kgm2: f32,
}

impl Drivetrain {
    /// The gear that a driver who coasts at this speed would be in.
    pub(super) fn at_speed(fit: &Fit, forward_mps: f32) -> Self {
        let mut gear = 1;
        let spin_radps = forward_mps.max(0.0) / fit.model.wheel_radius_m;
        while gear < top_gear(&fit.physics)
            && rpm_at(fit, gear, spin_radps) > shift_rpm(fit, gear, 0.0, |gear| gear.up_share)
        {
            gear += 1;
        }
        let engine_rpm = rpm_at(fit, gear, spin_radps).max(idle_rpm(fit));
        Self { gear, since_shift_secs: settled_secs(fit), engine_rpm }
    }

    /// Of a vehicle that is put somewhere with this speed.
    pub(super) fn put(fit: &Fit, forward_mps: f32) -> Self {
        match fit.physics.handling {
            Handling::Carla if fit.physics.automatic_gearbox && forward_mps == 0.0 => Self::NEUTRAL,
            _ => Self::at_speed(fit, forward_mps),
        }
    }

    /// The same of one whose wheels turn.
    pub(super) fn on_wheels(fit: &Fit, wheels: &[Wheel]) -> Self {
        Self::put(fit, driven_spin_radps(fit, wheels) * fit.model.wheel_radius_m)
    }

    /// The gear in which the vehicle is; none while CARLA's box changes it.
    pub(crate) fn gear(&self, fit: &Fit) -> i8 {
        let is_between = fit.physics.handling == Handling::Carla && self.changes(fit);
        if is_between { 0 } else { self.gear }
    }

    pub(super) fn is_in_neutral(&self) -> bool {
        self.gear == 0
    }

    fn changes(&self, fit: &Fit) -> bool {
        self.since_shift_secs < fit.physics.gear_switch_secs
    }

    pub(super) fn advance(
        &mut self,
        fit: &Fit,
        control: &VehicleControl,
        wheels: &[Wheel],
        dt_secs: f32,
    ) -> Drive {
        let spin_radps = driven_spin_radps(fit, wheels);
        self.since_shift_secs = (self.since_shift_secs + dt_secs).min(settled_secs(fit));
        self.choose_gear(fit, control, spin_radps);
        match fit.physics.handling {
            _ if self.gear == 0 => self.rev_freely(fit, control.throttle, dt_secs),
            Handling::Carla if self.changes(fit) => self.rev_freely(fit, 0.0, dt_secs),
            Handling::Real if self.changes(fit) => self.rev_freely(fit, control.throttle, dt_secs),
            Handling::Real => return self.couple(fit, control, spin_radps),
            Handling::Carla => return self.slip(fit, control.throttle, spin_radps, dt_secs),
        }
        Drive::default()
    }

    fn choose_gear(&mut self, fit: &Fit, control: &VehicleControl, spin_radps: f32) {
        if control.manual_gear {
            self.ask(fit, control.gear.clamp(-1, top_gear(&fit.physics)));
            return;
        }
        let forward_mps = spin_radps * fit.model.wheel_radius_m;
        // At any speed, as CARLA does: the clutch slips until the wheels turn the other way.
        if control.reverse {
            self.gear = -1;
        } else if self.gear < 0 || self.gear == 0 && !self.stays_in_neutral(fit) {
            *self = Self::at_speed(fit, forward_mps);
        }
        if fit.physics.automatic_gearbox {
            match fit.physics.handling {
                Handling::Real => self.shift(fit, control.throttle, spin_radps),
                Handling::Carla => self.shift_as_carla(fit, forward_mps),
            }
        }
    }

    fn shift(&mut self, fit: &Fit, throttle: f32, spin_radps: f32) {
        if self.gear < 1 || self.since_shift_secs < SHIFT_INTERVAL_SECS {
            return;
        }
        let rpm = rpm_at(fit, self.gear, spin_radps);
        let at = |share: fn(&Gear) -> f32| shift_rpm(fit, self.gear, throttle, share);
        if rpm > at(|gear| gear.up_share) && self.gear < top_gear(&fit.physics) {
            self.engage(self.gear + 1);
        } else if rpm < at(|gear| gear.down_share) && self.gear > 1 {
            self.engage(self.gear - 1);
        }
    }

    /// Takes the gear that a driver asks for.
    fn ask(&mut self, fit: &Fit, gear: i8) {
        if gear != self.gear {
            self.engage(gear);
            if fit.physics.handling == Handling::Carla {
                // At once.
                self.since_shift_secs = fit.physics.gear_switch_secs;
            }
        }
    }

    fn engage(&mut self, gear: i8) {
        if gear != self.gear {
            self.gear = gear;
            self.since_shift_secs = 0.0;
        }
    }

    /// The engine alone, with an open clutch.
    fn rev_freely(&mut self, fit: &Fit, throttle: f32, dt_secs: f32) {
        let physics = &fit.physics;
        let open = physics.damping_closed_throttle_clutch_disengaged;
        let damping_nms = open + (physics.damping_full_throttle - open) * throttle;
        let full_nm = interpolate(&physics.torque_curve, self.engine_rpm) * throttle;
        let rate = dt_secs / physics.engine_inertia_kgm2;
        // Implicit in the damping, so that a light engine with much drag does not swing.
        let radps = (self.engine_rpm * TAU / 60.0 + full_nm * rate) / (1.0 + damping_nms * rate);
        let highest_rpm = physics.engine_rpm_max.max(idle_rpm(fit));
        self.engine_rpm = (radps * 60.0 / TAU).clamp(idle_rpm(fit), highest_rpm);
    }

    /// The engine on the wheels, through a clutch that slips to let it start.
    fn couple(&mut self, fit: &Fit, control: &VehicleControl, spin_radps: f32) -> Drive {
        let (physics, throttle) = (&fit.physics, control.throttle);
        let rpm = rpm_at(fit, self.gear, spin_radps);
        let ratio = ratio(fit, self.gear);
        self.engine_rpm = rpm.max(launch_rpm(fit, throttle));
        let full_nm = if self.engine_rpm > physics.engine_rpm_max {
            0.0
        } else {
            interpolate(&physics.torque_curve, self.engine_rpm)
        };
        let slip_radps = ((physics.engine_rpm_max - rpm) * TAU / 60.0).max(0.0);
        let driving_nm = (full_nm * throttle).min(physics.clutch_strength * slip_radps);
        let torque_nm = driving_nm - drag_nm(fit, rpm, throttle);
        // Without throttle, or against the brake, the clutch slips.
        let held = throttle > 0.0 && control.brake <= 0.0;
        Drive {
            torque_nm: torque_nm * ratio * fit.model.efficiency,
            inertia_kgm2: if held { physics.engine_inertia_kgm2 * ratio * ratio } else { 0.0 },
        }
    }
}

impl Fit {
    /// What the driven wheels push a vehicle with that starts at full throttle on a level road, by
    /// its weight; what they slip is left out.
    pub(super) fn start_mps2(&self) -> f32 {
        let physics = &self.physics;
        let engine_nm = interpolate(&physics.torque_curve, launch_rpm(self, 1.0));
        let clutch_nm = physics.clutch_strength * physics.engine_rpm_max * TAU / 60.0;
        let wheels_nm = engine_nm.min(clutch_nm) * ratio(self, 1) * self.model.efficiency;
        wheels_nm / (self.model.wheel_radius_m * physics.mass_kg)
    }
}

/// Since a change of gear, until it is over and the next one may begin.
fn settled_secs(fit: &Fit) -> f32 {
    fit.physics.gear_switch_secs.max(SHIFT_INTERVAL_SECS)
}

/// Engine speed to which the clutch lets the engine rise when it starts.
fn launch_rpm(fit: &Fit, throttle: f32) -> f32 {
    let share = if fit.model.is_two_wheeler() { RIDER_LAUNCH_SHARE } else { LAUNCH_SHARE };
    let idle_rpm = fit.model.idle_rpm;
    idle_rpm + share * (fit.physics.engine_rpm_max - idle_rpm) * throttle
}

/// Drag of the engine on a closing throttle. Below twice idle the clutch opens, so that an idling
/// engine neither drives nor brakes.
fn drag_nm(fit: &Fit, rpm: f32, throttle: f32) -> f32 {
    let idle_rpm = fit.model.idle_rpm;
    let coupling = ((rpm - idle_rpm) / idle_rpm.max(COUPLING_RPM_MIN)).clamp(0.0, 1.0);
    damping_nms(&fit.physics, throttle) * rpm * TAU / 60.0 * coupling
}

/// Of the engine with an engaged clutch; less with more throttle.
fn damping_nms(physics: &VehiclePhysics, throttle: f32) -> f32 {
    let closed = physics.damping_closed_throttle_clutch_engaged;
    closed + (physics.damping_full_throttle - closed) * throttle
}

/// Engine speed below which an engine that is alone does not fall.
fn idle_rpm(fit: &Fit) -> f32 {
    match fit.physics.handling {
        Handling::Real => fit.model.idle_rpm,
        Handling::Carla => 0.0,
    }
}

/// Engine speed at which the box leaves a gear; earlier with less throttle, but for CARLA's.
fn shift_rpm(fit: &Fit, gear: i8, throttle: f32, share: impl Fn(&Gear) -> f32) -> f32 {
    let index = usize::try_from(gear - 1).unwrap_or(0);
    let Some(gear) = fit.physics.forward_gears.get(index) else { return 0.0 };
    if fit.physics.handling == Handling::Carla {
        return share(gear) * fit.physics.engine_rpm_max;
    }
    let up_rpm = gear.up_share * fit.physics.engine_rpm_max;
    let closed = (CLOSED_OVER_IDLE * fit.model.idle_rpm / up_rpm.max(1.0)).clamp(CLOSED_SHARE, 1.0);
    share(gear) * fit.physics.engine_rpm_max * (closed + (1.0 - closed) * throttle)
}

fn rpm_at(fit: &Fit, gear: i8, spin_radps: f32) -> f32 {
    (spin_radps * ratio(fit, gear)).max(0.0) * 60.0 / TAU
}

/// Turns of the engine per turn of the wheel; negative in reverse.
fn ratio(fit: &Fit, gear: i8) -> f32 {
    let index = usize::try_from(gear - 1).ok();
    let of_gear = index.and_then(|index| fit.physics.forward_gears.get(index));
    of_gear.map_or(-fit.model.reverse_ratio, |gear| gear.ratio) * fit.physics.final_ratio
}

fn top_gear(physics: &VehiclePhysics) -> i8 {
    i8::try_from(physics.forward_gears.len()).unwrap_or(i8::MAX)
}

/// Mean spin of the driven wheels: what an open differential passes to the gearbox.
fn driven_spin_radps(fit: &Fit, wheels: &[Wheel]) -> f32 {
    wheels.iter().zip(&fit.wheels).map(|(wheel, fit)| wheel.spin_radps * fit.drive_share).sum()
}
