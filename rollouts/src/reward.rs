//! Rewards as sums of named terms.

use std::collections::BTreeMap;

use schemas::{Error, ErrorCode};
use serde::{Deserialize, Serialize};

use crate::limits::WEIGHT_MAX;

/// What a step can be rewarded for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Term {
    /// Metres along the way; backwards negative.
    Progress,
    /// Share of the way; 1 over a whole episode that arrives.
    Completion,
    /// 1 in the step that arrives.
    Arrived,
    /// 1 in a step that runs into something.
    Collision,
    /// 1 in a step that ends farther from the middle of the way than half the lane.
    OffRoute,
    /// Metres per second above the speed limit.
    Speeding,
    /// Change of the steering wheel, from 0 to 2.
    Steering,
    /// 1 in a step that runs a red light.
    RedLight,
    /// Metres from the middle of the way.
    Beside,
    /// 1 in every step.
    Step,
}

impl Term {
    /// Every one, with its name; weights are in this order.
    pub const ALL: [(Self, &str); 10] = [
        (Self::Progress, "progress"),
        (Self::Completion, "completion"),
        (Self::Arrived, "arrived"),
        (Self::Collision, "collision"),
        (Self::OffRoute, "off_route"),
        (Self::Speeding, "speeding"),
        (Self::Steering, "steering"),
        (Self::RedLight, "red_light"),
        (Self::Beside, "beside"),
        (Self::Step, "step"),
    ];
}

/// Values of all terms in one step, in the order of [`Term::ALL`].
pub(crate) type Terms = [f32; Term::ALL.len()];

/// What each term counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "the name of a reward, or numbers by name of the term")]
pub enum Reward {
    /// `default`: the task's, which is progress, arrival, and what goes wrong unless it says
    /// otherwise. `completion`: the share of the way alone.
    Named(String),
    /// Weights by name of the term; terms that are not named count nothing.
    Weights(BTreeMap<String, f32>),
}

/// Progress and arrival, less what goes wrong.
const DEFAULT: Terms = [0.05, 0.0, 1.0, -1.0, -1.0, -0.02, -0.004, -1.0, 0.0, 0.0];
/// The share of the way alone.
const COMPLETION: Terms = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

impl Reward {
    /// # Errors
    /// `InvalidArgument` for an unknown name or a weight that is none.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.weights(&Self::default()).map(|_| ())
    }

    /// Its weights in a task whose own reward is `of_task`.
    ///
    /// # Errors
    /// As for [`check`](Self::check).
    pub(crate) fn weights(&self, of_task: &Self) -> Result<Terms, Error> {
        let weights = match self {
            Self::Named(name) if name == "default" && *of_task != *self => {
                return of_task.weights(self);
            }
            Self::Named(name) => return named(name),
            Self::Weights(weights) => weights,
        };
        let mut terms = Terms::default();
        for (name, &weight) in weights {
            let at = Term::ALL.iter().position(|(_, known)| known == name);
            let Some(slot) = at.and_then(|at| terms.get_mut(at)) else {
                return Err(Error::new(ErrorCode::InvalidArgument, "there is no such term")
                    .wanted(Term::ALL.map(|(_, name)| name).join(", "))
                    .found(name));
            };
            if weight.is_nan() || weight.abs() > WEIGHT_MAX {
                return Err(Error::new(ErrorCode::InvalidArgument, "a weight is out of range")
                    .wanted(format!("at most {WEIGHT_MAX} to either side"))
                    .found(format!("{weight} for {name}")));
            }
            *slot = weight;
        }
        Ok(terms)
    }
}

impl Default for Reward {
    fn default() -> Self {
        Self::Named("default".to_owned())
    }
}

fn named(name: &str) -> Result<Terms, Error> {
    match name {
        "default" => Ok(DEFAULT),
        "completion" => Ok(COMPLETION),
        _ => Err(Error::new(ErrorCode::InvalidArgument, "there is no such reward")
            .wanted("default, completion, or weights by term")
            .found(name)),
    }
}

/// The reward of one step.
pub(crate) fn sum(terms: &Terms, weights: &Terms) -> f32 {
    terms.iter().zip(weights).map(|(term, weight)| term * weight).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_are_named_and_unknown_names_are_refused() {
        let given: Reward = serde_json::from_str(r#"{"progress": 2, "collision": -3}"#).unwrap();
        let own = Reward::default();
        let wanted = [2.0, 0.0, 0.0, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(given.weights(&own).unwrap(), wanted);
        assert_eq!(own.weights(&given).unwrap(), wanted, "the task's");
        assert_eq!(own.weights(&own).unwrap(), DEFAULT);
        let named: Reward = serde_json::from_str(r#""completion""#).unwrap();
        assert_eq!(named.weights(&own).unwrap(), COMPLETION);
        let unknown: Reward = serde_json::from_str(r#"{"speed": 2}"#).unwrap();
        let error = unknown.check().unwrap_err().to_string();
        assert!(error.contains("progress, completion") && error.contains("speed"), "{error}");
        assert!(Reward::Named("fame".to_owned()).check().is_err());
        assert!(Reward::Weights([("arrived".to_owned(), f32::NAN)].into()).check().is_err());
        assert_eq!(sum(&[1.0; 10], &wanted), -1.0);
    }
}
