//! A client loads a world while Traffic Managers run in it.
//!
//! The client library begins its Traffic Managers anew, on the new map, when a snapshot of another
//! episode reaches it. But with the answer to its load it throws its own episode away for a moment,
//! and a Traffic Manager that looks for the newest snapshot then ends the process; in asynchronous
//! mode they look all the time. So the order is: all clients get the first snapshot of the new
//! episode; the Traffic Managers change over, at the end of which they read the settings; these
//! reads wait; the load is answered; the client gets to know its new episode and reads the settings
//! itself, and with it all go on.

use std::time::Duration;

use tokio::time::Instant;

use super::gate::Gate;
use crate::rpc::{Answer, ConnectionId, Meta, Request, Ticket};

/// How long Traffic Managers may take; they make their own picture of the map.
pub(super) const PATIENCE: Duration = Duration::from_secs(8);
/// From the first sign that they have: the thread that receives snapshots ends the process if its
/// stream is closed while it is still about this one.
pub(super) const SETTLING: Duration = Duration::from_millis(150);
/// How long the client may take from the answer to its own read of the settings.
pub(super) const RETURN_PATIENCE: Duration = Duration::from_secs(2);
/// The folder whose files a Traffic Manager asks for when it has the map.
const TRAFFIC_FOLDER: &str = "TM";

/// Whether a client changes over, and how far it is.
#[derive(Debug, Default)]
pub(super) enum Phase {
    /// None does.
    #[default]
    Settled,
    /// Its Traffic Managers begin anew; its load is answered when they have.
    Loading(Change, Box<(Ticket, Answer)>),
    /// It has the answer, and gets to know its new episode.
    Returning(Change),
}

/// One client that changes over.
#[derive(Debug)]
pub(super) struct Change {
    client: ConnectionId,
    /// Traffic Managers that have not got the map yet.
    without_map: usize,
    /// Where its reads of the settings pass, or wait.
    gate: Gate,
    /// When to go on without whom it waits for.
    until: Instant,
}

/// What the end of a phase gives.
#[derive(Debug, Default)]
pub(super) struct Released {
    /// The answer to the load.
    pub(super) load: Option<(Ticket, Answer)>,
    /// Reads of the settings that waited.
    pub(super) reads: Vec<Ticket>,
}

impl Phase {
    /// A load is done: its answer waits until the Traffic Managers of its client have changed over.
    pub(super) fn begin(load: (Ticket, Answer), without_map: usize, now: Instant) -> Self {
        let client = load.0.client;
        let until = now + PATIENCE;
        Self::Loading(Change { client, without_map, gate: Gate::Open, until }, Box::new(load))
    }

    /// Who changes over.
    pub(super) fn client(&self) -> Option<ConnectionId> {
        self.change().map(|change| change.client)
    }

    /// Whether a client still waits for the answer to its load.
    pub(super) fn is_loading(&self) -> bool {
        matches!(self, Self::Loading(..))
    }

    /// When to go on without whom it waits for.
    pub(super) fn due(&self) -> Option<Instant> {
        self.change().map(|change| change.until)
    }

    /// A call of a client begins: whether its Traffic Managers may be silent for a while.
    pub(super) fn note_call(&mut self, client: ConnectionId, request: &Request) -> bool {
        let Some(change) = self.change_of(client) else { return false };
        match request.method.as_str() {
            "get_required_files" if asks_for_traffic(request) => {
                change.without_map = change.without_map.saturating_sub(1);
                if change.without_map == 0 {
                    change.gate.shut();
                }
                true
            }
            "get_episode_info" => {
                change.gate.unlock();
                false
            }
            _ => false,
        }
    }

    /// A client reads the settings: gives the reads that are to be answered now.
    pub(super) fn note_read(&mut self, read: Ticket, now: Instant) -> Vec<Ticket> {
        let is_loading = self.is_loading();
        let Some(change) = self.change_of(read.client) else { return vec![read] };
        let passing = change.gate.pass(read);
        let is_waited_at = change.gate.is_waited_at();
        if is_loading && is_waited_at {
            change.until = change.until.min(now + SETTLING);
        } else if !is_loading && !is_waited_at {
            *self = Self::Settled;
        }
        passing
    }

    /// Goes on to the next phase, without whom this one waits for.
    pub(super) fn end(&mut self, now: Instant) -> Released {
        match std::mem::take(self) {
            Self::Settled => Released::default(),
            Self::Loading(mut change, load) => {
                change.gate.shut();
                change.until = now + RETURN_PATIENCE;
                *self = Self::Returning(change);
                Released { load: Some(*load), reads: Vec::new() }
            }
            Self::Returning(mut change) => Released { load: None, reads: change.gate.open() },
        }
    }

    /// A client is gone.
    pub(super) fn forget(&mut self, client: ConnectionId) {
        if self.client() == Some(client) {
            *self = Self::Settled;
        }
    }

    /// How many reads and loads wait.
    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        let reads = self.change().map_or(0, |change| change.gate.len());
        reads + usize::from(self.is_loading())
    }

    fn change(&self) -> Option<&Change> {
        match self {
            Self::Settled => None,
            Self::Loading(change, _) | Self::Returning(change) => Some(change),
        }
    }

    fn change_of(&mut self, client: ConnectionId) -> Option<&mut Change> {
        match self {
            Self::Loading(change, _) | Self::Returning(change) if change.client == client => {
                Some(change)
            }
            _ => None,
        }
    }
}

fn asks_for_traffic(request: &Request) -> bool {
    request.args::<(Meta, String)>().is_ok_and(|(_, folder)| folder == TRAFFIC_FOLDER)
}
