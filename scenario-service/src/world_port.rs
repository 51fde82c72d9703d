//! Worlds and pictures as sessions see them: a port, so that episodes run against the bus or
//! against a toy.

use std::future::Future;
use std::pin::Pin;

use schemas::{Camera, CommandReply, EncodedFrame, Error, ErrorCode, Image, MapRef};
use schemas::{ServiceId, SharedFrame, Tick, TickItem, TickResult, WorldId};
use worlds::NewWorld;

pub(crate) mod collector;
pub(crate) mod on_bus;

/// An answer of the world side, some time later.
pub(crate) type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T, Error>> + Send + 'a>>;

/// A world that was made.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CreatedWorld {
    /// Its id.
    pub(crate) world: WorldId,
    /// Its first frame.
    pub(crate) frame: EncodedFrame,
    /// One per command, in order.
    pub(crate) replies: Vec<CommandReply>,
}

/// A world that others may come into.
#[derive(Clone, Debug)]
pub(crate) struct Sharing {
    /// Which.
    pub(crate) world: WorldId,
    /// The first of the worlds that it goes on from, by which guests find it.
    pub(crate) stands_for: Option<WorldId>,
    /// Who shared the clock of the one before, and is waited for.
    pub(crate) guests: Vec<ServiceId>,
}

/// Length of one tick.
pub(crate) const DT_SECS: f64 = 0.05;

/// What sessions ask of world services and renderers. Every answer comes within a deadline of the
/// port's own.
pub(crate) trait WorldPort: Send + Sync + 'static {
    /// Makes a world, or nothing.
    fn create(&self, world: NewWorld) -> Answer<'_, CreatedWorld>;
    /// Makes a world that goes on from a state of a journal; `None`: from its last one.
    fn branch(&self, journal: String, _: Option<Tick>) -> Answer<'_, CreatedWorld> {
        let none = Error::new(ErrorCode::Unsupported, "no journals are kept here").found(journal);
        Box::pin(async move { Err(none) })
    }
    /// Frees a world.
    fn destroy(&self, world: WorldId) -> Answer<'_, ()>;
    /// Makes a world that is as this one is.
    fn fork(&self, world: WorldId) -> Answer<'_, WorldId>;
    /// The whole state of a world.
    fn snapshot(&self, world: WorldId) -> Answer<'_, Vec<u8>>;
    /// Makes a world that goes on from such a state.
    fn restore(&self, snapshot: Vec<u8>) -> Answer<'_, CreatedWorld>;
    /// Whether a world should be elsewhere, as the service that has it ends.
    fn should_move(&self, _: WorldId) -> bool {
        false
    }
    /// Worlds that live as long as this service does.
    fn owned(&self) -> Answer<'_, Vec<WorldId>>;
    /// Whether the service that had a world is known to be gone.
    fn is_gone(&self, _: WorldId) -> bool {
        false
    }
    /// Takes part in the clock of an own world, which others may share from now on; gives the name
    /// under which it is ticked then.
    fn share_clock(&self, sharing: Sharing) -> Answer<'_, ServiceId> {
        let none = Error::new(ErrorCode::Unsupported, "no world is shared here");
        Box::pin(async move { Err(none.found(sharing.world)) })
    }
    /// Advances many worlds; one result per item, in order.
    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>>;
    /// One picture for each camera, of what a frame tells.
    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Answer<'_, Vec<Image>>;
    /// All maps.
    fn maps(&self) -> Answer<'_, Vec<MapRef>>;
    /// The OpenDRIVE text with this digest.
    fn map_text(&self, digest: String) -> Answer<'_, Vec<u8>>;
}
