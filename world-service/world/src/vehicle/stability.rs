//! Electronic stability control: single wheels are braked until the vehicle turns as it is steered.
//!
//! The yaw rate that the steering asks for is that of the single-track model in steady cornering,
//! within the grip of the road and as late as a car answers. Who turns faster, or slides sideways,
//! is braked at the outer front wheel; who turns slower at the inner rear one.
//!
//! **Source:** van Zanten, "Bosch ESP Systems: 5 Years of Experience", SAE 2000-01-1633; Rajamani,
//! *Vehicle Dynamics and Control*, 2nd ed., chapter 8.

use nalgebra::RealField;
use serde::{Deserialize, Serialize};

use super::fit::{Fit, GRAVITY_MPS2, WheelFit};
use super::suspension::Footings;
use super::{Chassis, Footing};

/// Slower than this it does nothing.
const SPEED_MPS_MIN: f32 = 5.0;
/// How late a car turns after its wheels.
const ANSWER_SECS: f32 = 0.12;
/// Share of the grip that the wanted yaw rate may need.
const GRIP_SHARE: f32 = 0.88;
/// Differences of the yaw rate that it leaves alone: of a vehicle that turns too fast, and of one
/// that turns too slowly.
const OVER_RADPS: f32 = 0.05;
const UNDER_RADPS: f32 = 0.12;
/// Slip angle of the body that it leaves alone, and what counts of one beyond it as yaw rate.
const SLIP_RAD: f32 = 0.07;
const SLIP_PER_SEC: f32 = 2.5;
/// Time in which the brakes are to end a difference.
const END_SECS: f32 = 0.12;
/// Yaw moment that builds up in a second, over weight times half the track.
const BUILD_UP_PER_SEC: f32 = 6.0;
/// Greatest moment, over the same.
const MOMENT_SHARE_MAX: f32 = 0.6;

/// What it remembers between substeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Stability {
    /// The yaw rate that the steering asks for.
    wanted_radps: f32,
    /// Yaw moment that the brakes are to give, positive to the left.
    moment_nm: f32,
    /// Whether it is against the present turn.
    against: bool,
}

/// What it does to the brakes of one wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Share {
    /// Force along the ground to brake with in addition.
    pub more_n: f32,
    /// By how much less than the road bears the brake is to be.
    pub less_n: f32,
}

impl Stability {
    pub(super) fn values(&self) -> [f32; 3] {
        [self.wanted_radps, self.moment_nm, f32::from(u8::from(self.against))]
    }

    /// Whether it brakes.
    pub(super) fn acts(&self) -> bool {
        self.moment_nm != 0.0
    }

    /// After `dt_secs` with the steered wheels at a mean angle.
    pub(super) fn advanced(
        self,
        fit: &Fit,
        chassis: &Chassis,
        footings: &Footings,
        (road_wheel_rad, grip): (f32, f32),
        dt_secs: f32,
    ) -> Self {
        if !fit.physics.stability_control || fit.wheels.len() < 4 {
            return Self::default();
        }
        let along_mps = chassis.forward().dot(&chassis.linear_mps);
        let left_mps = chassis.left().dot(&chassis.linear_mps);
        let yaw_radps = chassis.up().dot(&chassis.angular_radps);
        let square = along_mps * along_mps;
        let base_m = (fit.wheelbase_m + fit.understeer_rad_per_mps2 * square).max(0.1);
        let friction = friction(fit, footings) * grip;
        let limit_radps = GRIP_SHARE * friction * GRAVITY_MPS2 / along_mps.max(SPEED_MPS_MIN);
        let steady_radps = (along_mps * road_wheel_rad / base_m).clamp(-limit_radps, limit_radps);
        let share = (dt_secs / ANSWER_SECS).min(1.0);
        let wanted_radps = self.wanted_radps + (steady_radps - self.wanted_radps) * share;
        let slip_rad = RealField::atan2(left_mps, along_mps.max(SPEED_MPS_MIN));
        let slides_rad = slip_rad - slip_rad.clamp(-SLIP_RAD, SLIP_RAD);
        let off_radps = yaw_radps - wanted_radps - SLIP_PER_SEC * slides_rad;
        let over = off_radps * yaw_radps > 0.0;
        let least_radps = if over { OVER_RADPS } else { UNDER_RADPS };
        let beyond_radps = off_radps - off_radps.clamp(-least_radps, least_radps);
        let [_, _, yaw_kgm2] = fit.inertia_kgm2();
        let unit_nm = fit.physics.mass_kg * GRAVITY_MPS2 * fit.half_track_m;
        let most_nm = MOMENT_SHARE_MAX * friction * unit_nm;
        let goal_nm = if along_mps < SPEED_MPS_MIN || footings.iter().all(Option::is_none) {
            0.0
        } else {
            (-yaw_kgm2 * beyond_radps / END_SECS).clamp(-most_nm, most_nm)
        };
        let step_nm = BUILD_UP_PER_SEC * unit_nm * dt_secs;
        // Brakes are let go at once.
        let from_nm = if goal_nm * self.moment_nm < 0.0 { 0.0 } else { self.moment_nm };
        let moment_nm = if goal_nm.abs() < from_nm.abs() {
            goal_nm
        } else {
            from_nm + (goal_nm - from_nm).clamp(-step_nm, step_nm)
        };
        Self { wanted_radps, moment_nm, against: over }
    }

    /// What it does to one wheel's brake. Wheels of the same corner, as those of several rear
    /// axles, bear it together.
    pub(super) fn share(&self, fit: &Fit, wheel: &WheelFit) -> Share {
        if self.moment_nm == 0.0 || wheel.foot_m.y == 0.0 {
            return Share::default();
        }
        let together = fit.wheels.iter().filter(|other| {
            other.is_front == wheel.is_front && other.foot_m.y * wheel.foot_m.y > 0.0
        });
        let force_n = (self.moment_nm / wheel.foot_m.y).abs() / together.count().max(1) as f32;
        let turns_to = self.moment_nm * wheel.foot_m.y > 0.0;
        let front = wheel.is_front == self.against;
        match (turns_to, front) {
            (true, true) => Share { more_n: force_n, less_n: 0.0 },
            // Where the driver brakes as hard as the road bears, the other side is let go.
            (false, _) if wheel.is_front => Share { more_n: 0.0, less_n: force_n },
            _ => Share::default(),
        }
    }
}

/// Mean friction of the tyres on what they stand on.
fn friction(fit: &Fit, footings: &Footings) -> f32 {
    let met = fit.wheels.iter().zip(footings).filter_map(|(wheel, footing)| {
        footing.map(|at: Footing| wheel.physics.tyre_friction * at.surface.friction)
    });
    let (sum, count) = met.fold((0.0, 0.0), |(sum, count), friction| (sum + friction, count + 1.0));
    if count > 0.0 { sum / count } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::Tuning;
    use super::*;

    #[test]
    fn the_brakes_of_one_corner_give_the_moment_together_on_however_many_axles() {
        for (id, rear_wheels) in
            [("vehicle.lincoln.mkz", 2), ("vehicle.carlamotors.european_hgv", 4)]
        {
            let index = crate::blueprint::index_of(id).unwrap();
            let tuning = Tuning::standard(index).unwrap();
            let fit = tuning.fit();
            let rear = fit.wheels.iter().filter(|wheel| !wheel.is_front);
            assert_eq!(rear.count(), rear_wheels, "{id}");
            for (moment_nm, against) in [(5_000.0, true), (5_000.0, false), (-5_000.0, false)] {
                let stability = Stability { wanted_radps: 0.0, moment_nm, against };
                let given_nm: f32 = fit
                    .wheels
                    .iter()
                    .map(|wheel| stability.share(fit, wheel).more_n * wheel.foot_m.y)
                    .sum();
                assert!((given_nm / moment_nm - 1.0).abs() < 1.0e-4, "{id}: {given_nm} N m");
            }
        }
    }
}
