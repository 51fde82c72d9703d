//! People who go straight from place to place, whatever comes.

use schemas::{Proximity, Vec3, WalkerControl, WalkerStage};
use serde::{Deserialize, Serialize};

/// A place counts as reached from here.
const REACHED_M: f32 = 0.1;
/// So hard people slow down before a place, in metres per second squared: less than they can.
const BRAKING_MPS2: f32 = 6.0;

/// The places that somebody goes to in turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    stages: Vec<WalkerStage>,
    /// `None`: it has begun.
    trigger: Option<Proximity>,
    /// The stage under way; their number when all are done.
    stage: usize,
    /// At the place of the stage, so far; `None` on the way there.
    waited_secs: Option<f32>,
}

impl Trajectory {
    /// At its beginning.
    ///
    /// - **Domain:** finite numbers; speeds and times that are not negative.
    #[must_use]
    pub fn new(stages: Vec<WalkerStage>, trigger: Option<Proximity>) -> Self {
        Self { stages, trigger, stage: 0, waited_secs: None }
    }

    /// Whose nearness it waits for.
    #[must_use]
    pub fn trigger(&self) -> Option<Proximity> {
        self.trigger
    }

    /// Whether all its numbers are numbers; what a snapshot may get wrong.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let stage = |stage: &WalkerStage| {
            let numbers = [stage.speed_mps, stage.wait_secs];
            stage.to_m.iter().chain(&numbers).all(|number| number.is_finite())
        };
        self.stages.iter().all(stage)
            && self.waited_secs.unwrap_or_default().is_finite()
            && self.trigger.is_none_or(|trigger| trigger.within_m.is_finite())
    }

    /// How it walks during the next tick; `vehicle_m` is the middle of whom its trigger names, if
    /// that one is there. Facing stays where it stands.
    pub fn control(
        &mut self,
        (foot_m, forward): (Vec3, Vec3),
        vehicle_m: Option<Vec3>,
        dt_secs: f32,
    ) -> WalkerControl {
        let stand = WalkerControl { direction: forward, speed_mps: 0.0, jump: false };
        if let Some(trigger) = self.trigger {
            let near = |there_m: Vec3| (there_m - foot_m).xy().norm() < trigger.within_m;
            if !vehicle_m.is_some_and(near) {
                return stand;
            }
            self.trigger = None;
        }
        while let Some(stage) = self.stages.get(self.stage) {
            let way = (stage.to_m - foot_m).xy();
            let away_m = way.norm();
            if self.waited_secs.is_none() && away_m > REACHED_M {
                let direction = Vec3::new(way.x / away_m, way.y / away_m, 0.0);
                let braked_mps = (2.0 * BRAKING_MPS2 * away_m).sqrt();
                let speed_mps = stage.speed_mps.min(braked_mps).min(away_m / dt_secs);
                return WalkerControl { direction, speed_mps, jump: false };
            }
            let waited_secs = self.waited_secs.unwrap_or_default();
            if waited_secs < stage.wait_secs {
                self.waited_secs = Some(waited_secs + dt_secs);
                return stand;
            }
            self.waited_secs = None;
            self.stage += 1;
        }
        stand
    }
}

#[cfg(test)]
mod tests {
    use schemas::ActorId;

    use super::*;

    const DT_SECS: f32 = 0.05;

    /// Where it is after each tick, in the middle of nowhere.
    fn places(trajectory: &mut Trajectory, vehicle_m: Option<Vec3>, ticks: usize) -> Vec<Vec3> {
        let mut foot_m = Vec3::zeros();
        let mut step = || {
            let control = trajectory.control((foot_m, Vec3::x()), vehicle_m, DT_SECS);
            foot_m += control.direction * control.speed_mps * DT_SECS;
            foot_m
        };
        (0..ticks).map(|_| step()).collect()
    }

    fn out_and_back() -> Vec<WalkerStage> {
        vec![
            WalkerStage { to_m: Vec3::y() * 2.0, speed_mps: 1.0, wait_secs: 1.5 },
            WalkerStage { to_m: Vec3::zeros(), speed_mps: 2.0, wait_secs: 0.0 },
        ]
    }

    #[test]
    fn it_goes_waits_and_goes_on_and_stands_at_the_end() {
        let along = places(&mut Trajectory::new(out_and_back(), None), None, 120);
        let left = |secs: f32| along[(secs / DT_SECS) as usize - 1].y;
        assert!((left(1.0) - 1.0).abs() < 0.01, "{}", left(1.0));
        assert!((left(2.2) - left(3.2)).abs() < 1.0e-6 && left(3.2) > 1.85, "it waits");
        assert!((0.8..1.2).contains(&left(4.0)), "back at 2 m/s: {}", left(4.0));
        assert!(left(6.0) < 0.11 && left(5.0) == left(6.0), "it stands: {}", left(6.0));
    }

    #[test]
    fn it_begins_when_somebody_is_near() {
        let trigger = Proximity { actor: ActorId::FIRST, within_m: 20.0 };
        let mut trajectory = Trajectory::new(out_and_back(), Some(trigger));
        for away_m in [None, Some(Vec3::x() * 20.5)] {
            assert_eq!(places(&mut trajectory, away_m, 20)[19], Vec3::zeros(), "{away_m:?}");
        }
        let near_m = Some(Vec3::new(19.5, 0.0, 3.0));
        assert!(places(&mut trajectory, near_m, 20)[19].y > 0.9);
        assert_eq!(trajectory.trigger(), None);
        assert!(places(&mut trajectory, None, 20)[19].y > 0.9, "once begun it goes on");
    }
}
