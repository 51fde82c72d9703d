//! CARLA's Ackermann controller: a target speed and wheel angle become pedals and steer.
//!
//! Two loops in series, each in velocity form as in CARLA: the speed loop moves the wanted
//! acceleration, the acceleration loop moves the pedal. The gains hold for 20 steps per second.

use schemas::{AckermannControl, AckermannGains, VehicleControl};
use serde::{Deserialize, Serialize};

use super::Fit;
use crate::hash::Hasher;

/// CARLA's own gains.
const GAINS: AckermannGains = AckermannGains {
    speed_kp: 0.15,
    speed_ki: 0.0,
    speed_kd: 0.25,
    acceleration_kp: 0.01,
    acceleration_ki: 0.0,
    acceleration_kd: 0.01,
};
/// Length of the step for which gains are told.
const STEP_SECS: f32 = 0.05;
/// What a vehicle is asked for when the client sets no limit.
const ACCELERATION_MPS2_MAX: f32 = 3.0;
const DECELERATION_MPS2_MAX: f32 = 8.0;
/// Target and speed below which the vehicle is held with the brake; below this speed it may change
/// the direction of its gear.
const STANDSTILL_MPS: f32 = 0.1;
/// Share of the pedal's travel about zero in which the vehicle rolls without either pedal.
const COAST_SHARE: f32 = 0.02;
/// Acceleration over the error of speed that comes to the target in about a second.
const SETTLE_PER_SEC: f32 = 2.0;
/// Bound of an integral, in the unit of its error times seconds.
const INTEGRAL_MAX: f32 = 10.0;

/// The controller of one vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ackermann {
    pub gains: AckermannGains,
    speed: Loop,
    acceleration: Loop,
    wanted_mps2: f32,
    /// Throttle above zero, brake below.
    pedal: f32,
    steer_rad: f32,
    last_mps: f32,
    /// Whether its gear is the reverse one.
    reverse: bool,
}

/// Memory of one loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Loop {
    integral: f32,
    last_error: f32,
}

impl Default for Ackermann {
    fn default() -> Self {
        Self {
            gains: GAINS,
            speed: Loop::default(),
            acceleration: Loop::default(),
            wanted_mps2: 0.0,
            pedal: 0.0,
            steer_rad: 0.0,
            last_mps: 0.0,
            reverse: false,
        }
    }
}

impl Ackermann {
    /// With its gains, at the start of driving to a target.
    pub(crate) fn begun(&self, speed_mps: f32, road_wheel_rad: f32) -> Self {
        let reverse = speed_mps < -STANDSTILL_MPS;
        Self { steer_rad: road_wheel_rad, last_mps: speed_mps, reverse, ..self.afresh() }
    }

    /// With its gains and without a past.
    pub(crate) fn afresh(&self) -> Self {
        Self { gains: self.gains, ..Self::default() }
    }

    /// Numbers that decide how it goes on.
    pub(crate) fn values(&self) -> [f32; 7] {
        [
            self.wanted_mps2,
            self.pedal,
            self.steer_rad,
            self.last_mps,
            self.speed.integral,
            self.acceleration.integral,
            f32::from(u8::from(self.reverse)),
        ]
    }

    pub(crate) fn hash(&self, target: Option<AckermannControl>, hasher: &mut Hasher) {
        let Self { gains, speed, acceleration, wanted_mps2, pedal, steer_rad, last_mps, reverse } =
            self;
        hasher.value(&(gains, target, speed, acceleration));
        hasher.value(&(wanted_mps2, pedal, steer_rad, last_mps, reverse));
    }

    /// The control for the next `dt_secs` on the way to a target.
    pub(crate) fn control(
        &mut self,
        target: &AckermannControl,
        fit: &Fit,
        speed_mps: f32,
        dt_secs: f32,
    ) -> VehicleControl {
        let acceleration_mps2 = (speed_mps - self.last_mps) / dt_secs;
        self.last_mps = speed_mps;
        self.turn(target, dt_secs);
        let lock_rad = fit.full_lock_rad(speed_mps.abs()).max(1.0e-3);
        let control = VehicleControl {
            steer: (self.steer_rad / lock_rad).clamp(-1.0, 1.0),
            ..VehicleControl::default()
        };
        if target.speed_mps.abs() < STANDSTILL_MPS && speed_mps.abs() < STANDSTILL_MPS {
            (self.wanted_mps2, self.pedal) = (0.0, 0.0);
            return VehicleControl { brake: 1.0, ..control };
        }
        if speed_mps.abs() < STANDSTILL_MPS {
            self.face(target.speed_mps < 0.0);
        }
        let reverse = self.reverse;
        let sign = if reverse { -1.0 } else { 1.0 };
        // Whoever is to go the other way stops first, as with CARLA.
        let goal_mps = (sign * target.speed_mps).max(0.0);
        self.press(target, goal_mps, [sign * speed_mps, sign * acceleration_mps2], dt_secs);
        let (throttle, brake) = if self.pedal > COAST_SHARE {
            (self.pedal, 0.0)
        } else {
            (0.0, (-COAST_SHARE - self.pedal).max(0.0) / (1.0 - COAST_SHARE))
        };
        VehicleControl { throttle, brake, reverse, ..control }
    }

    /// Changes the direction of its gear; what slowed one way speeds up the other.
    fn face(&mut self, reverse: bool) {
        if self.reverse != reverse {
            self.reverse = reverse;
            self.wanted_mps2 = -self.wanted_mps2;
            self.pedal = -self.pedal;
            self.speed.mirror();
            self.acceleration.mirror();
        }
    }

    fn turn(&mut self, target: &AckermannControl, dt_secs: f32) {
        let change_rad = target.steer_rad - self.steer_rad;
        let step_rad = target.steer_radps.abs() * dt_secs;
        self.steer_rad +=
            if step_rad > 0.0 { change_rad.clamp(-step_rad, step_rad) } else { change_rad };
    }

    /// Both loops; the goal, and how it moves, are counted along the direction of the gear.
    fn press(
        &mut self,
        target: &AckermannControl,
        goal_mps: f32,
        [along_mps, along_mps2]: [f32; 2],
        dt_secs: f32,
    ) {
        let gains = self.gains;
        let limit_mps2 = target.acceleration_mps2.abs();
        let (highest, lowest) = if limit_mps2 > 0.0 {
            (limit_mps2.min(ACCELERATION_MPS2_MAX), limit_mps2.min(DECELERATION_MPS2_MAX))
        } else {
            (ACCELERATION_MPS2_MAX, DECELERATION_MPS2_MAX)
        };
        let speed_error = goal_mps - along_mps;
        let change =
            self.speed.step(speed_error, (gains.speed_kp, gains.speed_ki, gains.speed_kd), dt_secs);
        // Beyond what is left to gain, a wanted acceleration is only overshoot.
        let enough_mps2 = SETTLE_PER_SEC * speed_error.abs();
        let wanted_mps2 = (self.wanted_mps2 + change).clamp(-enough_mps2, enough_mps2);
        let jerk = target.jerk_mps3.abs() * dt_secs;
        let wanted_mps2 = wanted_mps2.clamp(-lowest, highest);
        self.wanted_mps2 = if jerk > 0.0 {
            wanted_mps2.clamp(self.wanted_mps2 - jerk, self.wanted_mps2 + jerk)
        } else {
            wanted_mps2
        };
        let change = self.acceleration.step(
            self.wanted_mps2 - along_mps2,
            (gains.acceleration_kp, gains.acceleration_ki, gains.acceleration_kd),
            dt_secs,
        );
        self.pedal = (self.pedal + change).clamp(-1.0, 1.0);
    }
}

impl Loop {
    fn mirror(&mut self) {
        *self = Self { integral: -self.integral, last_error: -self.last_error };
    }

    fn step(&mut self, error: f32, (kp, ki, kd): (f32, f32, f32), dt_secs: f32) -> f32 {
        self.integral = (self.integral + error * dt_secs).clamp(-INTEGRAL_MAX, INTEGRAL_MAX);
        let slope = (error - self.last_error) / dt_secs * STEP_SECS;
        self.last_error = error;
        (kp * error + ki * self.integral + kd * slope) * dt_secs / STEP_SECS
    }
}
