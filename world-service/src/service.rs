//! Worlds behind requests, as a state machine on ports: no bus, no threads, no clock.

mod gather;
mod hosted;
mod ids;
mod inbox;
mod ports;
mod recorded;
mod roster;
mod shard;
mod shared_clock;
mod tick;

pub use gather::Gather;
pub use hosted::{Hosted, guarded};
pub use ids::{Ids, Seat, Seats};
pub use inbox::{Dispatcher, JOBS_MAX, Job, WorldWork};
pub use ports::{Answer, NewWorld, Outlet, Question, Simulation};
pub use recorded::Recorded;
pub use roster::Roster;
pub use shard::Shard;
pub use shared_clock::Waiter;
