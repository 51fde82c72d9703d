//! The world port over the bus.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Bus, Lane, Presence};
use schemas::{Camera, Error, ErrorCode, Images, Lease, MapRef, Reply, Request, ServiceId};
use schemas::{ServiceKind, Tenant, TickItem, TickResult, WorldId, keys};
use tokio::sync::watch;

use super::{Answer, CreatedWorld, DT_SECS, NewWorld, WorldPort};
use crate::limits::{
    CAPTURE_DEADLINE, TICK_DEADLINE, WORLD_DEADLINE, WORLD_LEASE_MILLIS, WORLD_SERVICE_WAIT,
};

/// Pause before a question is put again to a service that has only just come up.
const RETRY_PAUSE: Duration = Duration::from_millis(5);

/// Worlds of one tenant on the bus.
pub struct BusWorlds {
    place: watch::Receiver<Option<Place>>,
    tenant: Tenant,
    owner: ServiceId,
}

/// The bus and the world service on it.
#[derive(Clone)]
struct Place {
    bus: Bus,
    host: ServiceId,
    /// For ticks; `None` until it is open.
    lane: Option<Arc<Lane>>,
}

impl BusWorlds {
    /// Follows the world services of a bus that may still be connecting.
    pub fn start(bus: watch::Receiver<Option<Bus>>, tenant: Tenant, owner: ServiceId) -> Self {
        let (sender, place) = watch::channel(None);
        tokio::spawn(follow(bus, sender));
        Self { place, tenant, owner }
    }

    /// The world service, waiting for one that is still starting or restarting.
    async fn place(&self) -> Result<Place, Error> {
        let mut receiver = self.place.clone();
        let up = receiver.wait_for(Option::is_some);
        let up = tokio::time::timeout(WORLD_SERVICE_WAIT, up).await;
        up.ok().and_then(Result::ok).and_then(|place| place.clone()).ok_or_else(nobody)
    }

    /// The world service as it is now.
    fn place_now(&self) -> Result<Place, Error> {
        self.place.borrow().clone().ok_or_else(nobody)
    }

    async fn ask_worlds(&self, request: Request) -> Result<Reply, Error> {
        let (key, request) = (&keys::worlds(&self.tenant), &request);
        self.patiently(|bus| async move { bus.request(key, request, WORLD_DEADLINE).await }).await
    }

    /// Asks again while the world service is still starting or restarting.
    async fn patiently<T, F>(&self, ask: impl Fn(Bus) -> F + Send + Sync) -> Result<T, Error>
    where
        F: Future<Output = Result<T, Error>> + Send,
    {
        let until = Instant::now() + WORLD_SERVICE_WAIT;
        loop {
            let place = self.place().await?;
            match ask(place.bus).await {
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

/// Keeps the place at the first world service that is up.
async fn follow(mut bus: watch::Receiver<Option<Bus>>, place: watch::Sender<Option<Place>>) {
    let place = Arc::new(place);
    let Ok(bus) = bus.wait_for(Option::is_some).await.map(|bus| bus.clone()) else { return };
    let Some(bus) = bus else { return };
    let mut presence = match bus.watch(Some(ServiceKind::World)).await {
        Ok(presence) => presence,
        Err(error) => {
            tracing::error!(%error, "world services cannot be followed");
            return;
        }
    };
    let mut hosts: Vec<ServiceId> = Vec::new();
    loop {
        match presence.next().await {
            Presence::Up(alive) => {
                tracing::info!(host = %alive.id, "world service up");
                hosts.push(alive.id);
            }
            Presence::Down(_, id) => {
                tracing::warn!(host = %id, "world service down");
                hosts.retain(|host| *host != id);
            }
        }
        let is_known = |place: &Option<Place>, host| {
            place.as_ref().is_some_and(|place| Some(&place.host) == host)
        };
        if is_known(&place.borrow(), hosts.first()) {
            continue;
        }
        let new = |host: &ServiceId| Place { bus: bus.clone(), host: host.clone(), lane: None };
        place.send_replace(hosts.first().map(new));
        if let Some(host) = hosts.first() {
            tokio::spawn(open_lane(bus.clone(), host.clone(), Arc::clone(&place)));
        }
    }
}

/// Ticks go as queries until the lane is open, and for good if it cannot be opened.
async fn open_lane(bus: Bus, host: ServiceId, place: Arc<watch::Sender<Option<Place>>>) {
    let key = keys::batch_tick(&host);
    match bus.lane(&key, (ServiceKind::World, &host)).await {
        Ok(lane) => {
            place.send_if_modified(|place| match place {
                Some(place) if place.host == host => {
                    place.lane = Some(Arc::new(lane));
                    true
                }
                _ => false,
            });
        }
        Err(error) => tracing::warn!(%host, %error, "ticks travel as queries: no fast lane"),
    }
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
            };
            match self.ask_worlds(request).await? {
                Reply::WorldCreated { world, frame, replies } => {
                    Ok(CreatedWorld { world, frame, replies })
                }
                _ => Err(unexpected("a new world")),
            }
        })
    }

    fn destroy(&self, world: WorldId) -> Answer<'_, ()> {
        Box::pin(async move {
            let place = self.place_now()?;
            let key = keys::worlds(&self.tenant);
            let request = Request::DestroyWorld { world };
            place.bus.request(&key, &request, WORLD_DEADLINE).await.map(drop)
        })
    }

    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>> {
        Box::pin(async move {
            let place = self.place_now()?;
            let request = Request::TickWorlds(items);
            let reply = match &place.lane {
                Some(lane) => lane.request(&request, TICK_DEADLINE).await?,
                None => {
                    let key = keys::batch_tick(&place.host);
                    place.bus.request(&key, &request, TICK_DEADLINE).await?
                }
            };
            match reply {
                Reply::Ticked(results) => Ok(results),
                _ => Err(unexpected("ticked worlds")),
            }
        })
    }

    fn capture(&self, world: WorldId, cameras: Vec<Camera>) -> Answer<'_, Images> {
        Box::pin(async move {
            let place = self.place_now()?;
            let key = keys::world(&self.tenant, world);
            let request = Request::Capture { world, cameras };
            match place.bus.request(&key, &request, CAPTURE_DEADLINE).await? {
                Reply::Images(images) => Ok(images),
                _ => Err(unexpected("images")),
            }
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
            self.patiently(|bus| async move { bus.asset(digest, WORLD_DEADLINE).await }).await
        })
    }
}
