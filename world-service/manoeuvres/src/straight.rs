//! Along the track: starts, stops, coasting, slippery roads.

use schemas::VehicleControl;

use crate::Result;
use crate::track::{DT_SECS, Rig, steps};

/// Rolling resistance over load, of a radial tyre on asphalt.
const ROLLING: f32 = 0.011;
const GRAVITY_MPS2: f32 = 9.81;
/// What a standing vehicle may still move.
const STAND_MPS: f32 = 0.05;

/// Seconds from a stand to a speed at full throttle, and the speed over time on the way.
pub(crate) fn start(id: &str, mps: f32) -> Result<(f32, Vec<(f32, f32)>)> {
    let mut rig = Rig::standing(id)?;
    rig.control(VehicleControl { throttle: 1.0, ..VehicleControl::default() })?;
    let mut curve = vec![(0.0, 0.0)];
    for step in 1..=steps(60.0) {
        rig.step()?;
        let (secs, speed_mps) = (step as f32 * DT_SECS, rig.speed_mps()?);
        curve.push((secs, 3.6 * speed_mps));
        if speed_mps >= mps {
            return Ok((secs, curve));
        }
    }
    Ok((f32::INFINITY, curve))
}

/// Metres from a speed to a stand under full braking.
pub(crate) fn stop(id: &str, mps: f32) -> Result<f32> {
    stop_with_friction(id, mps, 1.0)
}

/// As [`stop`], with the friction of all tyres scaled.
pub(crate) fn stop_with_friction(id: &str, mps: f32, share: f32) -> Result<f32> {
    let mut rig = Rig::rolling(id, mps)?;
    rig.change(|physics| {
        physics.wheels.iter_mut().for_each(|wheel| wheel.tyre_friction *= share);
    })?;
    let start_m = rig.position_m()?.x;
    rig.brake()?;
    for _ in 0..steps(120.0) {
        rig.step()?;
        if rig.speed_mps()? < STAND_MPS {
            break;
        }
    }
    Ok(rig.position_m()?.x - start_m)
}

/// Seconds to roll from one speed to a lower one in neutral: as driven, and by the equation of
/// motion with the same drag and rolling resistance but massless wheels.
pub(crate) fn coast(id: &str, from_mps: f32, to_mps: f32) -> Result<(f32, f32)> {
    let mut rig = Rig::rolling(id, from_mps)?;
    rig.control(VehicleControl { manual_gear: true, gear: 0, ..VehicleControl::default() })?;
    rig.step()?;
    let report = rig.report()?;
    let (physics, telemetry) = (&report.physics, &report.telemetry);
    let drag_kg_per_m = telemetry.drag_n / telemetry.speed_mps.powi(2);
    let bearings_kg_per_s: f32 =
        physics.wheels.iter().map(|wheel| wheel.damping_rate / wheel.radius_m.powi(2)).sum();
    let weight_n = physics.mass_kg * GRAVITY_MPS2;
    let (mut wanted_secs, mut mps) = (0.0, from_mps);
    while mps > to_mps {
        let force_n = drag_kg_per_m * mps * mps + bearings_kg_per_s * mps + ROLLING * weight_n;
        mps -= force_n / physics.mass_kg * DT_SECS;
        wanted_secs += DT_SECS;
    }
    let mut secs = DT_SECS;
    while rig.speed_mps()? > to_mps && secs < 600.0 {
        rig.step()?;
        secs += DT_SECS;
    }
    Ok((secs, wanted_secs))
}
