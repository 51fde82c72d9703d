//! What a recording says of the journal beside it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use recording::{JournalLink, Packet, WorldState};
use schemas::Frame;

use super::RecordingFolder;

/// The names of the journals beside one recording: no two are alike.
pub(crate) struct JournalNames {
    recordings: RecordingFolder,
    path: PathBuf,
    given: AtomicU32,
}

impl JournalNames {
    pub(super) fn new(recordings: RecordingFolder, path: PathBuf) -> Self {
        Self { recordings, path, given: AtomicU32::new(0) }
    }

    /// That of one more journal, which nobody else was given.
    pub(crate) fn next(&self) -> String {
        let number = 1 + self.given.fetch_add(1, Ordering::Relaxed);
        self.recordings.companion_of(&self.path, number)
    }
}

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
