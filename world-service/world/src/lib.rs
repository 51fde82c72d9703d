//! The simulation as a value: [`Command`](schemas::Command)s in, [`Frame`](schemas::Frame)s out. No
//! bus, clock, thread, file or global randomness.
//!
//! - [`Town`] is what all worlds of one map share: roads, ground, scenery.
//! - [`World`] is one simulation: [`apply`](World::apply), [`tick`](World::tick),
//!   [`frame`](World::frame), [`snapshot`](World::snapshot), [`restore`](World::restore),
//!   [`fork`](World::fork), [`state_hash`](World::state_hash).
//!
//! One tick: pilots and navigation agents choose controls; scenery near moving bodies enters the
//! physics; then in substeps of at most 10 ms each vehicle's wheels push it, the ground pushes what
//! has fallen, and Rapier solves the contacts between bodies; at the end the contacts become
//! collisions, in a world [with traffic](World::with_traffic) the lights take their turns, and the
//! sensors measure.
//!
//! ```
//! use std::sync::Arc;
//! use schemas::{Command, Vec3, WorldId, level_pose};
//! use world::{Town, World, WorldConfig};
//!
//! let text = roads::town::build("Town10HD_Opt").unwrap();
//! let roads = roads::Map::parse("Town10HD_Opt", &text).unwrap();
//! let start = nalgebra::convert(roads.spawn_points()[0]);
//! let map = Arc::new(Town::new(Arc::new(roads)));
//! let id = WorldId::new(1).unwrap();
//! let mut world = World::new(WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map }).unwrap();
//! let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, Vec3::zeros()));
//! assert_eq!(car.unwrap().unwrap().get(), 1);
//! world.tick().unwrap();
//! assert_eq!(world.frame().actors.len(), 1);
//! ```
//!
//! What it does not do: pictures, recordings and wall clocks belong to others.

mod actor;
mod agent;
mod attributes;
mod blueprint;
mod body;
mod bones;
mod casting;
mod check;
mod collision;
mod command;
mod convert;
mod describe;
mod driving;
mod fallen;
mod flow;
mod frame;
mod ground;
mod halt;
mod hash;
mod measuring;
mod motion;
mod overlap;
mod paint;
mod physics;
mod place;
mod push;
mod rails;
mod rays;
mod renew;
mod scenery;
mod sensor;
mod sensors;
mod snapshot;
mod spawn;
mod spring_arm;
mod step;
mod stroll;
mod time_step;
mod town;
mod traffic;
mod trigger;
mod vehicle;
mod walker;
mod wheel;
mod world;

pub use paint::texture;
pub use step::grip;
pub use town::Town;
pub use traffic::{Broken, Lights};
pub use world::{World, WorldConfig};
