//! Around corners: steady circles to the limit, a step and a sine with dwell of the steering.

use std::f32::consts::TAU;

use nalgebra::Vector3;
use schemas::{VehicleControl, VehiclePhysics};

use crate::Result;
use crate::switches::Aids;
use crate::track::{DT_SECS, Rig, steps, wheelbase_m};

const GRAVITY_MPS2: f32 = 9.81;
/// Rate of the road wheels while the circle tightens, slow enough to be steady.
const RAMP_RADPS: f32 = 0.012;
/// Frequency and dwell of ISO 19365.
const SINE_HZ: f32 = 0.7;
const DWELL_SECS: f32 = 0.5;

/// One moment of a vehicle under way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub secs: f32,
    pub steer: f32,
    /// Mean angle of the steered wheels.
    pub wheel_rad: f32,
    pub yaw_radps: f32,
    /// To the left, in the level plane.
    pub sideways_mps2: f32,
    pub speed_mps: f32,
    /// Of the origin, over the starting line.
    pub beside_m: f32,
    /// Between the velocity and the body's x axis.
    pub slip_rad: f32,
}

impl Moment {
    pub(crate) fn of(rig: &Rig, secs: f32) -> Result<Self> {
        let state = rig.state()?;
        let axis = |axis: Vector3<f32>| state.world_from_actor.rotation * axis;
        let (ahead, left) = (axis(Vector3::x()), axis(Vector3::y()));
        let level_left = Vector3::new(left.x, left.y, 0.0).normalize();
        let velocity_mps = state.linear_velocity_mps;
        Ok(Self {
            secs,
            steer: state.control.steer,
            wheel_rad: state.road_wheel_rad,
            yaw_radps: state.angular_velocity_radps.z,
            sideways_mps2: state.linear_acceleration_mps2.dot(&level_left),
            speed_mps: velocity_mps.norm(),
            beside_m: state.world_from_actor.translation.y,
            slip_rad: velocity_mps.dot(&left).atan2(velocity_mps.dot(&ahead)),
        })
    }
}

/// A circle that tightens at constant speed until the vehicle gives no more.
pub(crate) struct Circle {
    pub moments: Vec<Moment>,
    pub highest_mps2: f32,
    /// Extra angle of the wheels over that of a slow curve, in degrees per g, at 0.1 to 0.4 g.
    pub understeer_deg_per_g: f32,
    pub wheelbase_m: f32,
}

/// Throttle that holds a speed.
pub(crate) fn hold(speed_mps: f32, wanted_mps: f32, sum: &mut f32) -> f32 {
    let error_mps = wanted_mps - speed_mps;
    *sum = (*sum + 0.15 * error_mps * DT_SECS).clamp(0.0, 1.0);
    (*sum + 0.4 * error_mps).clamp(0.0, 1.0)
}

/// Angle of the steered wheels at full lock and a speed.
pub(crate) fn lock_rad(physics: &VehiclePhysics, mps: f32) -> f32 {
    let steered: Vec<f32> =
        physics.wheels.iter().map(|wheel| wheel.steer_rad_max).filter(|&rad| rad > 0.0).collect();
    let mean_rad = steered.iter().sum::<f32>() / steered.len().max(1) as f32;
    let curve = &physics.steering_curve;
    let share = curve.windows(2).find_map(|pair| {
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        (mps >= from && mps <= to).then(|| a + (b - a) * (mps - from) / (to - from).max(1.0e-6))
    });
    mean_rad * share.or_else(|| curve.last().map(|last| last.1)).unwrap_or(1.0)
}

pub(crate) fn circle(mut rig: Rig, mps: f32) -> Result<Circle> {
    let physics = rig.report()?.physics;
    let rate = RAMP_RADPS / lock_rad(&physics, mps);
    let (mut moments, mut sum, mut held) = (Vec::new(), 0.0, 0.0f32);
    let mut highest_mps2 = 0.0f32;
    for step in 0..steps(40.0) {
        let secs = step as f32 * DT_SECS;
        let throttle = hold(rig.speed_mps()?, mps, &mut sum);
        let steer = (rate * secs).min(1.0);
        rig.control(VehicleControl { throttle, steer, ..VehicleControl::default() })?;
        rig.step()?;
        let moment = Moment::of(&rig, secs)?;
        // A mean over half a second: what it holds, not what it touches on the way.
        held += (moment.yaw_radps * moment.speed_mps - held) * 0.02;
        highest_mps2 = highest_mps2.max(held);
        moments.push(Moment { sideways_mps2: held, ..moment });
        let over = held < 0.93 * highest_mps2 || moment.speed_mps < 0.8 * mps;
        if highest_mps2 > 1.0 && over {
            break;
        }
    }
    let wheelbase_m = wheelbase_m(&physics);
    let points: Vec<(f32, f32)> = moments
        .iter()
        .filter(|moment| (0.1..0.4).contains(&(moment.sideways_mps2 / GRAVITY_MPS2)))
        .map(|moment| (moment.sideways_mps2 / GRAVITY_MPS2, moment.extra_deg(wheelbase_m)))
        .collect();
    Ok(Circle { moments, highest_mps2, understeer_deg_per_g: slope(&points), wheelbase_m })
}

impl Moment {
    /// Angle of the wheels beyond what a slow curve of this radius needs.
    pub(crate) fn extra_deg(&self, wheelbase_m: f32) -> f32 {
        let slow_rad = wheelbase_m * self.yaw_radps / self.speed_mps.max(1.0);
        (self.wheel_rad - slow_rad).to_degrees()
    }
}

impl Circle {
    /// The steering that held an acceleration.
    pub(crate) fn steer_at(&self, mps2: f32) -> f32 {
        let reached = self.moments.iter().find(|moment| moment.sideways_mps2 >= mps2);
        reached.or(self.moments.last()).map_or(0.0, |moment| moment.steer)
    }
}

/// Least squares.
fn slope(points: &[(f32, f32)]) -> f32 {
    let count = points.len().max(1) as f32;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0, y + point.1));
    let (x, y) = (x / count, y / count);
    let (above, below) = points.iter().fold((0.0, 0.0), |(above, below), point| {
        (above + (point.0 - x) * (point.1 - y), below + (point.0 - x) * (point.0 - x))
    });
    above / below.max(1.0e-9)
}

/// Drives for some seconds with a steering over time and the pedals left alone or holding a speed.
pub(crate) fn drive(
    mut rig: Rig,
    secs: f32,
    held_mps: Option<f32>,
    steer_at: impl Fn(f32) -> f32,
) -> Result<Vec<Moment>> {
    let (mut moments, mut sum) = (Vec::new(), 0.1);
    let line_m = rig.position_m()?.y;
    for step in 0..steps(secs) {
        let now_secs = step as f32 * DT_SECS;
        let throttle = match held_mps {
            Some(mps) => hold(rig.speed_mps()?, mps, &mut sum),
            None => 0.0,
        };
        let steer = steer_at(now_secs).clamp(-1.0, 1.0);
        rig.control(VehicleControl { throttle, steer, ..VehicleControl::default() })?;
        rig.step()?;
        let moment = Moment::of(&rig, now_secs + DT_SECS)?;
        moments.push(Moment { beside_m: moment.beside_m - line_m, ..moment });
    }
    Ok(moments)
}

/// Answer to a step of the steering after ISO 7401.
pub(crate) struct StepAnswer {
    /// From half of the wheel angle to 90 % of the steady yaw rate.
    pub rise_secs: f32,
    /// Highest yaw rate beyond the steady one, as a share of it.
    pub overshoot: f32,
    pub steady_mps2: f32,
    pub moments: Vec<Moment>,
}

pub(crate) fn step_steer(rig: Rig, mps: f32, steer: f32) -> Result<StepAnswer> {
    let from_secs = 1.0;
    let steering = |secs: f32| if secs < from_secs { 0.0 } else { steer };
    let moments = drive(rig, 6.0, Some(mps), steering)?;
    let tail = || moments.iter().filter(|moment| moment.secs > 5.0);
    let mean =
        |value: fn(&Moment) -> f32| tail().map(value).sum::<f32>() / tail().count().max(1) as f32;
    let (steady_radps, steady_rad) = (mean(|moment| moment.yaw_radps), mean(|m| m.wheel_rad));
    let first = |reached: &dyn Fn(&Moment) -> bool| {
        moments.iter().find(|moment| reached(moment)).map_or(f32::NAN, |moment| moment.secs)
    };
    let half_secs = first(&|moment| moment.wheel_rad >= 0.5 * steady_rad);
    let risen_secs = first(&|moment| moment.yaw_radps >= 0.9 * steady_radps);
    let peak = moments.iter().map(|moment| moment.yaw_radps).fold(0.0, f32::max);
    Ok(StepAnswer {
        rise_secs: risen_secs - half_secs,
        overshoot: peak / steady_radps - 1.0,
        steady_mps2: mean(|moment| moment.sideways_mps2),
        moments,
    })
}

/// Answer to a sine with dwell after ISO 19365, judged as FMVSS 126 does.
pub(crate) struct SineAnswer {
    /// Yaw rate one second after the steering ended, over the second peak.
    pub after_1_secs: f32,
    /// The same after 1.75 s.
    pub after_1_75_secs: f32,
    /// Way to the side 1.07 s after the steering began.
    pub beside_m: f32,
    pub moments: Vec<Moment>,
}

impl SineAnswer {
    pub(crate) fn is_stable(&self) -> bool {
        self.after_1_secs <= 0.35 && self.after_1_75_secs <= 0.2
    }
}

/// The steering of a sine with dwell of amplitude 1 that begins at 0.
pub(crate) fn sine_with_dwell(secs: f32) -> f32 {
    let dwell_secs = 0.75 / SINE_HZ;
    let phase_secs = if secs < dwell_secs {
        secs
    } else if secs < dwell_secs + DWELL_SECS {
        dwell_secs
    } else {
        secs - DWELL_SECS
    };
    if !(0.0..=1.0 / SINE_HZ).contains(&phase_secs) {
        return 0.0;
    }
    (TAU * SINE_HZ * phase_secs).sin()
}

pub(crate) fn sine_steer(rig: Rig, steer: f32) -> Result<SineAnswer> {
    let from_secs = 0.5;
    let moments = drive(rig, 5.0, None, |secs| steer * sine_with_dwell(secs - from_secs))?;
    let end_secs = from_secs + 1.0 / SINE_HZ + DWELL_SECS;
    let at = |secs: f32| {
        moments.iter().find(|moment| moment.secs >= secs).copied().unwrap_or(moments[0])
    };
    // The second peak: after the steering has changed its side. A vehicle that goes on turning to
    // the first side has none, and its yaw rate counts whole.
    let turned_secs = from_secs + 0.5 / SINE_HZ;
    let later = moments.iter().filter(|moment| moment.secs > turned_secs);
    let peak = later.map(|moment| moment.yaw_radps.abs()).fold(1.0e-6, f32::max);
    Ok(SineAnswer {
        after_1_secs: at(end_secs + 1.0).yaw_radps.abs() / peak,
        after_1_75_secs: at(end_secs + 1.75).yaw_radps.abs() / peak,
        beside_m: at(from_secs + 1.07).beside_m,
        moments,
    })
}

/// Sines with dwell of growing amplitude at 80 km/h, after FMVSS 126.
#[derive(Clone, Copy, Debug)]
pub struct Dwell {
    /// Largest amplitude up to which all were stable, over the steer that holds 0.3 g.
    pub stable_to: f32,
    /// Least way to the side 1.07 s after the steering began, at 5 × and more.
    pub beside_m: f32,
}

/// Amplitudes that FMVSS 126 wants: from 1.5 to 6.5 times the steer of 0.3 g.
pub(crate) const DWELL_SCALES: [f32; 11] = [1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5];

/// # Errors
/// The world refused or diverged.
pub fn dwell(id: &str, aids: Aids, mps: f32) -> Result<Dwell> {
    let limit = circle(Rig::rolling(id, mps)?, mps)?;
    let amplitude = limit.steer_at(0.3 * GRAVITY_MPS2);
    let (mut stable_to, mut beside_m, mut stable) = (0.0, f32::INFINITY, true);
    for scale in DWELL_SCALES {
        let mut rig = Rig::rolling(id, mps)?;
        aids.fit(&mut rig)?;
        let answer = sine_steer(rig, scale * amplitude)?;
        stable &= answer.is_stable();
        if stable {
            stable_to = scale;
        }
        if scale >= 5.0 {
            beside_m = beside_m.min(answer.beside_m.abs());
        }
    }
    Ok(Dwell { stable_to, beside_m })
}
