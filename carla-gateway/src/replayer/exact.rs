//! What a journal beside a recording gives a replay: the recorded world itself.

use recording::{JournalLink, Packet, WorldState};

use super::Replay;
use crate::endpoint::Endpoint;

/// The journals of a recording, and which state of it is shown.
pub(super) struct Exact {
    links: Vec<JournalLink>,
    state: Option<WorldState>,
}

impl Exact {
    /// `None` without any.
    pub(super) fn of(links: &[JournalLink]) -> Option<Self> {
        (!links.is_empty()).then(|| Self { links: links.to_vec(), state: None })
    }

    /// Notes which state frames show that are reached.
    pub(super) fn note(&mut self, said: &[Packet]) {
        self.state = WorldState::last(said).or(self.state);
    }
}

impl Endpoint {
    /// Goes on where a replay is, under the control of clients: in the recorded world, with its
    /// velocities, drivers and everything. Says whether that is so.
    pub(super) async fn take_over(&mut self, replay: &Replay) -> bool {
        let Some(Exact { links, state: Some(state) }) = &replay.exact else { return false };
        let Some(link) = JournalLink::that_has(links, state.tick) else { return false };
        // A client that replays around a hero of its own keeps it.
        if self.replayer.options.ignores_hero {
            return false;
        }
        let (journal, tick) = (&link.name, state.tick);
        match self.branch(link, *state).await {
            Ok(()) => {
                tracing::info!(journal, tick, "the world is the recorded one");
                true
            }
            Err(why) => {
                tracing::info!(journal, tick, %why, "the recorded world cannot go on");
                false
            }
        }
    }
}
