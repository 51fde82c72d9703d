//! The world port over the bus.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Bus, Host, Hosts, Renderers};
use schemas::{ActorId, Camera, Error, ErrorCode, Image, Lease, MapRef, RenderJob, Reply};
use schemas::{
    Request, ServiceId, ServiceKind, SharedFrame, Tenant, Tick, TickItem, TickResult, WorldId, keys,
};
use tokio::sync::watch;

use super::{Answer, CreatedWorld, DT_SECS, NewWorld, WorldPort};
use crate::limits::{
    TICK_DEADLINE, TICK_DEADLINE_MAX, TICK_PATIENCE, WORLD_DEADLINE, WORLD_LEASE_MILLIS,
    WORLD_SERVICE_WAIT,
};

/// Pause before a question is put again to a service that has only just come up.
const RETRY_PAUSE: Duration = Duration::from_millis(5);

/// Worlds of one tenant on the bus.
pub(crate) struct BusWorlds {
    hosts: Hosts,
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
        let hosts = Hosts::follow(bus, ServiceKind::World, keys::batch_tick);
        Self { hosts, renderers, tenant, owner }
    }

    /// Worlds of another tenant, by the same services.
    pub(crate) fn for_tenant(&self, tenant: Tenant) -> Self {
        let (hosts, renderers) = (self.hosts.clone(), Arc::clone(&self.renderers));
        Self { hosts, renderers, tenant, owner: self.owner.clone() }
    }

    /// The world services.
    pub(crate) fn hosts(&self) -> &Hosts {
        &self.hosts
    }

    /// The world service, waiting for one that is still starting or restarting.
    async fn host(&self) -> Result<Host, Error> {
        let mut receiver = self.hosts.next();
        let up = receiver.wait_for(Option::is_some);
        let up = tokio::time::timeout(WORLD_SERVICE_WAIT, up).await;
        up.ok().and_then(Result::ok).and_then(|host| host.clone()).ok_or_else(nobody)
    }

    /// The world service that has a world.
    fn host_of(&self, world: WorldId) -> Result<Host, Error> {
        self.hosts.of_world(world).ok_or_else(nobody)
    }

    async fn ask_worlds(&self, request: Request) -> Result<Reply, Error> {
        let (tenant, request, hosts) = (&self.tenant, &request, &self.hosts);
        self.patiently(|Host { bus, id, .. }| async move {
            let key = keys::worlds_of(tenant, &id);
            let reply = bus.request(&key, request, WORLD_DEADLINE).await?;
            if let Reply::WorldCreated { world, .. } = &reply {
                hosts.note_world(&id, *world);
            }
            Ok(reply)
        })
        .await
    }

    /// Ticks worlds of one world service.
    async fn tick_there(&self, items: Vec<TickItem>) -> Result<Vec<TickResult>, Error> {
        let Some(item) = items.first() else { return Ok(Vec::new()) };
        let host = self.host_of(item.world)?;
        let deadline = deadline_of(&items);
        let request = Request::TickWorlds(items);
        let reply = match &host.channel {
            Some(channel) => channel.request(&request, deadline).await?,
            None => host.bus.request(&keys::batch_tick(&host.id), &request, deadline).await?,
        };
        match reply {
            Reply::Ticked(results) => Ok(results),
            _ => Err(unexpected("ticked worlds")),
        }
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

impl BusWorlds {
    /// Ticks worlds of several world services at once; each answers for its own.
    async fn tick_everywhere(&self, items: Vec<TickItem>) -> Result<Vec<TickResult>, Error> {
        let worlds: Vec<WorldId> = items.iter().map(|item| item.world).collect();
        let mut parts: BTreeMap<u32, Vec<TickItem>> = BTreeMap::new();
        for item in items {
            parts.entry(item.world.host()).or_default().push(item);
        }
        let asked = parts.into_values().map(|part| async {
            let worlds: Vec<WorldId> = part.iter().map(|item| item.world).collect();
            match self.tick_there(part).await {
                Ok(results) => results,
                Err(error) => {
                    let failed = |world| TickResult { world, outcome: Err(error.clone()) };
                    worlds.into_iter().map(failed).collect()
                }
            }
        });
        let results = futures_util::future::join_all(asked).await.into_iter().flatten();
        let mut results: BTreeMap<WorldId, VecDeque<TickResult>> =
            results.fold(BTreeMap::new(), |mut by_world, result| {
                by_world.entry(result.world).or_default().push_back(result);
                by_world
            });
        let result_of = |world: WorldId| results.get_mut(&world)?.pop_front();
        let ordered: Option<Vec<TickResult>> = worlds.into_iter().map(result_of).collect();
        ordered.ok_or_else(|| unexpected("a result for every world"))
    }
}

/// How long these ticks may take: it grows with what is asked.
fn deadline_of(items: &[TickItem]) -> Duration {
    let ticks = items.iter().fold(0, |sum: u32, item| sum.saturating_add(item.tick_count));
    (TICK_DEADLINE + TICK_PATIENCE.saturating_mul(ticks)).min(TICK_DEADLINE_MAX)
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
                traffic: world.signals,
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
            let host = self.host_of(world)?;
            let key = keys::world(&self.tenant, world);
            let request = Request::DestroyWorld { world };
            host.bus.request(&key, &request, WORLD_DEADLINE).await.map(drop)
        })
    }

    fn fork(&self, world: WorldId) -> Answer<'_, WorldId> {
        Box::pin(async move {
            let host = self.host_of(world)?;
            let lease = Some(Lease { owner: self.owner.clone(), millis: WORLD_LEASE_MILLIS });
            let request = Request::ForkWorld { world, count: 1, lease };
            let key = keys::world(&self.tenant, world);
            match host.bus.request(&key, &request, WORLD_DEADLINE).await? {
                Reply::Forked(forks) => forks.first().copied().ok_or_else(|| unexpected("a fork")),
                _ => Err(unexpected("a fork")),
            }
        })
    }

    fn snapshot(&self, world: WorldId) -> Answer<'_, Vec<u8>> {
        Box::pin(async move {
            let host = self.host_of(world)?;
            let key = keys::world(&self.tenant, world);
            let request = Request::SnapshotWorld { world };
            match host.bus.request(&key, &request, WORLD_DEADLINE).await? {
                Reply::Snapshot(bytes) => Ok(bytes),
                _ => Err(unexpected("a snapshot")),
            }
        })
    }

    fn restore(&self, snapshot: Vec<u8>) -> Answer<'_, CreatedWorld> {
        Box::pin(async move {
            let lease = Some(Lease { owner: self.owner.clone(), millis: WORLD_LEASE_MILLIS });
            match self.ask_worlds(Request::RestoreWorld { snapshot, lease }).await? {
                Reply::WorldCreated { world, frame, replies } => {
                    Ok(CreatedWorld { world, frame, replies })
                }
                _ => Err(unexpected("a restored world")),
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
            let first = items.first().map(|item| item.world.host());
            if items.iter().all(|item| Some(item.world.host()) == first) {
                return self.tick_there(items).await;
            }
            self.tick_everywhere(items).await
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_of_many_ticks_has_more_time_than_one_of_few() {
        let deadline = |ticks| deadline_of(&[TickItem::new(WorldId::of_host(1, 1), ticks)]);
        assert!(deadline(1) >= TICK_DEADLINE && deadline(1) < 2 * TICK_DEADLINE);
        assert_eq!(deadline(100), Duration::from_secs(35));
        assert_eq!(deadline(200), Duration::from_secs(55));
        assert_eq!(deadline(u32::MAX), TICK_DEADLINE_MAX);
    }
}
