//! What a batch of worlds is made of.

use schemas::{Error, ErrorCode};
use serde::{Deserialize, Serialize};

use crate::end::End;
use crate::limits;
use crate::observe::Observation;
use crate::reward::Reward;

/// How exactly vehicles move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TierKind {
    /// Rigid bodies, tyres, drivetrain.
    #[default]
    Physics,
    /// Cars that roll without slip, and boxes; many times as fast.
    Kinematic,
}

/// When a world whose episode is over begins the next one; Gymnasium's three modes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Autoreset {
    /// In the step after, whose action counts nothing.
    #[default]
    NextStep,
    /// In the same step: the last observation is in `final_obs`.
    SameStep,
    /// Not by itself: a step of such a world is refused.
    Disabled,
}

/// All that decides a batch of worlds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spec {
    /// Name of one of the [`TASKS`](crate::TASKS), or of another that comes beside the spec.
    pub task: String,
    /// Name of a map.
    pub town: String,
    /// How exactly vehicles move.
    pub tier: TierKind,
    /// How many worlds.
    pub worlds: usize,
    /// Agents of each world.
    pub agents: usize,
    /// World `i` begins with seed `seed + i`.
    pub seed: u64,
    /// What a row of observations holds.
    pub observation: Observation,
    /// Whether columns are multiplied by their scales.
    pub normalise: bool,
    /// What a step is rewarded for.
    pub reward: Reward,
    /// What ends an episode before its time is up; `None`: the task's.
    pub ends: Option<Vec<End>>,
    /// When the next episode begins.
    pub autoreset: Autoreset,
    /// Ticks of 50 ms for which one action holds.
    pub decision_ticks: u32,
    /// Seconds after which an episode is cut off; `None`: the task's, by the length of the way.
    pub horizon_secs: Option<f32>,
    /// Pairs of a start and a goal to draw from, at most.
    pub pairs: usize,
    /// Cars of the world's own traffic; `None`: the task's.
    pub cars: Option<usize>,
    /// People on foot; `None`: the task's.
    pub walkers: Option<usize>,
    /// Whether the town's traffic lights take their turns; `None`: as the task says.
    pub lights: Option<bool>,
    /// Weathers of which each start has one: `training` and `test` are the task's, other names are
    /// those of CARLA's presets.
    pub weathers: Vec<String>,
    /// Steps between two hashes of a world's state; 0: at the ends of episodes alone.
    pub hash_every: u32,
}

impl Default for Spec {
    fn default() -> Self {
        Self {
            task: "lane-keep".to_owned(),
            town: "Town01".to_owned(),
            tier: TierKind::Physics,
            worlds: 1,
            agents: 1,
            seed: 0,
            observation: Observation::Route,
            normalise: true,
            reward: Reward::default(),
            ends: None,
            autoreset: Autoreset::NextStep,
            decision_ticks: 2,
            horizon_secs: None,
            pairs: limits::PAIRS_MAX,
            cars: None,
            walkers: None,
            lights: None,
            weathers: vec!["training".to_owned()],
            hash_every: 0,
        }
    }
}

impl Spec {
    /// Agents of all worlds: rows of every array.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.worlds * self.agents
    }

    /// Length of a step in seconds.
    #[must_use]
    pub fn step_secs(&self) -> f64 {
        f64::from(self.decision_ticks) * limits::TICK_SECS
    }

    /// Columns of a row of observations.
    #[must_use]
    pub fn width(&self) -> usize {
        self.observation.width()
    }

    /// # Errors
    /// `InvalidArgument` with the first value that cannot be.
    pub fn check(&self) -> Result<(), Error> {
        self.reward.check()?;
        within("worlds", self.worlds, limits::WORLDS_MAX)?;
        within("agents", self.agents, limits::AGENTS_PER_WORLD_MAX)?;
        within("worlds times agents", self.rows(), limits::ROWS_MAX)?;
        within("pairs", self.pairs, limits::PAIRS_MAX)?;
        within("the number of weathers", self.weathers.len(), limits::WEATHERS_MAX)?;
        within(
            "decision_ticks",
            self.decision_ticks as usize,
            limits::DECISION_TICKS_MAX as usize,
        )?;
        for (what, count) in [("cars", self.cars), ("walkers", self.walkers)] {
            if count.is_some_and(|count| count > limits::OTHERS_MAX) {
                return Err(Error::new(
                    ErrorCode::InvalidArgument,
                    format!("{what} is out of range"),
                )
                .wanted(format!("0 to {}", limits::OTHERS_MAX))
                .found(count.unwrap_or_default()));
            }
        }
        let longest = limits::HORIZON_SECS_MAX;
        match self.horizon_secs {
            Some(secs) if !(secs > 0.0 && secs <= longest) => {
                Err(Error::new(ErrorCode::InvalidArgument, "horizon_secs is out of range")
                    .wanted(format!("above 0, at most {longest}"))
                    .found(secs))
            }
            _ => Ok(()),
        }
    }
}

fn within(what: &str, found: usize, most: usize) -> Result<(), Error> {
    if (1..=most).contains(&found) {
        return Ok(());
    }
    Err(Error::new(ErrorCode::InvalidArgument, format!("{what} is out of range"))
        .wanted(format!("1 to {most}"))
        .found(found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_refused_with_its_name_and_range() {
        let spec = Spec::default();
        spec.check().unwrap();
        for (bad, words) in [
            (Spec { worlds: 0, ..spec.clone() }, "worlds"),
            (Spec { agents: 257, ..spec.clone() }, "1 to 256"),
            (Spec { worlds: 16_384, agents: 5, ..spec.clone() }, "worlds times agents"),
            (Spec { cars: Some(513), ..spec.clone() }, "0 to 512"),
            (Spec { weathers: Vec::new(), ..spec.clone() }, "number of weathers is out of range"),
            (Spec { horizon_secs: Some(f32::NAN), ..spec.clone() }, "horizon_secs"),
            (Spec { decision_ticks: 0, ..spec.clone() }, "decision_ticks"),
        ] {
            let error = bad.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_spec_is_json_with_every_value_optional() {
        let spec: Spec =
            serde_json::from_str(r#"{"worlds": 3, "autoreset": "same_step"}"#).unwrap();
        assert_eq!((spec.worlds, spec.autoreset), (3, Autoreset::SameStep));
        let error = serde_json::from_str::<Spec>(r#"{"world": 3}"#).unwrap_err().to_string();
        assert!(error.contains("`world`") && error.contains("`worlds`"), "{error}");
    }
}
