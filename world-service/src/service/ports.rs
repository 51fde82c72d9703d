//! What the state machine needs of others.

use std::sync::Arc;
use std::time::Duration;

use schemas::{ActorId, Collision, Command, CommandReply, EncodedFrame, Error, Frame, MapRef};
use schemas::{Reply, SensorDatum, Tenant, Tick, Vec3, WorldId};

use crate::journal::{Head, Scribe};

/// Tells one asker. Dropped uncalled, the asker hears of an internal error.
pub type Answer = Box<dyn FnOnce(Reply) + Send>;

/// What a new world starts from.
pub struct NewWorld<T> {
    /// Its id, never given before.
    pub id: WorldId,
    /// Of the process.
    pub epoch: u64,
    /// Root of all randomness.
    pub seed: u64,
    /// Length of a tick.
    pub dt_secs: f64,
    /// Where.
    pub town: Arc<T>,
    /// Whether the town's traffic lights and signs are actors of the world.
    pub traffic: bool,
    /// Id of its first actor.
    pub first_actor: ActorId,
}

/// What can be asked of a world beyond its frame.
pub enum Question {
    /// Descriptions of these actors; none named: of all.
    Actors(Vec<ActorId>),
    /// Parameters and measurements of vehicles.
    Vehicles(Vec<ActorId>),
    /// What rays from a point to another meet, world frame, metres.
    Rays(Vec<(Vec3, Vec3)>),
}

/// One world as a value. Equal inputs give equal frames.
pub trait Simulation: Sized + Send + 'static {
    /// The ground and roads of a map, shared by all its worlds.
    type Town: Send + Sync + 'static;

    /// A world at tick 0.
    ///
    /// # Errors
    /// A value outside its domain.
    fn create(new: NewWorld<Self::Town>) -> Result<Self, Error>;

    /// A world that continues a snapshot under another id.
    ///
    /// # Errors
    /// Bytes that are no snapshot, or a map that `town_of` does not know.
    fn restore(
        snapshot: &[u8],
        id: WorldId,
        epoch: u64,
        town_of: &dyn Fn(&MapRef) -> Option<Arc<Self::Town>>,
    ) -> Result<Self, Error>;

    /// The whole state.
    fn snapshot(&self) -> Vec<u8>;

    /// A copy that continues bit for bit under another id.
    fn fork(&self, id: WorldId) -> Self;

    /// Changes the world; refused, it is unchanged.
    fn apply(&mut self, command: &Command) -> CommandReply;

    /// Advances by one tick of this length, or of the world's own.
    ///
    /// # Errors
    /// The world diverged and must not be used any more.
    fn tick(&mut self, dt_secs: Option<f64>) -> Result<(), Error>;

    /// The state.
    fn frame(&self) -> Frame;

    /// The present tick.
    fn tick_number(&self) -> Tick;

    /// Contacts of the last tick.
    fn collisions(&self) -> &[Collision];

    /// What sensors measured in the last tick, ordered by sensor.
    fn sensors(&self) -> &[SensorDatum];

    /// Cameras with listeners whose picture of the last tick is due.
    fn cameras_due(&self) -> &[ActorId];

    /// Looks without changing anything.
    ///
    /// # Errors
    /// What it asks about is not there.
    fn answer(&self, question: &Question) -> Result<Reply, Error>;

    /// Actors in the world.
    fn actor_count(&self) -> usize;

    /// Where it is.
    fn map(&self) -> &MapRef;

    /// The OpenDRIVE text of its map.
    fn map_text(&self) -> &str;
}

/// A journal that is to be begun.
pub struct NewJournal<'a> {
    /// Whose.
    pub tenant: &'a Tenant,
    /// Of which world.
    pub world: WorldId,
    /// Its file in the folder of the tenant; `None`: one that is not there yet.
    pub name: Option<&'a str>,
    /// From where it goes on.
    pub head: Head,
}

/// Where a shard's results go besides the replies.
pub trait Outlet<S> {
    /// Whether anybody may be listening to frames.
    fn has_listeners(&self) -> bool;

    /// Sends a frame to whoever listens; never waits.
    fn publish(&self, tenant: &Tenant, world: WorldId, frame: &EncodedFrame);

    /// Begins the journal of a world, under this name or one of its own; gives its name, too.
    ///
    /// # Errors
    /// `Unsupported` where none are kept, a name that leads nowhere, or the file cannot be made.
    fn journal(&self, wanted: NewJournal<'_>) -> Result<(String, Box<dyn Scribe>), Error>;

    /// A tick of a world was done, and took so long.
    fn ticked(&self, _took: Duration) {}

    /// Gives a new world to the shard of its id, before anything else that this shard is sent
    /// later.
    fn adopt(&self, id: WorldId, world: super::Hosted<S>);
}
