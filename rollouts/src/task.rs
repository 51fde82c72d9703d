//! Tasks as data: which ways they have, how long they may take, how they begin, who else is there,
//! and what counts.
//!
//! A task is a file of TOML: those of [`TASKS`] lie in `tasks/`, and others are read with
//! [`Task::parse`]. All lengths are in metres, angles of ways in degrees.

mod bends;
mod by_town;
mod goal;
mod others;
mod weathers;

use schemas::{Error, ErrorCode};
use serde::Deserialize;

use crate::end::End;
use crate::limits::{self, HORIZON_SECS_MAX};
use crate::reward::Reward;
pub(crate) use bends::{Bends, Turns};
use by_town::ByTown;
pub(crate) use goal::GoalRule;
pub(crate) use others::{End as WayEnd, Others, Standing};
pub(crate) use weathers::{Sky, Weathers};

/// All tasks that need no file: name and text.
pub const TASKS: [(&str, &str); 13] = [
    ("lane-keep", include_str!("../tasks/lane-keep.toml")),
    ("corl17-straight", include_str!("../tasks/corl17-straight.toml")),
    ("corl17-one-turn", include_str!("../tasks/corl17-one-turn.toml")),
    ("corl17-navigation", include_str!("../tasks/corl17-navigation.toml")),
    ("corl17-traffic", include_str!("../tasks/corl17-traffic.toml")),
    ("nocrash-empty", include_str!("../tasks/nocrash-empty.toml")),
    ("nocrash-regular", include_str!("../tasks/nocrash-regular.toml")),
    ("nocrash-dense", include_str!("../tasks/nocrash-dense.toml")),
    ("unprotected-left", include_str!("../tasks/unprotected-left.toml")),
    ("overtake", include_str!("../tasks/overtake.toml")),
    ("merge", include_str!("../tasks/merge.toml")),
    ("roundabout", include_str!("../tasks/roundabout.toml")),
    ("parking", include_str!("../tasks/parking.toml")),
];

/// What is to be driven.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// How a spec names it.
    #[serde(skip)]
    pub name: String,
    /// One sentence for people.
    pub about: String,
    pub(crate) way: WayRule,
    pub(crate) time: TimeRule,
    pub(crate) start: Beginning,
    #[serde(default)]
    pub(crate) goal: GoalRule,
    #[serde(default)]
    pub(crate) others: Others,
    #[serde(default)]
    pub(crate) weathers: Weathers,
    /// What ends an episode before its time is up, unless a spec says otherwise.
    #[serde(default = "all_ends")]
    pub ends: Vec<End>,
    /// What a spec's reward `default` is.
    #[serde(default)]
    pub(crate) reward: Reward,
}

/// Which ways are the task's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WayRule {
    /// Shortest and longest.
    pub length_m: ByTown<(f32, f32)>,
    /// How often it turns in junctions.
    #[serde(default)]
    pub turns: Vec<Turns>,
    /// Sum of all turns between junctions to either side: at least this.
    pub between_degrees_min: Option<f32>,
    /// And less than this.
    pub between_degrees_max: Option<f32>,
    /// Sum of all turns, also of those in junctions: less than this.
    pub bends_degrees_max: Option<f32>,
    /// Whether it has to lead around a roundabout.
    #[serde(default)]
    pub roundabout: bool,
    /// Least and most speed limit where it begins, and where it ends.
    pub start_limit_kmh: Option<(f32, f32)>,
    pub goal_limit_kmh: Option<(f32, f32)>,
    /// The lane in which it ends.
    #[serde(default)]
    pub into: Onto,
}

/// A lane in which a way ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Onto {
    #[default]
    Driving,
    /// One for parked cars, to the right of the lane that the way comes along.
    Parking,
}

/// How long an episode may take: the time of its way at a speed, and some more.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TimeRule {
    pub mean_kmh: f32,
    pub more_secs: f32,
}

/// How far a start is from one at rest in the middle of its lane, at most.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Beginning {
    /// Slowest and fastest.
    pub speed_mps: (f32, f32),
    /// To either side.
    pub beside_m: f32,
    /// To either side.
    pub turned_rad: f32,
}

fn all_ends() -> Vec<End> {
    vec![End::Arrived, End::Collision, End::OffRoute, End::Overturned]
}

impl Task {
    /// One of the [`TASKS`].
    ///
    /// # Errors
    /// `InvalidArgument` with the names that there are.
    pub fn named(name: &str) -> Result<Self, Error> {
        let Some((_, text)) = TASKS.into_iter().find(|(known, _)| *known == name) else {
            return Err(Error::new(ErrorCode::InvalidArgument, "there is no such task")
                .wanted(TASKS.map(|(name, _)| name).join(", "))
                .found(name));
        };
        Self::parse(name, text)
    }

    /// Reads a task.
    ///
    /// # Errors
    /// `InvalidArgument` with the line that cannot be read, or the value that cannot be.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let unreadable = |why: String| {
            Error::new(ErrorCode::InvalidArgument, format!("the task {name} cannot be read: {why}"))
        };
        if text.len() > limits::TASK_BYTES_MAX {
            return Err(unreadable("it is too large".to_owned())
                .wanted(format!("at most {} bytes", limits::TASK_BYTES_MAX))
                .found(text.len()));
        }
        let read: Self = toml::from_str(text).map_err(|error| unreadable(error.to_string()))?;
        let task = Self { name: name.to_owned(), ..read };
        task.check()
            .map_err(|error| Error { message: unreadable(error.message).message, ..error })?;
        Ok(task)
    }

    fn check(&self) -> Result<(), Error> {
        for (shortest_m, longest_m) in self.way.length_m.values() {
            ordered("way.length_m", (*shortest_m, *longest_m), 5.0, limits::WAY_M_MAX)?;
        }
        if self.way.turns.len() > limits::TURNS_MAX {
            return Err(impossible("way.turns has too many entries")
                .wanted(limits::TURNS_MAX)
                .found(self.way.turns.len()));
        }
        for (what, limits_kmh) in [
            ("way.start_limit_kmh", self.way.start_limit_kmh),
            ("way.goal_limit_kmh", self.way.goal_limit_kmh),
        ] {
            ordered(what, limits_kmh.unwrap_or_default(), 0.0, 500.0)?;
        }
        for turns in &self.way.turns {
            let (from, to) = turns.degrees;
            ordered("degrees of way.turns", (from, to), 0.0, 360.0)?;
            let (least, most) = turns.count;
            if least > most {
                return Err(impossible("count of way.turns is out of order")
                    .wanted("the least, then the most")
                    .found(format!("{least}, {most}")));
            }
        }
        within("time.mean_kmh", self.time.mean_kmh, 0.1, 500.0)?;
        within("time.more_secs", self.time.more_secs, 0.0, HORIZON_SECS_MAX)?;
        ordered("start.speed_mps", self.start.speed_mps, 0.0, 60.0)?;
        within("start.beside_m", self.start.beside_m, 0.0, 2.0)?;
        within("start.turned_rad", self.start.turned_rad, 0.0, 1.0)?;
        self.goal.check()?;
        self.others.check()?;
        self.weathers.check()?;
        self.reward.check()
    }

    /// Seconds that a way of some length may take.
    pub(crate) fn limit_secs(&self, length_m: f32) -> f32 {
        length_m / (self.time.mean_kmh / 3.6) + self.time.more_secs
    }
}

impl WayRule {
    /// Whether a way that turns so is one of the task's.
    pub(crate) fn fits(&self, bends: &Bends) -> bool {
        let below = |sum_rad: f32, most: Option<f32>| {
            most.is_none_or(|degrees| sum_rad < degrees.to_radians())
        };
        self.turns.iter().all(|turns| turns.hold(bends))
            && below(bends.elsewhere_rad, self.between_degrees_max)
            && self.between_degrees_min.is_none_or(|it| bends.elsewhere_rad >= it.to_radians())
            && below(bends.sum_rad(), self.bends_degrees_max)
    }

    /// Whether a way that begins and ends under such speed limits, 0 for none, is one of the
    /// task's.
    pub(crate) fn fits_limits(&self, start_mps: f32, goal_mps: f32) -> bool {
        let fits = |range: Option<(f32, f32)>, limit_mps: f32| {
            // Limits are whole numbers of kilometres per hour.
            let limit_kmh = (limit_mps * 3.6).round();
            range.is_none_or(|(least, most)| (least..=most).contains(&limit_kmh))
        };
        fits(self.start_limit_kmh, start_mps) && fits(self.goal_limit_kmh, goal_mps)
    }
}

fn impossible(what: &str) -> Error {
    Error::new(ErrorCode::InvalidArgument, what)
}

fn within(what: &str, found: f32, least: f32, most: f32) -> Result<(), Error> {
    if (least..=most).contains(&found) {
        return Ok(());
    }
    Err(impossible(&format!("{what} is out of range"))
        .wanted(format!("{least} to {most}"))
        .found(found))
}

fn ordered(what: &str, (low, high): (f32, f32), least: f32, most: f32) -> Result<(), Error> {
    within(what, low, least, most)?;
    within(what, high, least, most)?;
    if low <= high {
        return Ok(());
    }
    Err(impossible(&format!("{what} is out of order"))
        .wanted("the least, then the most")
        .found(format!("{low}, {high}")))
}

#[cfg(test)]
mod tests;
