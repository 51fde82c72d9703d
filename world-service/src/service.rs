//! Worlds behind requests, as a state machine on ports: no bus, no threads, no clock.

mod gather;
mod hosted;
mod ids;
mod inbox;
mod ports;
mod recorded;
mod roster;
mod run;
mod shard;
mod shared_clock;
mod tick;

pub use gather::Gather;
pub use hosted::Hosted;
pub(crate) use hosted::guarded;
pub use ids::{Ids, Seat, Seats};
pub(crate) use inbox::JOBS_MAX;
pub use inbox::{Dispatcher, Job, WorldWork};
pub use ports::{Answer, NewJournal, NewWorld, Outlet, Question, Simulation};
pub use recorded::Recorded;
use roster::Roster;
pub use shard::{Shard, Turn};
use shared_clock::Waiter;
