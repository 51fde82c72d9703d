//! How one process of a site is: whether its loops turn, whether it takes work, whether it drains,
//! and its figures. Nothing here opens a socket or a file: the crate `admin` serves it.
//!
//! A service gets a [`Monitor`] and tells it what it does; whoever watches over the service asks.
//!
//! ```
//! use std::time::{Duration, Instant};
//! use monitoring::Monitor;
//!
//! let monitor = Monitor::new("world", "0.1.0", Duration::ZERO);
//! let bus = monitor.condition("bus", "the bus is not joined yet");
//! let ticks = monitor.metrics().histogram("causeway_world_tick_seconds", "Time of a tick");
//! let shard = monitor.pulse("shard-0");
//! assert_eq!(monitor.why_not_ready().as_deref(), Some("bus: the bus is not joined yet"));
//! bus.meet();
//! monitor.set_started();
//! {
//!     let _turn = shard.begin(Instant::now());
//!     ticks.observe(Duration::from_micros(80));
//! }
//! assert_eq!((monitor.why_not_live(), monitor.why_not_ready()), (None, None));
//! assert!(monitor.metrics().text().contains("causeway_world_tick_seconds_count 1"));
//! ```

mod by_name;
mod drain;
mod histogram;
mod metrics;
mod monitor;
mod pulse;

pub use by_name::SecondsByName;
pub use drain::Drain;
pub use histogram::Histogram;
pub use metrics::{Counter, Gauge, Metrics};
pub use monitor::{Condition, Monitor};
pub use pulse::{Busy, Pulse, STUCK_AFTER};
