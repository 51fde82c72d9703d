//! Our dynamics on the parameters of a published model, for other programs to repeat.
//!
//! The parameters are those of the BMW 320i of CommonRoad's vehicle models (Althoff and Würsching,
//! "CommonRoad: Vehicle Models", 2020): mass, axles, height of the centre of mass, tracks, wheels
//! and stiffness of the tyres. The body is that of a saloon whose length gives its moment of yaw to
//! 1 %; springs and the shape of the tyres' curve remain ours.

use serde_json::{Value, json};

use crate::Result;
use crate::corner::{Moment, drive, lock_rad, sine_with_dwell};
use crate::track::{DT_SECS, Rig, axles_x_m};

const BODY: &str = "vehicle.lincoln.mkz_2017";
const MASS_KG: f32 = 1_093.3;
const FRONT_M: f32 = 1.1562;
const REAR_M: f32 = 1.4227;
const CENTRE_HEIGHT_M: f32 = 0.5749;
const TRACKS_M: (f32, f32) = (1.3868, 1.364);
const WHEEL_RADIUS_M: f32 = 0.344;
/// Cornering stiffness over load, per radian.
const STIFFNESS_PER_RAD: f32 = 21.92;
/// Highest friction sideways; ours is 0.92 of that along the wheel.
const FRICTION: f32 = 1.0489;
const LATERAL_SHARE: f32 = 0.92;

fn rig(mps: f32) -> Result<Rig> {
    let mut rig = Rig::rolling(BODY, mps)?;
    rig.change(|physics| {
        let (front_m, rear_m) = axles_x_m(physics);
        let middle_m = f32::midpoint(front_m, rear_m);
        physics.mass_kg = MASS_KG;
        physics.drag_coefficient = 0.0;
        physics.stability_control = false;
        physics.centre_of_mass_m.x = middle_m + f32::midpoint(FRONT_M, REAR_M) - FRONT_M;
        physics.centre_of_mass_m.z = CENTRE_HEIGHT_M;
        let centre_m = physics.centre_of_mass_m.x;
        for wheel in &mut physics.wheels {
            let front = wheel.position_m.x > middle_m;
            let track_m = if front { TRACKS_M.0 } else { TRACKS_M.1 };
            wheel.position_m.x = if front { centre_m + FRONT_M } else { centre_m - REAR_M };
            wheel.position_m.y = 0.5 * track_m * wheel.position_m.y.signum();
            wheel.position_m.z = WHEEL_RADIUS_M;
            wheel.radius_m = WHEEL_RADIUS_M;
            wheel.lateral_stiffness = STIFFNESS_PER_RAD;
            wheel.tyre_friction = FRICTION / LATERAL_SHARE;
        }
    })?;
    rig.run(2.0)?;
    rig.set_speed(mps)?;
    Ok(rig)
}

/// Every manoeuvre with its steering, its speed and what came of it.
pub(crate) fn runs() -> Result<Value> {
    let mps = 80.0 / 3.6;
    let mut runs = Vec::new();
    for (name, wheel_deg) in [("step to 1°", 1.0f32), ("step to 2°", 2.0), ("step to 4°", 4.0)] {
        let rig = rig(mps)?;
        let steer = wheel_deg.to_radians() / lock_rad(&rig.report()?.physics, mps);
        let steering = |secs: f32| if secs < 0.5 { 0.0 } else { steer };
        runs.push(run(name, &drive(rig, 4.0, Some(mps), steering)?));
    }
    for (name, wheel_deg) in [("sine with dwell, 2°", 2.0f32), ("sine with dwell, 4°", 4.0)] {
        let rig = rig(mps)?;
        let steer = wheel_deg.to_radians() / lock_rad(&rig.report()?.physics, mps);
        runs.push(run(name, &drive(rig, 4.0, None, |secs| steer * sine_with_dwell(secs - 0.5))?));
    }
    let rig = rig(mps)?;
    let rate = 0.5f32.to_radians() / lock_rad(&rig.report()?.physics, mps);
    runs.push(run("slow ramp, 0.5°/s", &drive(rig, 12.0, Some(mps), |secs| rate * secs)?));
    Ok(json!({ "dt_secs": DT_SECS, "speed_mps": mps, "runs": runs }))
}

fn run(name: &str, moments: &[Moment]) -> Value {
    let column = |value: fn(&Moment) -> f32| -> Vec<f32> { moments.iter().map(value).collect() };
    json!({
        "name": name,
        "wheel_rad": column(|moment| moment.wheel_rad),
        "speed_mps": column(|moment| moment.speed_mps),
        "yaw_radps": column(|moment| moment.yaw_radps),
        "sideways_mps2": column(|moment| moment.sideways_mps2),
        "slip_rad": column(|moment| moment.slip_rad),
    })
}
