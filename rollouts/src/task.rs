//! Tasks as data: which ways they have, how long they may take, and how they begin.
//!
//! A task is one value; to add one, write it in a file beside the others and name it in [`TASKS`].

mod bends;
mod corl2017;
mod lane_keep;
mod nocrash;

use schemas::{Error, ErrorCode};

use crate::end::End;
pub(crate) use bends::Bends;

/// All tasks.
pub const TASKS: [&Task; 5] = [
    &lane_keep::LANE_KEEP,
    &corl2017::STRAIGHT,
    &corl2017::ONE_TURN,
    &corl2017::NAVIGATION,
    &nocrash::EMPTY,
];

/// What is to be driven.
#[derive(Debug)]
pub struct Task {
    /// How a spec names it.
    pub name: &'static str,
    /// One sentence for people.
    pub about: &'static str,
    /// Shortest and longest way in metres: in Town01, and in other towns.
    pub lengths_m: [(f32, f32); 2],
    /// Whether a way is one of the task's.
    pub(crate) fits: fn(&Bends) -> bool,
    /// Seconds that a way of some length, in metres, may take.
    pub(crate) limit_secs: fn(f32) -> f32,
    /// How an episode begins.
    pub(crate) beginning: Beginning,
    /// What ends an episode before its time is up, unless a spec says otherwise.
    pub ends: &'static [End],
}

/// How far a start is from one at rest in the middle of its lane, at most.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beginning {
    /// Slowest and fastest.
    pub speed_mps: (f32, f32),
    /// To either side.
    pub beside_m: f32,
    /// To either side.
    pub turned_rad: f32,
}

impl Task {
    /// # Errors
    /// `InvalidArgument` with the names that there are.
    pub(crate) fn named(name: &str) -> Result<&'static Self, Error> {
        TASKS.into_iter().find(|task| task.name == name).ok_or_else(|| {
            let names: Vec<&str> = TASKS.iter().map(|task| task.name).collect();
            Error::new(ErrorCode::InvalidArgument, "there is no such task")
                .wanted(names.join(", "))
                .found(name)
        })
    }

    /// Shortest and longest way in a town, in metres.
    pub(crate) fn bounds_m(&self, town: &str) -> (f32, f32) {
        let [large, small] = self.lengths_m;
        if town.contains("Town01") { large } else { small }
    }
}
