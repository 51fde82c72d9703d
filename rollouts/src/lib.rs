//! Driving tasks over many worlds at once, for whoever trains or evaluates a driver: actions in,
//! observations, rewards and ends out, all in arrays that the caller owns. No I/O, no threads, no
//! clock.
//!
//! - [`Spec`] says what is wanted: task, town, worlds, agents, observation, reward, ends.
//! - [`Course`] is a town prepared for a task, shared by all worlds: starts and routes.
//! - [`Shard`] is some of the worlds: [`reset`](Shard::reset), [`step`](Shard::step) and
//!   [`snapshot`](Shard::snapshot) write and read [`Rows`]. Shards know nothing of each other, so
//!   that each may have a thread of its own.
//!
//! An observation, a reward and an end are functions of the state before, the action, and the state
//! after; none reaches back into a world. Equal specs, seeds and actions give equal bytes, however
//! the worlds are dealt out to shards.
//!
//! ```
//! use std::sync::Arc;
//! use rollouts::{Buffers, Course, Shard, Spec};
//!
//! let spec = Spec { worlds: 2, ..Spec::default() };
//! let text = roads::town::build(&spec.town).unwrap();
//! let map = Arc::new(roads::Map::parse(&spec.town, &text).unwrap());
//! let course = Arc::new(Course::new(&spec, map).unwrap());
//! let mut shard = Shard::new(&spec, &course, 0..2).unwrap();
//! let mut buffers = Buffers::new(&spec);
//! shard.reset(None, &mut buffers.rows()).unwrap();
//! shard.step(&[0.0, 0.5, 0.1, 0.5], &mut buffers.rows()).unwrap();
//! assert_eq!(buffers.observations.len(), 2 * spec.observation.columns().len());
//! ```
//!
//! **Frames:** right-handed, x forward or east, y left or north; metres, radians, seconds.

mod action;
mod agent;
mod course;
mod end;
mod env;
mod episode;
mod kinematic;
pub mod limits;
mod line;
mod motion;
mod observe;
mod physics;
mod reward;
mod route;
mod rows;
mod scene;
mod shard;
mod spec;
mod task;
mod tier;

pub use action::Action;
pub use course::Course;
pub use end::End;
pub use episode::EPISODE_COLUMNS;
pub use observe::{Block, Column, Observation};
pub use reward::{Reward, Term};
pub use rows::{Buffers, Rows};
pub use shard::{Reset, Shard, Snapshot};
pub use spec::{Autoreset, Spec, TierKind};
pub use task::{TASKS, Task};
