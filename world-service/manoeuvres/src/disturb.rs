//! Slopes, kerbs and drops: what a vehicle must bear without sliding, sinking or jumping.

use nalgebra::Vector3;
use schemas::VehicleControl;

use crate::Result;
use crate::track::{DT_SECS, Rig, Shape, steps};

/// Vertical speed of a body that has settled.
const SETTLED_MPS: f32 = 0.02;

/// How far a braked vehicle slides in a minute on a slope, in millimetres.
pub(crate) fn hold_mm(id: &str, share: f32) -> Result<f32> {
    let mut rig = Rig::new(id, Shape::Slope(share), 0.05, 0.0)?;
    rig.brake()?;
    rig.run(5.0)?;
    let start_m = rig.position_m()?;
    rig.run(60.0)?;
    Ok(1_000.0 * (rig.position_m()? - start_m).norm())
}

/// What a kerb or a drop does.
#[derive(Clone, Debug)]
pub(crate) struct Jolt {
    /// Highest vertical acceleration of the body.
    pub peak_mps2: f32,
    /// Largest angle between the body's up axis and the vertical.
    pub tilt_rad: f32,
    /// When it last moved up or down noticeably.
    pub settled_secs: f32,
    /// Height of the origin over the ground at the end, in millimetres.
    pub height_mm: f32,
    /// Height over time.
    pub curve: Vec<(f32, f32)>,
}

/// Drives over a kerb of this height at right angles.
pub(crate) fn kerb(id: &str, rise_m: f32, mps: f32) -> Result<Jolt> {
    let mut rig = Rig::new(id, Shape::Kerb(rise_m), 0.0, mps)?;
    rig.control(VehicleControl { throttle: 0.3, ..VehicleControl::default() })?;
    let reach = |rig: &Rig| Ok::<_, schemas::Error>(rig.position_m()?.x > -830.0);
    let jolt = watch(&mut rig, 40.0, rise_m, reach)?;
    Ok(jolt)
}

/// Falls onto its wheels.
pub(crate) fn drop_from(id: &str, above_m: f32) -> Result<Jolt> {
    let mut rig = Rig::new(id, Shape::Level, above_m, 0.0)?;
    watch(&mut rig, 5.0, 0.0, |_| Ok(false))
}

fn watch(
    rig: &mut Rig,
    secs: f32,
    ground_m: f32,
    done: impl Fn(&Rig) -> Result<bool>,
) -> Result<Jolt> {
    let mut jolt = Jolt {
        peak_mps2: 0.0,
        tilt_rad: 0.0,
        settled_secs: 0.0,
        height_mm: 0.0,
        curve: Vec::new(),
    };
    for step in 0..steps(secs) {
        rig.step()?;
        let (state, now_secs) = (rig.state()?, step as f32 * DT_SECS);
        jolt.peak_mps2 = jolt.peak_mps2.max(state.linear_acceleration_mps2.z);
        let up = state.world_from_actor.rotation * Vector3::z();
        jolt.tilt_rad = jolt.tilt_rad.max(up.z.clamp(-1.0, 1.0).acos());
        if state.linear_velocity_mps.z.abs() > SETTLED_MPS {
            jolt.settled_secs = now_secs;
        }
        jolt.curve.push((now_secs, state.world_from_actor.translation.z));
        if done(rig)? {
            break;
        }
    }
    jolt.height_mm = 1_000.0 * (rig.position_m()?.z - ground_m);
    Ok(jolt)
}
