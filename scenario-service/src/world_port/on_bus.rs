//! The world port over the bus.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Bus, Host, Renderers, follow_hosts};
use schemas::{ActorId, Camera, Error, ErrorCode, Image, Lease, MapRef, RenderJob, Reply};
use schemas::{
    Request, ServiceId, ServiceKind, SharedFrame, Tenant, Tick, TickItem, TickResult, WorldId, keys,
};
use tokio::sync::watch;

use super::{Answer, CreatedWorld, DT_SECS, NewWorld, WorldPort};
use crate::limits::{TICK_DEADLINE, WORLD_DEADLINE, WORLD_LEASE_MILLIS, WORLD_SERVICE_WAIT};

/// Pause before a question is put again to a service that has only just come up.
const RETRY_PAUSE: Duration = Duration::from_millis(5);

/// Worlds of one tenant on the bus.
pub(crate) struct BusWorlds {
    host: watch::Receiver<Option<Host>>,
    renderers: Arc<Renderers>,
    tenant: Tenant,
    owner: ServiceId,
}

impl BusWorlds {
    /// Follows the world services and renderers of a bus that may still be connecting.
    pub(crate) fn start(
        bus: watch::Receiver<Option<Bus>>,
        tenant: Tenant,
        owner: ServiceId,
    ) -> Self {
        let renderers = Renderers::follow(bus.clone());
        let host = follow_hosts(bus, ServiceKind::World, keys::batch_tick);
        Self { host, renderers, tenant, owner }
    }

    /// The world service, waiting for one that is still starting or restarting.
    async fn host(&self) -> Result<Host, Error> {
        let mut receiver = self.host.clone();
        let up = receiver.wait_for(Option::is_some);
        let up = tokio::time::timeout(WORLD_SERVICE_WAIT, up).await;
        up.ok().and_then(Result::ok).and_then(|host| host.clone()).ok_or_else(nobody)
    }

    /// The world service as it is now.
    fn host_now(&self) -> Result<Host, Error> {
        self.host.borrow().clone().ok_or_else(nobody)
    }

    async fn ask_worlds(&self, request: Request) -> Result<Reply, Error> {
        let (tenant, request) = (&self.tenant, &request);
        self.patiently(|Host { bus, id, .. }| async move {
            bus.request(&keys::worlds_of(tenant, &id), request, WORLD_DEADLINE).await
        })
        .await
    }

    /// Asks again while the world service is still starting or restarting.
    async fn patiently<T, F>(&self, ask: impl Fn(Host) -> F + Send + Sync) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>> + Send,
    {
        let until = Instant::now() + WORLD_SERVICE_WAIT;
        loop {
            let host = self.host().await?;
            match ask(host).await {
                // Its liveliness may be known a moment before its keys are.
                Err(error) if error.code == ErrorCode::Unreachable && Instant::now() < until => {
                    tokio::time::sleep(RETRY_PAUSE).await;
                }
                answer => return answer,
            }
        }
    }
}

fn nobody() -> Error {
    Error::new(ErrorCode::Unreachable, "no world service is up")
}

fn unexpected(wanted: &str) -> Error {
    Error::new(ErrorCode::InvalidMessage, "the world service answered something else")
        .wanted(wanted)
}

impl WorldPort for BusWorlds {
    fn create(&self, world: NewWorld) -> Answer<'_, CreatedWorld> {
        Box::pin(async move {
            let request = Request::CreateWorld {
                map: world.map,
                seed: world.seed,
                dt_secs: DT_SECS,
                commands: world.commands,
                lease: Some(Lease { owner: self.owner.clone(), millis: WORLD_LEASE_MILLIS }),
                traffic: false,
                first_actor: ActorId::FIRST,
            };
            match self.ask_worlds(request).await? {
                Reply::WorldCreated { world, frame, replies } => {
                    Ok(CreatedWorld { world, frame, replies })
                }
                _ => Err(unexpected("a new world")),
            }
        })
    }

    fn branch(&self, name: String, tick: Option<Tick>) -> Answer<'_, CreatedWorld> {
        Box::pin(async move {
            let lease = Some(Lease { owner: self.owner.clone(), millis: WORLD_LEASE_MILLIS });
            match self.ask_worlds(Request::BranchJournal { name, tick, lease }).await? {
                Reply::WorldCreated { world, frame, replies } => {
                    Ok(CreatedWorld { world, frame, replies })
                }
                _ => Err(unexpected("a branch")),
            }
        })
    }

    fn destroy(&self, world: WorldId) -> Answer<'_, ()> {
        Box::pin(async move {
            let host = self.host_now()?;
            let key = keys::world(&self.tenant, world);
            let request = Request::DestroyWorld { world };
            host.bus.request(&key, &request, WORLD_DEADLINE).await.map(drop)
        })
    }

    fn fork(&self, world: WorldId) -> Answer<'_, WorldId> {
        Box::pin(async move {
            let host = self.host_now()?;
            let lease = Some(Lease { owner: self.owner.clone(), millis: WORLD_LEASE_MILLIS });
            let request = Request::ForkWorld { world, count: 1, lease };
            let key = keys::world(&self.tenant, world);
            match host.bus.request(&key, &request, WORLD_DEADLINE).await? {
                Reply::Forked(forks) => forks.first().copied().ok_or_else(|| unexpected("a fork")),
                _ => Err(unexpected("a fork")),
            }
        })
    }

    fn owned(&self) -> Answer<'_, Vec<WorldId>> {
        Box::pin(async move {
            let Reply::Worlds(worlds) = self.ask_worlds(Request::ListWorlds).await? else {
                return Err(unexpected("worlds"));
            };
            let own = worlds.into_iter().filter(|info| info.owner.as_ref() == Some(&self.owner));
            Ok(own.map(|info| info.world).collect())
        })
    }

    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>> {
        Box::pin(async move {
            let host = self.host_now()?;
            let request = Request::TickWorlds(items);
            let reply = match &host.channel {
                Some(channel) => channel.request(&request, TICK_DEADLINE).await?,
                None => {
                    let key = keys::batch_tick(&host.id);
                    host.bus.request(&key, &request, TICK_DEADLINE).await?
                }
            };
            match reply {
                Reply::Ticked(results) => Ok(results),
                _ => Err(unexpected("ticked worlds")),
            }
        })
    }

    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Answer<'_, Vec<Image>> {
        Box::pin(async move {
            let job = RenderJob { tenant: self.tenant.clone(), frame, cameras };
            Ok(self.renderers.draw(&job).await?.images)
        })
    }

    fn maps(&self) -> Answer<'_, Vec<MapRef>> {
        Box::pin(async move {
            match self.ask_worlds(Request::ListMaps).await? {
                Reply::Maps(maps) => Ok(maps),
                _ => Err(unexpected("maps")),
            }
        })
    }

    fn map_text(&self, digest: String) -> Answer<'_, Vec<u8>> {
        Box::pin(async move {
            let digest = &digest;
            self.patiently(|host| async move { host.bus.asset(digest, WORLD_DEADLINE).await }).await
        })
    }
}
