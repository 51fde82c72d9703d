//! Actors whose motion became impossible.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{ActorId, Tick};

/// An actor that was put to rest at its last possible pose because its motion became impossible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Halt {
    /// In which tick.
    pub tick: Tick,
    /// Who.
    pub actor: ActorId,
    /// Why.
    pub reason: HaltReason,
}

/// What was impossible about an actor's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum HaltReason {
    /// A value was no longer a number.
    NotFinite,
    /// Faster than any actor can be.
    TooFast,
    /// Outside of the coordinates of a world.
    TooFar,
}

impl fmt::Display for HaltReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "its motion was no longer a number",
            Self::TooFast => "it was faster than anything can be",
            Self::TooFar => "it left the coordinates of the world",
        })
    }
}
