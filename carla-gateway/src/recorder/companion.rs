//! What a recording says of the journal beside it.

use recording::{JournalLink, Packet, WorldState};
use schemas::Frame;

/// The journal beside one recording.
pub(crate) struct Companion {
    link: JournalLink,
    is_told: bool,
}

impl Companion {
    /// One that no frame has told of yet.
    pub(crate) fn new(link: JournalLink) -> Self {
        Self { link, is_told: false }
    }

    /// What the next frame says: which state of the world it is, and the first one of this journal
    /// where that is.
    pub(super) fn packets(&mut self, frame: &Frame) -> Vec<Packet> {
        let state = WorldState { tick: frame.tick.0, state_hash: frame.state_hash };
        let link = (!std::mem::replace(&mut self.is_told, true)).then(|| self.link.packet());
        link.into_iter().chain([state.packet()]).collect()
    }
}
