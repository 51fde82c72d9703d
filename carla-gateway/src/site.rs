//! The world service as an endpoint sees it: a port, with the bus behind it.

use std::future::Future;
use std::pin::Pin;
use std::time::{Duration, Instant};

use bus::Bus;
use schemas::{Error, ErrorCode, Reply, Request, Tenant, keys};

/// How long creation waits for a world service that is still starting.
const START_WAIT: Duration = Duration::from_secs(10);
/// Pause between two such questions.
const RETRY_PAUSE: Duration = Duration::from_millis(50);
/// Deadline of anything but a picture.
const ASK_DEADLINE: Duration = Duration::from_secs(30);
/// Deadline of a picture.
const CAPTURE_DEADLINE: Duration = Duration::from_secs(40);

/// An answer, some time later.
pub(crate) type Later<'a, T> = Pin<Box<dyn Future<Output = Result<T, Error>> + Send + 'a>>;

/// What endpoints ask of world services. Every answer comes within a deadline of the port's own.
pub(crate) trait Site: Send + Sync + 'static {
    /// Asks a world, or whoever makes them.
    fn ask(&self, request: Request) -> Later<'_, Reply>;
    /// The OpenDRIVE text with this digest.
    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>>;
}

/// Worlds of one tenant on the bus.
pub(crate) struct BusSite {
    bus: Bus,
    tenant: Tenant,
}

impl BusSite {
    /// On a bus that is connected.
    pub(crate) fn new(bus: Bus, tenant: Tenant) -> Self {
        Self { bus, tenant }
    }

    async fn ask_worlds(&self, request: &Request) -> Result<Reply, Error> {
        let key = keys::worlds(&self.tenant);
        let until = Instant::now() + START_WAIT;
        loop {
            match self.bus.request(&key, request, ASK_DEADLINE).await {
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
                | Request::Capture { world, .. }
                | Request::DescribeActors { world, .. }
                | Request::InspectVehicle { world, .. }
                | Request::CastRays { world, .. } => *world,
                Request::TickWorlds(items) => match items.first() {
                    Some(item) => item.world,
                    None => return Ok(Reply::Ticked(Vec::new())),
                },
                Request::DestroyWorld { .. } => {
                    return self
                        .bus
                        .request(&keys::worlds(&self.tenant), &request, ASK_DEADLINE)
                        .await;
                }
                _ => return self.ask_worlds(&request).await,
            };
            let is_picture = matches!(request, Request::Capture { .. });
            let deadline = if is_picture { CAPTURE_DEADLINE } else { ASK_DEADLINE };
            self.bus.request(&keys::world(&self.tenant, world), &request, deadline).await
        })
    }

    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>> {
        Box::pin(async move { self.bus.asset(&digest, ASK_DEADLINE).await })
    }
}
