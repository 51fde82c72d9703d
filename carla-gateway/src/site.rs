//! The world service as an endpoint sees it: a port, with the bus behind it.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bus::{Bus, Hosts, Renderers};
use schemas::{Camera, Error, ErrorCode, Image, RenderJob, Reply, Request};
use schemas::{ServiceKind, SharedFrame, Tenant, WorldId, keys};
use tokio::sync::watch;

/// How long creation waits for a world service that is still starting.
const START_WAIT: Duration = Duration::from_secs(10);
/// Pause between two such questions.
const RETRY_PAUSE: Duration = Duration::from_millis(50);
/// Deadline of a question.
const ASK_DEADLINE: Duration = Duration::from_secs(30);

/// An answer, some time later.
pub(crate) type Later<'a, T> = Pin<Box<dyn Future<Output = Result<T, Error>> + Send + 'a>>;

/// What endpoints ask of world services. Every answer comes within a deadline of the port's own.
pub(crate) trait Site: Send + Sync + 'static {
    /// Asks a world, or whoever makes them.
    fn ask(&self, request: Request) -> Later<'_, Reply>;
    /// One picture for each camera, of what a frame tells.
    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Later<'_, Vec<Image>>;
    /// The OpenDRIVE text with this digest.
    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>>;
    /// Whether a renderer is up.
    fn can_draw(&self) -> bool;
}

/// The services of a bus that endpoints of all tenants use.
#[derive(Clone)]
pub(crate) struct Links {
    bus: Bus,
    /// The world services.
    pub(crate) hosts: Hosts,
    renderers: Arc<Renderers>,
}

impl Links {
    /// On a bus that is connected.
    pub(crate) fn follow(bus: Bus) -> Self {
        let connected = watch::Sender::new(Some(bus.clone())).subscribe();
        let renderers = Renderers::follow(connected.clone());
        let hosts = Hosts::follow(connected, ServiceKind::World, keys::batch_tick);
        Self { bus, hosts, renderers }
    }
}

/// Worlds of one tenant on the bus.
pub(crate) struct BusSite {
    links: Links,
    tenant: Tenant,
}

impl BusSite {
    /// Those that are reached by these links.
    pub(crate) fn new(links: Links, tenant: Tenant) -> Self {
        Self { links, tenant }
    }

    /// Over the fast channel to the host of the world, once it is open.
    async fn tick(&self, world: WorldId, request: &Request) -> Result<Reply, Error> {
        match self.links.hosts.of_world(world).and_then(|host| host.channel) {
            Some(channel) => channel.request(request, ASK_DEADLINE).await,
            None => {
                self.links
                    .bus
                    .request(&keys::world(&self.tenant, world), request, ASK_DEADLINE)
                    .await
            }
        }
    }

    async fn ask_worlds(&self, request: &Request) -> Result<Reply, Error> {
        let until = Instant::now() + START_WAIT;
        loop {
            let host = self.links.hosts.next().borrow().as_ref().map(|host| host.id.clone());
            let answer = match &host {
                Some(host) => {
                    let key = keys::worlds_of(&self.tenant, host);
                    self.links.bus.request(&key, request, ASK_DEADLINE).await
                }
                None => Err(Error::new(ErrorCode::Unreachable, "no world service is up")),
            };
            if let (Some(host), Ok(Reply::WorldCreated { world, .. })) = (&host, &answer) {
                self.links.hosts.note_world(host, *world);
            }
            match answer {
                Err(error) if error.code == ErrorCode::Unreachable && Instant::now() < until => {
                    tokio::time::sleep(RETRY_PAUSE).await;
                }
                answer => return answer,
            }
        }
    }
}

impl Site for BusSite {
    fn ask(&self, request: Request) -> Later<'_, Reply> {
        Box::pin(async move {
            let world = match &request {
                Request::RunCommands { world, .. }
                | Request::DescribeActors { world, .. }
                | Request::InspectVehicles { world, .. }
                | Request::DestroyWorld { world }
                | Request::CastRays { world, .. } => *world,
                Request::TickWorlds(items) => {
                    let Some(item) = items.first() else { return Ok(Reply::Ticked(Vec::new())) };
                    return self.tick(item.world, &request).await;
                }
                _ => return self.ask_worlds(&request).await,
            };
            self.links.bus.request(&keys::world(&self.tenant, world), &request, ASK_DEADLINE).await
        })
    }

    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Later<'_, Vec<Image>> {
        Box::pin(async move {
            let job = RenderJob { tenant: self.tenant.clone(), frame, cameras };
            Ok(self.links.renderers.draw(&job).await?.images)
        })
    }

    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>> {
        Box::pin(async move { self.links.bus.asset(&digest, ASK_DEADLINE).await })
    }

    fn can_draw(&self) -> bool {
        self.links.renderers.is_any_up()
    }
}
