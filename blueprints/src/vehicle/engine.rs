//! Torque curves from the figures that manufacturers publish.

use std::f32::consts::TAU;

/// An engine or motor.
#[derive(Clone, Copy, Debug)]
pub(super) enum Engine {
    /// With pistons: published torque and power, and where they are reached.
    Piston {
        torque_nm: f32,
        /// Revolutions per minute between which the torque is full.
        plateau_rpm: (f32, f32),
        power_kw: f32,
        power_rpm: f32,
        idle_rpm: f32,
        rpm_max: f32,
        inertia_kgm2: f32,
    },
    /// Electric, or a rider's legs: full torque from a stand until power limits it.
    Motor { torque_nm: f32, power_kw: f32, rpm_max: f32, inertia_kgm2: f32 },
}

/// Torque at the lowest speed that the curve names, over the highest.
const LOW_SHARE: f32 = 0.65;
/// Torque where the limiter cuts in, over that at the highest power.
const LIMIT_SHARE: f32 = 0.85;
/// Points of a motor's curve beyond its base speed.
const FIELD_POINTS: u8 = 5;
/// Drag of a closed throttle over the highest torque, per radian per second.
const PISTON_DRAG_SECS: f32 = 2.5e-4;
const MOTOR_DRAG_SECS: f32 = 1.0e-4;

impl Engine {
    /// (revolutions per minute, newton metres) at full throttle, ascending.
    pub(super) fn torque_curve(&self) -> Vec<(f32, f32)> {
        match *self {
            Self::Piston {
                torque_nm,
                plateau_rpm: (from, to),
                power_kw,
                power_rpm,
                idle_rpm,
                rpm_max,
                ..
            } => {
                let power_nm = torque_of_power_nm(power_kw, power_rpm);
                let mut points = vec![(idle_rpm, LOW_SHARE * torque_nm), (from, torque_nm)];
                if to > from {
                    points.push((to, torque_nm));
                }
                points.push((power_rpm, power_nm));
                points.push((rpm_max, LIMIT_SHARE * power_nm));
                points
            }
            Self::Motor { torque_nm, power_kw, rpm_max, .. } => {
                let base_rpm = power_kw * 1_000.0 / torque_nm * 60.0 / TAU;
                let mut points = vec![(0.0, torque_nm)];
                // Denser near the base speed, where the hyperbola bends most.
                points.extend((0..=FIELD_POINTS).map(|point| {
                    let along = f32::from(point) / f32::from(FIELD_POINTS);
                    let rpm = base_rpm + (rpm_max - base_rpm) * along * along;
                    (rpm, torque_of_power_nm(power_kw, rpm))
                }));
                points
            }
        }
    }

    pub(super) fn rpm_max(&self) -> f32 {
        match *self {
            Self::Piston { rpm_max, .. } | Self::Motor { rpm_max, .. } => rpm_max,
        }
    }

    pub(super) fn idle_rpm(&self) -> f32 {
        match *self {
            Self::Piston { idle_rpm, .. } => idle_rpm,
            Self::Motor { .. } => 0.0,
        }
    }

    pub(super) fn inertia_kgm2(&self) -> f32 {
        match *self {
            Self::Piston { inertia_kgm2, .. } | Self::Motor { inertia_kgm2, .. } => inertia_kgm2,
        }
    }

    pub(super) fn torque_nm(&self) -> f32 {
        match *self {
            Self::Piston { torque_nm, .. } | Self::Motor { torque_nm, .. } => torque_nm,
        }
    }

    /// Drag with closed throttle, newton metre seconds.
    pub(super) fn drag_nms(&self) -> f32 {
        match self {
            Self::Piston { torque_nm, .. } => PISTON_DRAG_SECS * torque_nm,
            Self::Motor { torque_nm, .. } => MOTOR_DRAG_SECS * torque_nm,
        }
    }

    /// Share of the power that reaches the wheels.
    pub(super) fn efficiency(&self) -> f32 {
        match self {
            Self::Piston { .. } => 0.9,
            Self::Motor { .. } => 0.95,
        }
    }
}

fn torque_of_power_nm(power_kw: f32, rpm: f32) -> f32 {
    power_kw * 1_000.0 * 60.0 / (TAU * rpm)
}
