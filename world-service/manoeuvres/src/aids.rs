//! What anti-lock brakes and stability control are for: braking in a turn, and on a road that is
//! slippery on one side; with both and without.

use schemas::VehicleControl;

use crate::Result;
use crate::corner::{Moment, hold, lock_rad};
use crate::straight::stop_with_friction;
use crate::switches::Aids;
use crate::track::{DT_SECS, Rig, steps, wheelbase_m};

const GRAVITY_MPS2: f32 = 9.81;
/// Turns of the steering wheel for one of the road wheels.
const STEERING_RATIO: f32 = 16.0;
/// Radius and sideways acceleration of ISO 7975.
const TURN_RADIUS_M: f32 = 100.0;
const TURN_MPS2: f32 = 5.0;
/// Speed on the split road, and its slippery side's friction, after UN R13-H, annex 6.
const SPLIT_MPS: f32 = 50.0 / 3.6;
pub(crate) const SPLIT_SHARE: f32 = 0.3;
/// Who brakes on a split road steers against it: per metre aside, radian of heading, and radian per
/// second.
const STEER_BACK: [f32; 3] = [0.06, 0.5, 0.12];
/// Slower than this a stop is over.
const STAND_MPS: f32 = 0.1;

/// Full braking out of a steady turn with the steering held, after ISO 7975.
#[derive(Clone, Copy, Debug)]
pub struct TurnStop {
    /// Yaw rate a second after the brake, over that of the circle at the speed then.
    pub yaw_share: f32,
    /// Largest angle between the velocity and the vehicle's axis, above walking speed.
    pub slip_deg: f32,
    /// Mean deceleration over gravity.
    pub braking_g: f32,
}

/// # Errors
/// The world refused or diverged.
pub fn turn_stop(id: &str, aids: Aids) -> Result<TurnStop> {
    /// The steering wheel is turned in this time, and the turn is steady after this.
    const BEGIN_SECS: f32 = 1.5;
    const STEADY_SECS: f32 = 6.0;
    const WALKING_MPS: f32 = 4.0;
    let turn_mps = (TURN_RADIUS_M * TURN_MPS2).sqrt();
    let mut rig = Rig::rolling(id, turn_mps)?;
    aids.fit(&mut rig)?;
    let lock_rad = lock_rad(&rig.report()?.physics, turn_mps);
    let base_m = wheelbase_m(&rig.report()?.physics);
    let wanted_radps = turn_mps / TURN_RADIUS_M;
    let (mut sum, mut steer) = (0.1, 0.0);
    for step in 0..steps(STEADY_SECS) {
        let begun = (step as f32 * DT_SECS / BEGIN_SECS).min(1.0);
        let moment = Moment::of(&rig, 0.0)?;
        // Until the radius is reached: the angle of a slow curve, and what is missing beyond it.
        let slow = base_m / TURN_RADIUS_M / lock_rad;
        let missing = (wanted_radps * begun - moment.yaw_radps) * 0.4 * DT_SECS;
        steer = if begun < 1.0 { slow * begun } else { (steer + missing).clamp(0.0, 1.0) };
        let throttle = hold(rig.speed_mps()?, turn_mps, &mut sum);
        rig.control(VehicleControl { throttle, steer, ..VehicleControl::default() })?;
        rig.step()?;
    }
    let (mut yaw_share, mut slip_rad, mut stop_m) = (f32::NAN, 0.0f32, 0.0);
    let begin_mps = rig.speed_mps()?;
    rig.control(VehicleControl { brake: 1.0, steer, ..VehicleControl::default() })?;
    for step in 1..=steps(20.0) {
        rig.step()?;
        let moment = Moment::of(&rig, step as f32 * DT_SECS)?;
        stop_m += moment.speed_mps * DT_SECS;
        if step == steps(1.0) {
            yaw_share = moment.yaw_radps / (moment.speed_mps / TURN_RADIUS_M);
        }
        if moment.speed_mps > WALKING_MPS {
            slip_rad = slip_rad.max(moment.slip_rad.abs());
        }
        if moment.speed_mps < STAND_MPS {
            break;
        }
    }
    let braking_g = begin_mps * begin_mps / (2.0 * stop_m.max(0.1)) / GRAVITY_MPS2;
    Ok(TurnStop { yaw_share, slip_deg: slip_rad.to_degrees(), braking_g })
}

/// Full braking on a road that is slippery under the right wheels, steered straight on.
#[derive(Clone, Copy, Debug)]
pub struct SplitStop {
    /// Mean deceleration over gravity, and what UN R13-H wants of it.
    pub braking_g: f32,
    /// 0.75 (4 k₂ + k₁) / 5 and k₂ at least.
    pub wanted_g: f32,
    /// Largest angle of the steering wheel within two seconds, and at all.
    pub first_deg: f32,
    /// See [`first_deg`](Self::first_deg).
    pub wheel_deg: f32,
    /// Farthest from the line.
    pub aside_m: f32,
    /// Largest change of course.
    pub yaw_deg: f32,
}

/// # Errors
/// The world refused or diverged.
pub fn split_stop(id: &str, aids: Aids) -> Result<SplitStop> {
    let stop_g = |stop_m: f32| SPLIT_MPS * SPLIT_MPS / (2.0 * stop_m.max(0.1)) / GRAVITY_MPS2;
    let high_g = stop_g(stop_with_friction(id, SPLIT_MPS, 1.0)?);
    let low_g = stop_g(stop_with_friction(id, SPLIT_MPS, SPLIT_SHARE)?);
    let mut rig = Rig::rolling(id, SPLIT_MPS)?;
    aids.fit(&mut rig)?;
    rig.change(|physics| {
        let right = physics.wheels.iter_mut().filter(|wheel| wheel.position_m.y < 0.0);
        right.for_each(|wheel| wheel.tyre_friction *= SPLIT_SHARE);
    })?;
    let lock_rad = lock_rad(&rig.report()?.physics, SPLIT_MPS);
    let (start_m, mut found) = (rig.position_m()?, SplitStop::new(high_g, low_g));
    let mut course_rad = 0.0f32;
    for step in 1..=steps(30.0) {
        let moment = Moment::of(&rig, 0.0)?;
        let aside_m = rig.position_m()?.y - start_m.y;
        let [per_m, per_rad, per_radps] = STEER_BACK;
        let back_rad = per_m * aside_m + per_rad * course_rad + per_radps * moment.yaw_radps;
        let steer = (-back_rad / lock_rad).clamp(-1.0, 1.0);
        rig.control(VehicleControl { brake: 1.0, steer, ..VehicleControl::default() })?;
        rig.step()?;
        course_rad += moment.yaw_radps * DT_SECS;
        let wheel_deg = (moment.wheel_rad * STEERING_RATIO).to_degrees().abs();
        found.wheel_deg = found.wheel_deg.max(wheel_deg);
        if step <= steps(2.0) {
            found.first_deg = found.wheel_deg;
        }
        found.aside_m = found.aside_m.max(aside_m.abs());
        found.yaw_deg = found.yaw_deg.max(course_rad.abs().to_degrees());
        if moment.speed_mps < STAND_MPS {
            break;
        }
    }
    found.braking_g = stop_g((rig.position_m()? - start_m).norm());
    Ok(found)
}

impl SplitStop {
    fn new(high_g: f32, low_g: f32) -> Self {
        Self {
            braking_g: 0.0,
            wanted_g: (0.75 * (4.0 * low_g + high_g) / 5.0).max(low_g),
            first_deg: 0.0,
            wheel_deg: 0.0,
            aside_m: 0.0,
            yaw_deg: 0.0,
        }
    }

    /// Whether UN R13-H, annex 6, would pass it: 120° in the first two seconds, 240° at all.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.braking_g >= self.wanted_g && self.first_deg <= 120.0 && self.wheel_deg <= 240.0
    }
}
