//! Episodes in which an ego is to come to a place without running into anything.

use schemas::Vec3;
use serde_json::{Map, Value, json};

use super::{DoneReason, Facts, Progress, object};

/// A goal, and what came of the way to it.
#[derive(Clone, Debug, Default)]
pub(super) struct Goal {
    /// World frame; `None` before a reset.
    pub at_m: Option<Vec3>,
    reached: bool,
    collided: bool,
    reward: f64,
}

impl Goal {
    /// One to come to.
    pub(super) fn at(at_m: Vec3) -> Self {
        Self { at_m: Some(at_m), ..Self::default() }
    }

    /// Judges the world after a step: +1 for coming within `within_m` metres, -1 for running into
    /// anything, which both end the episode, as does the last step.
    pub(super) fn judge(&mut self, facts: &Facts, within_m: f64, max_steps: u32) -> Progress {
        let within = |m: f32| f64::from(m) < within_m;
        self.reached = facts.goal_distance_m.is_some_and(within);
        self.collided = facts.things_hit > 0;
        let out_of_steps = facts.step_count >= u64::from(max_steps);
        let (reward, done) = match (self.collided, self.reached) {
            (true, _) => (-1.0, Some(DoneReason::Collision)),
            (false, true) => (1.0, Some(DoneReason::GoalReached)),
            (false, false) => (0.0, out_of_steps.then_some(DoneReason::MaxSteps)),
        };
        self.reward = reward;
        Progress { reward, done, truncated: done == Some(DoneReason::MaxSteps) }
    }

    /// What came of it so far, in the scenario of this name.
    pub(super) fn outcome(&self, name: &str) -> Map<String, Value> {
        object(json!({
            "scenario": name,
            "goal_reached": self.reached,
            "collision": self.collided,
            "reward": self.reward,
        }))
    }
}
