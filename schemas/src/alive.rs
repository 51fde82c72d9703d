//! What a running service says of itself.

use crate::ServiceId;

/// The kinds of service on a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ServiceKind {
    /// Owns worlds.
    World,
    /// Draws.
    Render,
    /// Runs episodes.
    Scenario,
    /// Speaks CARLA's protocol.
    Gateway,
}

impl ServiceKind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::World, Self::Render, Self::Scenario, Self::Gateway];

    /// The word in keys and on the command line.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::World => "world",
            Self::Render => "render",
            Self::Scenario => "scenario",
            Self::Gateway => "gateway",
        }
    }

    /// The inverse of [`as_str`](Self::as_str).
    pub fn parse(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.as_str() == text)
    }
}

/// What a running service says of itself; answered on its liveliness key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alive {
    /// What it is.
    pub kind: ServiceKind,
    /// Which one.
    pub id: ServiceId,
    /// Of the program.
    pub version: String,
    /// Of the process.
    pub pid: u32,
    /// How many sessions, worlds or jobs it takes at once.
    pub capacity: u32,
    /// The renderer's adapter, the face's address.
    pub detail: String,
    /// That of a world service in the ids of its worlds; 0: it has none, or does not tell.
    pub number: u32,
}

/// How much a world service has to do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Worlds that there are or are about to be.
    pub worlds: u32,
    /// Worlds at once.
    pub worlds_max: u32,
    /// Share of the last seconds that the threads of worlds were ticking, 0 to 1.
    pub busy: f32,
}
