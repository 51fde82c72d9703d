//! The journal beside a recording: what CARLA's format cannot say, for replays to the bit.

use recording::JournalLink;
use schemas::{ErrorCode, Reply, Request};

use super::Endpoint;
use crate::recorder::Companion;

impl Endpoint {
    /// Has the world keep a journal beside the recording that has just begun. Where none can be
    /// kept the recording goes on without.
    pub(crate) async fn begin_journal(&mut self) {
        let (Some(name), Some(episode)) = (self.recorder.companion_name(), &self.episode) else {
            return;
        };
        let request = Request::RecordWorld { world: episode.world, on: true, name: Some(name) };
        match self.site.ask(request).await {
            Ok(Reply::JournalBegun { name, digest, tick, state_hash }) => {
                tracing::info!(name, "a journal begins beside a recording");
                let link = JournalLink { name, digest, tick: tick.0, state_hash };
                self.recorder.accompany(Companion::new(link));
                self.has_journal = true;
            }
            Ok(_) => tracing::warn!("the world service answered something else"),
            Err(error) if error.code == ErrorCode::Unsupported => {
                tracing::debug!(%error, "a recording without a journal beside it");
            }
            Err(error) => tracing::warn!(%error, "a recording without a journal beside it"),
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
