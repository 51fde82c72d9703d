//! rollout-service: batches of worlds for a program on the same machine, without a bus.
//!
//! A client opens one batch over a Unix socket and gets three descriptors: a block of memory with
//! all arrays, and two events. From then on a step is: write actions, ring `go`, wait for `ready`;
//! nothing is encoded or copied. The socket carries what is rare (resets, snapshots, questions) and
//! tells each side when the other one is gone.
//!
//! - `block` is where each array lies, and `memory` the block itself: the one place with unsafe
//!   code.
//! - A `station` steps some of the worlds; a `crew` is several of them, each with a thread.
//! - A `session` is one client's conversation, in the words of `message`.
//!
//! What a world, a task and a reward are is in the crate [`rollouts`].

mod args;
mod block;
mod crew;
mod folders;
mod kept;
mod limits;
mod listener;
mod memory;
mod message;
mod session;
mod station;
mod waiting;

pub use args::Args;
pub use listener::{RunError, run};
