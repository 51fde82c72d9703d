//! What a vehicle measured in the last substep, as CARLA tells it.

use nalgebra::RealField;
use schemas::{VehicleTelemetry, WheelTelemetry};
use serde::{Deserialize, Serialize};

use super::fit::{Fit, WheelFit};
use super::tyre::{self, TyreForce, TyreInput};
use super::{VehicleState, Wheel};

/// Rolling speed below which slip is told over this speed, or it would be endless at a stand.
const SLIP_MPS_MIN: f32 = 1.0;

/// What one wheel did in one substep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Contact {
    friction: f32,
    forward_mps: f32,
    left_mps: f32,
    load_n: f32,
    torque_nm: f32,
    forward_n: f32,
    left_n: f32,
    limit_n: f32,
}

impl Contact {
    pub(super) fn new(input: &TyreInput, force: &TyreForce, spin_radps: f32) -> Self {
        Self {
            friction: input.friction,
            forward_mps: input.forward_mps,
            left_mps: input.left_mps,
            load_n: input.load_n,
            torque_nm: input.drive_nm - input.brake.torque_nm * spin_radps.signum(),
            forward_n: force.forward_n,
            left_n: force.left_n,
            limit_n: tyre::friction_n(input),
        }
    }
}

/// What the vehicle did in the last tick, at this velocity along itself and through the air.
pub(crate) fn telemetry(
    fit: &Fit,
    state: &VehicleState,
    forward_mps: f32,
    air_mps: f32,
) -> VehicleTelemetry {
    VehicleTelemetry {
        speed_mps: forward_mps,
        steer: state.control.steer,
        throttle: state.control.throttle,
        brake: state.control.brake,
        engine_rpm: state.drivetrain.engine_rpm,
        gear: state.drivetrain.gear(fit),
        drag_n: fit.drag_n_per_mps2 * air_mps * air_mps,
        wheels: state
            .wheels
            .iter()
            .zip(&fit.wheels)
            .map(|(wheel, fit)| of_wheel(wheel, fit))
            .collect(),
    }
}

fn of_wheel(wheel: &Wheel, fit: &WheelFit) -> WheelTelemetry {
    let contact = &wheel.contact;
    let rolling_mps = contact.forward_mps.abs().max(SLIP_MPS_MIN);
    let slip_mps = wheel.spin_radps * fit.physics.radius_m - contact.forward_mps;
    let limit_n = contact.limit_n.max(1.0e-3);
    let touches = contact.load_n > 0.0;
    WheelTelemetry {
        tyre_friction: contact.friction,
        lateral_slip: RealField::atan2(contact.left_mps, rolling_mps),
        longitudinal_slip: if touches { slip_mps / rolling_mps } else { 0.0 },
        spin_radps: wheel.spin_radps,
        load_n: contact.load_n,
        load_share: contact.load_n / fit.load_n,
        torque_nm: contact.torque_nm,
        longitudinal_force_n: contact.forward_n,
        lateral_force_n: contact.left_n,
        longitudinal_force_share: contact.forward_n / limit_n,
        lateral_force_share: contact.left_n / limit_n,
    }
}
