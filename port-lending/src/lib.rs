//! One TCP port, two programs of one machine: its holder lets another process have it for a while.
//!
//! The OpenEnv protocol and the Traffic Manager of CARLA's client both have port 8000 by default.
//! Who holds a port offers it with [`Offer`], on a Unix socket whose name tells the port; whoever
//! knows of a process that is about to listen there asks with [`ask_for`]. Both must run as the
//! same user, which the kernel tells. [`Peer`] finds the process behind a TCP connection, so that
//! nothing is lent because of words alone.

mod lending;
mod peer;

pub use lending::{Offer, Wish, ask_for};
pub use peer::{Peer, listens};
