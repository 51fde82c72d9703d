//! Worlds that sessions use, and those that nobody does.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemas::WorldId;

use super::WorldPort;

/// Knows the worlds that sessions use, and has the others freed.
pub(crate) struct Keeper {
    port: Arc<dyn WorldPort>,
    worlds: Mutex<Worlds>,
}

#[derive(Default)]
struct Worlds {
    used: BTreeSet<WorldId>,
    /// Owned by this service and used by nobody when they were last listed.
    strays: BTreeSet<WorldId>,
}

/// A world that is destroyed when its owner lets go of it, however that happens.
pub(crate) struct OwnedWorld {
    keeper: Arc<Keeper>,
    world: WorldId,
}

impl Keeper {
    /// No worlds yet.
    pub(crate) fn new(port: Arc<dyn WorldPort>) -> Arc<Self> {
        Arc::new(Self { port, worlds: Mutex::default() })
    }

    /// Takes charge of a world. What comes of it must be dropped inside a tokio runtime.
    pub(crate) fn keep(self: &Arc<Self>, world: WorldId) -> OwnedWorld {
        self.lock().used.insert(world);
        OwnedWorld { keeper: Arc::clone(self), world }
    }

    /// Frees worlds that nobody has used since the last time: the answer that told of them, or the
    /// question that was to free them, was lost. More time than the port's deadlines has to pass
    /// between two calls, so that no world is meant whose answer is still on its way.
    pub(crate) async fn sweep(&self) {
        let Ok(owned) = self.port.owned().await else { return };
        let abandoned: Vec<WorldId> = {
            let mut worlds = self.lock();
            let unused = owned.into_iter().filter(|world| !worlds.used.contains(world));
            let strays: BTreeSet<WorldId> = unused.collect();
            let before = std::mem::replace(&mut worlds.strays, strays);
            worlds.strays.intersection(&before).copied().collect()
        };
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

    fn lock(&self) -> MutexGuard<'_, Worlds> {
        // Nothing panics while it holds the lock.
        self.worlds.lock().unwrap_or_else(PoisonError::into_inner)
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
        let (keeper, world) = (Arc::clone(&self.keeper), self.world);
        keeper.lock().used.remove(&world);
        // Without a runtime the process is ending, and the worlds end with its lease.
        let Ok(runtime) = tokio::runtime::Handle::try_current() else { return };
        runtime.spawn(async move { keeper.free(world).await });
    }
}
