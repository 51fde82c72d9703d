//! The journal beside a recording: what CARLA's format cannot say, for replays to the bit.

use std::sync::Arc;

use recording::JournalLink;
use schemas::{ErrorCode, Reply, Request, WorldId};

use super::Endpoint;
use crate::recorder::{Companion, JournalNames};
use crate::site::Site;

/// Has a world keep a journal of this name from its present state on. `None` where none can be
/// kept: the recording goes on without.
pub(super) async fn begin(site: &dyn Site, world: WorldId, name: String) -> Option<JournalLink> {
    match site.ask(Request::RecordWorld { world, on: true, name: Some(name) }).await {
        Ok(Reply::JournalBegun { name, digest, tick, state_hash }) => {
            tracing::info!(name, "a journal begins beside a recording");
            return Some(JournalLink { name, digest, tick: tick.0, state_hash });
        }
        Ok(_) => tracing::warn!("the world service answered something else"),
        Err(error) if error.code == ErrorCode::Unsupported => {
            tracing::debug!(%error, "a recording without a journal beside it");
        }
        Err(error) => tracing::warn!(%error, "a recording without a journal beside it"),
    }
    None
}

impl Endpoint {
    /// Has the world keep a journal beside the recording that has just begun.
    pub(crate) async fn begin_journal(&mut self) {
        // A world of a session may have one already.
        if self.visit.is_some() {
            return;
        }
        let (Some(names), Some(episode)) = (self.recorder.journal_names(), &self.episode) else {
            return;
        };
        let link = begin(&*self.site, episode.world, names.next()).await;
        self.note_journal(link);
    }

    /// The names of journals that go on beside a recording in other worlds.
    pub(super) fn next_journals(&self) -> Option<Arc<JournalNames>> {
        self.recorder.journal_names().filter(|_| self.has_journal)
    }

    /// Names the journal beside the recording from now on.
    pub(super) fn note_journal(&mut self, link: Option<JournalLink>) {
        self.has_journal = link.is_some();
        if let Some(link) = link {
            self.recorder.accompany(Companion::new(link));
        }
    }

    /// Ends the recording, if there is one, and the journal beside it.
    pub(crate) async fn end_recording(&mut self) {
        self.recorder.stop();
        self.end_journal().await;
    }

    /// Ends the journal beside a recording that has ended.
    pub(super) async fn end_journal(&mut self) {
        if !std::mem::take(&mut self.has_journal) {
            return;
        }
        let Some(episode) = &self.episode else { return };
        let request = Request::RecordWorld { world: episode.world, on: false, name: None };
        if let Err(error) = self.site.ask(request).await {
            tracing::debug!(%error, "the journal beside a recording ended with its world");
        }
    }
}
