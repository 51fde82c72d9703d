//! What an export is about.

use std::collections::BTreeMap;

use schemas::ActorId;

use crate::names::Names;

/// What an export is about.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Of the program that exports.
    pub version: String,
    /// The file that is exported.
    pub source: String,
    /// The vehicle of the topics below `/ego`; `None`: the first vehicle there is.
    pub ego: Option<ActorId>,
    /// What clients call actors.
    pub roles: BTreeMap<ActorId, String>,
    /// Others of whose motion `/tf` tells; the first 32 of them.
    pub heroes: Vec<ActorId>,
    /// Whether the frames are those of the world, to the bit, and not rebuilt.
    pub is_exact: bool,
    /// From where the world goes on, if every tick and all that was done is to be in the file.
    pub origin: Option<Origin>,
    /// How topics and frames are called.
    pub names: Names,
}

/// The state of a world before the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// Its tick.
    pub tick: u64,
    /// Simulated seconds since its world began.
    pub sim_secs: f64,
    /// Of the state.
    pub state_hash: u64,
    /// The state.
    pub snapshot: Vec<u8>,
}

impl Origin {
    pub(crate) fn told(&self) -> [(&'static str, String); 3] {
        [
            ("tick", self.tick.to_string()),
            // All digits that it takes to have the same number again.
            ("sim_secs", format!("{:?}", self.sim_secs)),
            ("state_hash", format!("{:016x}", self.state_hash)),
        ]
    }

    /// From the metadata and the attachment of a file; `None` for others than
    /// [`crate::Exporter`] writes.
    pub fn of(told: &BTreeMap<String, String>, snapshot: Vec<u8>) -> Option<Self> {
        Some(Self {
            tick: told.get("tick")?.parse().ok()?,
            sim_secs: told.get("sim_secs")?.parse().ok()?,
            state_hash: u64::from_str_radix(told.get("state_hash")?, 16).ok()?,
            snapshot,
        })
    }
}
