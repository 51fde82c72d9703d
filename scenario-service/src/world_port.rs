//! Worlds and pictures as sessions see them: a port, so that episodes run against the bus or
//! against a toy.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use schemas::{Camera, Command, CommandReply, EncodedFrame, Error, Frame, Image, MapRef, TickItem};
use schemas::{TickResult, WorldId};

pub mod on_bus;

/// An answer of the world side, some time later.
pub type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T, Error>> + Send + 'a>>;

/// A world to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct NewWorld {
    /// Map name.
    pub map: String,
    /// Root of all randomness.
    pub seed: u64,
    /// Applied in order before the first frame.
    pub commands: Vec<Command>,
}

/// A world that was made.
#[derive(Clone, Debug, PartialEq)]
pub struct CreatedWorld {
    /// Its id.
    pub world: WorldId,
    /// Its first frame.
    pub frame: EncodedFrame,
    /// One per command, in order.
    pub replies: Vec<CommandReply>,
}

/// Length of one tick.
pub const DT_SECS: f64 = 0.05;

/// What sessions ask of world services and renderers. Every answer comes within a deadline of the
/// port's own.
pub trait WorldPort: Send + Sync + 'static {
    /// Makes a world, or nothing.
    fn create(&self, world: NewWorld) -> Answer<'_, CreatedWorld>;
    /// Frees a world.
    fn destroy(&self, world: WorldId) -> Answer<'_, ()>;
    /// Advances many worlds; one result per item, in order.
    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>>;
    /// One picture for each camera, of what a frame tells.
    fn draw(&self, frame: Frame, cameras: Vec<Camera>) -> Answer<'_, Vec<Image>>;
    /// All maps.
    fn maps(&self) -> Answer<'_, Vec<MapRef>>;
    /// The OpenDRIVE text with this digest.
    fn map_text(&self, digest: String) -> Answer<'_, Vec<u8>>;
}

/// A world that is destroyed when its owner lets go of it, however that happens.
pub struct OwnedWorld {
    port: Arc<dyn WorldPort>,
    world: WorldId,
}

impl OwnedWorld {
    /// Takes charge of a world. Must be dropped inside a tokio runtime.
    pub fn new(port: Arc<dyn WorldPort>, world: WorldId) -> Self {
        Self { port, world }
    }

    /// Which world.
    pub fn id(&self) -> WorldId {
        self.world
    }
}

impl Drop for OwnedWorld {
    fn drop(&mut self) {
        let (port, world) = (Arc::clone(&self.port), self.world);
        // Without a runtime the process is ending, and the worlds end with its lease.
        let Ok(runtime) = tokio::runtime::Handle::try_current() else { return };
        runtime.spawn(async move {
            if let Err(error) = port.destroy(world).await {
                tracing::debug!(%world, %error, "a world could not be destroyed; its service is gone");
            }
        });
    }
}
