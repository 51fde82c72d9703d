//! Worlds as an endpoint sees them: a port, with the bus behind it.

use std::future::Future;
use std::pin::Pin;
use std::time::Duration;

use schemas::{Camera, Error, Image, Reply, Request, SharedFrame, Staging, WorldId};
use tokio::sync::watch;
use worlds::{Patience, Worlds};

/// Deadline of a question.
const ASK_DEADLINE: Duration = Duration::from_secs(30);

/// How long answers may take.
pub(crate) const PATIENCE: Patience = Patience {
    ask: ASK_DEADLINE,
    ticks: ASK_DEADLINE,
    per_tick: Duration::ZERO,
    ticks_max: ASK_DEADLINE,
};

/// An answer, some time later.
pub(crate) type Later<'a, T> = Pin<Box<dyn Future<Output = Result<T, Error>> + Send + 'a>>;

/// What endpoints ask of world services. Every answer comes within a deadline of the port's own.
pub(crate) trait Site: Send + Sync + 'static {
    /// Asks a world, or whoever makes them.
    fn ask(&self, request: Request) -> Later<'_, Reply>;
    /// One picture for each camera, of what a frame tells.
    fn draw(
        &self,
        frame: SharedFrame,
        cameras: Vec<Camera>,
        staging: Staging,
    ) -> Later<'_, Vec<Image>>;
    /// The OpenDRIVE text with this digest.
    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>>;
    /// Whether a renderer is up.
    fn can_draw(&self) -> bool;
    /// Whether a world should be elsewhere, as the service that has it ends.
    fn should_move(&self, world: WorldId) -> bool;
    /// Whether the service that had a world is known to be gone.
    fn is_gone(&self, _: WorldId) -> bool {
        false
    }
    /// Changes when one of these may have.
    fn changes(&self) -> watch::Receiver<u64>;
}

impl Site for Worlds {
    fn ask(&self, request: Request) -> Later<'_, Reply> {
        Box::pin(Worlds::ask(self, request))
    }

    fn draw(
        &self,
        frame: SharedFrame,
        cameras: Vec<Camera>,
        staging: Staging,
    ) -> Later<'_, Vec<Image>> {
        Box::pin(Worlds::draw(self, frame, cameras, staging))
    }

    fn map_text(&self, digest: String) -> Later<'_, Vec<u8>> {
        Box::pin(async move { Worlds::map_text(self, &digest).await })
    }

    fn can_draw(&self) -> bool {
        Worlds::can_draw(self)
    }

    fn should_move(&self, world: WorldId) -> bool {
        self.hosts().should_move(world)
    }

    fn is_gone(&self, world: WorldId) -> bool {
        self.hosts().is_gone(world)
    }

    fn changes(&self) -> watch::Receiver<u64> {
        self.hosts().changes()
    }
}
