//! The bus: typed requests, publications and liveliness over Zenoh. The only crate that names
//! zenoh.
//!
//! [`Bus`] is one process's place on it. A service [`serve`](Bus::serve)s keys and gets every
//! request as an [`Incoming`], which it answers from any thread; a client
//! [`request`](Bus::request)s and gets one typed reply or one typed error within its deadline.
//! What is asked often and small goes through a [`Channel`]. [`announce`](Bus::announce) and
//! [`watch`](Bus::watch) tell who is up.
//!
//! Sizes are checked and buffers verified on both sides before anything else sees them. Addresses
//! are explicit; nothing is discovered. Requests and replies may block, up to a deadline; whatever
//! fans out is dropped rather than awaited.
//!
//! Needs a multi-threaded tokio runtime.
//!
//! ```no_run
//! # async fn example() -> Result<(), Box<dyn std::error::Error>> {
//! use std::time::Duration;
//! use bus::{Bus, BusConfig};
//! use schemas::{Request, Tenant, keys};
//!
//! let bus = Bus::open(BusConfig::connecting("tcp/127.0.0.1:7460".parse()?)).await?;
//! let tenant: Tenant = "local".parse()?;
//! let maps = bus.request(&keys::worlds(&tenant), &Request::ListMaps, Duration::from_secs(1)).await?;
//! println!("{maps:?}");
//! # Ok(())
//! # }
//! ```

mod access;
mod address;
mod channel;
mod config;
mod draining;
mod error;
mod frames;
mod identity;
mod incoming;
mod loads;
mod presence;
mod publishing;
mod query;
mod renderers;
mod routers;
mod session;
mod shortcut;
mod tuning;

pub use address::{BusAddress, InvalidBusAddress, site_address};
pub use channel::Channel;
pub use config::BusConfig;
pub use draining::Draining;
pub use error::BusError;
pub use frames::{FrameListeners, FrameSubscription, PublishedFrame};
pub use identity::{Identity, IdentityArgs};
pub use incoming::{Incoming, Serving};
pub use loads::Loads;
pub use presence::{Announcement, Presence, Watch, unused_id};
pub use renderers::Renderers;
pub use session::Bus;
pub use tuning::RUNTIME;
