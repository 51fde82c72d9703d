//! The worlds that endpoints of a tenant use, and those that nobody does.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use schemas::{Camera, Error, Image, Reply, Request, ServiceId, SharedFrame, Staging, WorldId};
use tokio::sync::watch;
use worlds::{Strays, until_sweep};

use crate::site::{Later, PATIENCE, Site};

/// A site that knows which worlds were made for who asks through it, and has the others freed.
pub(crate) struct CollectingSite {
    site: Arc<dyn Site>,
    /// Who makes worlds.
    owner: ServiceId,
    strays: Mutex<Strays>,
}

impl CollectingSite {
    /// No worlds yet; those that nobody uses are freed for ever.
    pub(crate) fn start(site: Arc<dyn Site>, owner: ServiceId) -> Arc<Self> {
        let collecting = Arc::new(Self::new(site, owner));
        let sweeping = Arc::clone(&collecting);
        tokio::spawn(async move {
            let mut changes = sweeping.changes();
            loop {
                until_sweep(&mut changes).await;
                sweeping.sweep(Instant::now()).await;
            }
        });
        collecting
    }

    fn new(site: Arc<dyn Site>, owner: ServiceId) -> Self {
        Self { site, owner, strays: Mutex::new(Strays::new(PATIENCE)) }
    }

    /// Frees worlds that nobody uses, of those that there are now.
    async fn sweep(&self, now: Instant) {
        let Ok(Reply::Worlds(worlds)) = self.site.ask(Request::ListWorlds).await else { return };
        let own = worlds.into_iter().filter(|info| info.owner.as_ref() == Some(&self.owner));
        let own: Vec<WorldId> = own.map(|info| info.world).collect();
        let abandoned = self.lock().abandoned(&own, now);
        for world in abandoned {
            tracing::info!(%world, "a world that nobody uses is freed");
            if let Err(error) = self.site.ask(Request::DestroyWorld { world }).await {
                tracing::debug!(%world, %error, "a world could not be destroyed");
            }
        }
    }

    async fn make(&self, request: Request) -> Result<Reply, Error> {
        let reply = self.site.ask(request).await?;
        match &reply {
            Reply::WorldCreated { world, .. } => self.lock().note_used(*world),
            Reply::Forked(worlds) => {
                let mut strays = self.lock();
                worlds.iter().for_each(|world| strays.note_used(*world));
            }
            _ => {}
        }
        Ok(reply)
    }

    fn lock(&self) -> MutexGuard<'_, Strays> {
        // Nothing panics while it holds the lock.
        self.strays.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Site for CollectingSite {
    fn ask(&self, request: Request) -> Later<'_, Reply> {
        use Request::{BranchJournal, CreateWorld, DestroyWorld, ForkWorld, RestoreWorld};
        match request {
            CreateWorld { .. } | RestoreWorld { .. } | BranchJournal { .. } | ForkWorld { .. } => {
                return Box::pin(self.make(request));
            }
            // Whoever asks for this uses it no more, whatever comes of it.
            DestroyWorld { world } => self.lock().note_left(world),
            _ => {}
        }
        self.site.ask(request)
    }

    fn draw(
        &self,
        frame: SharedFrame,
        cameras: Vec<Camera>,
        staging: Staging,
    ) -> Later<'_, Vec<Image>> {
        self.site.draw(frame, cameras, staging)
    }

    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>> {
        self.site.map_text(digest)
    }

    fn can_draw(&self) -> bool {
        self.site.can_draw()
    }

    fn should_move(&self, world: WorldId) -> bool {
        self.site.should_move(world)
    }

    fn is_gone(&self, world: WorldId) -> bool {
        self.site.is_gone(world)
    }

    fn changes(&self) -> watch::Receiver<u64> {
        self.site.changes()
    }
}

#[cfg(test)]
mod tests;
