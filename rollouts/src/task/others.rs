//! Who is in a task's worlds beside the agents.

use schemas::Error;
use serde::Deserialize;

use super::by_town::ByTown;
use super::{impossible, ordered, within};
use crate::limits::{OTHERS_MAX, STANDING_MAX};

/// Who is there beside the agents.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Others {
    #[serde(default)]
    pub cars: ByTown<usize>,
    #[serde(default)]
    pub walkers: ByTown<usize>,
    /// Whether the town's traffic lights take their turns.
    #[serde(default)]
    pub lights: bool,
    /// Cars begin no farther than this from an agent; `None`: anywhere.
    pub within_m: Option<f32>,
    /// Cars that nobody drives, for each agent.
    #[serde(default)]
    pub standing: Vec<Standing>,
}

/// A car that stands beside an agent's way or on it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Standing {
    pub from: End,
    /// Nearest and farthest along the way, from box centre to box centre; negative: behind.
    pub ahead_m: (f32, f32),
    /// Left of the way.
    #[serde(default)]
    pub left_m: f32,
}

/// An end of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum End {
    Start,
    Goal,
}

impl Others {
    pub(super) fn check(&self) -> Result<(), Error> {
        let counts = self.cars.values().map(|count| ("others.cars", *count));
        let counts = counts.chain(self.walkers.values().map(|it| ("others.walkers", *it)));
        for (what, count) in counts {
            within(what, count as f32, 0.0, OTHERS_MAX as f32)?;
        }
        within("others.within_m", self.within_m.unwrap_or(100.0), 20.0, 100_000.0)?;
        if self.standing.len() > STANDING_MAX {
            return Err(impossible("others.standing has too many entries")
                .wanted(STANDING_MAX)
                .found(self.standing.len()));
        }
        for standing in &self.standing {
            let (near_m, far_m) = standing.ahead_m;
            ordered("ahead_m of others.standing", (near_m, far_m), -1_000.0, 1_000.0)?;
            within("left_m of others.standing", standing.left_m, -50.0, 50.0)?;
        }
        Ok(())
    }
}
