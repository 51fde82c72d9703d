//! The task without traffic of "Exploring the Limitations of Behavior Cloning for Autonomous
//! Driving" (Codevilla and others, ICCV 2019), which CARLA's benchmark has as `NoCrash`.
//!
//! Its ways are those of CoRL 2017's navigation. An episode may take the time of its way at 5 km/h
//! and 20 s more; the first collision ends it, and whoever leaves its lane may come back.

use super::{Task, corl2017};
use crate::end::End;

pub(super) const EMPTY: Task = Task {
    name: "nocrash-empty",
    about: "At least three turns on the way to a goal; the first collision is the end.",
    limit_secs: |length_m| length_m / (5.0 / 3.6) + 20.0,
    ends: &[End::Arrived, End::Collision],
    ..corl2017::NAVIGATION
};
