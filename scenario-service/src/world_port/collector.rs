//! Worlds that sessions use, and those that nobody does.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use schemas::WorldId;
use worlds::Strays;

use super::WorldPort;
use super::on_bus::PATIENCE;

/// Knows the worlds that sessions use, and has the others freed.
pub(crate) struct WorldCollector {
    port: Arc<dyn WorldPort>,
    strays: Mutex<Strays>,
}

/// A world that is destroyed when its owner lets go of it, however that happens.
pub(crate) struct OwnedWorld {
    collector: Arc<WorldCollector>,
    world: WorldId,
}

impl WorldCollector {
    /// No worlds yet.
    pub(crate) fn new(port: Arc<dyn WorldPort>) -> Arc<Self> {
        Arc::new(Self { port, strays: Mutex::new(Strays::new(PATIENCE)) })
    }

    /// Takes charge of a world. What comes of it must be dropped inside a tokio runtime.
    pub(crate) fn keep(self: &Arc<Self>, world: WorldId) -> OwnedWorld {
        self.lock().note_used(world);
        OwnedWorld { collector: Arc::clone(self), world }
    }

    /// Frees worlds that nobody uses, of those that there are now.
    pub(crate) async fn sweep(&self, now: Instant) {
        let Ok(owned) = self.port.owned().await else { return };
        let abandoned = self.lock().abandoned(&owned, now);
        for world in abandoned {
            tracing::info!(%world, "a world that nobody uses is freed");
            self.free(world).await;
        }
    }

    async fn free(&self, world: WorldId) {
        if let Err(error) = self.port.destroy(world).await {
            tracing::debug!(%world, %error, "a world could not be destroyed");
        }
    }

    fn lock(&self) -> MutexGuard<'_, Strays> {
        // Nothing panics while it holds the lock.
        self.strays.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl OwnedWorld {
    /// Which world.
    pub(crate) fn id(&self) -> WorldId {
        self.world
    }
}

impl Drop for OwnedWorld {
    fn drop(&mut self) {
        let (collector, world) = (Arc::clone(&self.collector), self.world);
        collector.lock().note_left(world);
        // Without a runtime the process is ending, and the worlds end with its lease.
        let Ok(runtime) = tokio::runtime::Handle::try_current() else { return };
        runtime.spawn(async move { collector.free(world).await });
    }
}
