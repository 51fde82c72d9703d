//! What it takes to make a world again when the service that had it is gone: a state of it, and all
//! that was done since. The same commands give the same bits, so it is the same world.

use std::sync::Arc;
use std::time::Duration;

use schemas::{
    ActorId, AgentCommand, Attribute, BonePose, Command, EncodedFrame, Error, ErrorCode, Frame,
    Lease, Request, SceneryCommand, SensorCommand, SharedFrame, TickItem, Vec3, VehicleCommand,
    VehiclePhysics, WalkerCommand, WorldId,
};

use crate::budget::{Budget, Share};

/// Ticks that are repeated at most when a world is made again, but for those of the last request.
pub const RECOVERY_TICKS: u32 = 200;
/// Bytes of commands that are repeated then, but for those of the last request.
pub const RECOVERY_BYTES: usize = 256 * 1024;
/// How long each answer in an attempt to make a world again may take, and all of them together, but
/// for repeated ticks: a town is built.
const PATIENCE: [Duration; 3] =
    [Duration::from_secs(3), Duration::from_secs(6), Duration::from_secs(12)];
/// How long each repeated tick may take then.
const REPEATED_TICK: Duration = Duration::from_millis(50);

/// A world to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct NewWorld {
    /// Map name.
    pub map: String,
    /// Root of all randomness.
    pub seed: u64,
    /// Length of a tick in seconds.
    pub dt_secs: f64,
    /// Applied in order before the first frame.
    pub commands: Vec<Command>,
    /// Whether the map's traffic lights and signs are actors of the world, the first ones.
    pub traffic: bool,
    /// Id of its first actor.
    pub first_actor: ActorId,
}

/// A state from which a world goes on.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// Its first one.
    New(NewWorld),
    /// A later one.
    Snapshot(Vec<u8>),
}

/// Who makes worlds, and ticks them.
pub trait Maker {
    /// What has a world; nobody has it any more when this is dropped.
    type World;
    /// Makes a world that goes on from a state.
    fn make(
        &self,
        state: &State,
    ) -> impl Future<Output = Result<(EncodedFrame, Self::World), Error>> + Send;
    /// Which world it has.
    fn id(world: &Self::World) -> WorldId;
    /// Ticks a world; gives the last frame.
    fn tick(&self, item: TickItem) -> impl Future<Output = Result<EncodedFrame, Error>> + Send;
}

/// A state of a world, and all that was done since.
pub struct Recovery {
    state: State,
    done: Vec<Done>,
    ticks: u32,
    /// Of `done`.
    bytes: usize,
    /// How often no new state could be had.
    misses: usize,
    share: Share,
}

/// What was seen last of a world.
#[derive(Clone, Copy, Debug)]
pub enum Seen<'a> {
    /// Nobody else does anything in it: it is as this frame shows it.
    Alone(&'a Frame),
    /// Others may have changed it since, as the state that is kept tells.
    WithOthers(&'a Frame),
}

/// What was done in one request.
struct Done {
    commands: Vec<Command>,
    tick_count: u32,
    dt_secs: Option<f64>,
}

/// What became of a world that was to be made again.
#[derive(Debug)]
pub enum Remade<W> {
    /// It is as it was.
    Whole(W),
    /// Not now; later it may be. This is why.
    Later(Error),
    /// Never. This is why.
    Never(Error),
}

impl NewWorld {
    /// Has it made, for whoever holds the lease.
    pub fn request(self, lease: Lease) -> Request {
        Request::CreateWorld {
            map: self.map,
            seed: self.seed,
            dt_secs: self.dt_secs,
            commands: self.commands,
            lease: Some(lease),
            traffic: self.traffic,
            first_actor: self.first_actor,
        }
    }
}

impl State {
    fn bytes(&self) -> usize {
        match self {
            Self::New(new) => size_of::<Self>() + bytes_of(&new.commands),
            Self::Snapshot(bytes) => size_of::<Self>() + bytes.len(),
        }
    }
}

impl Recovery {
    /// `None` when the budget has no room for it.
    pub fn new(state: State, budget: &Arc<Budget>) -> Option<Self> {
        let mut share = Share::none(Arc::clone(budget));
        let has_room = share.grow(state.bytes());
        has_room.then(|| Self { state, done: Vec::new(), ticks: 0, bytes: 0, misses: 0, share })
    }

    /// Notes what was done, with the length of its ticks if it is not the world's own. `false`:
    /// there is no room for it, so that nothing can be made again.
    #[must_use]
    pub fn note(&mut self, commands: Vec<Command>, tick_count: u32, dt_secs: Option<f64>) -> bool {
        let bytes = size_of::<Done>() + bytes_of(&commands);
        self.ticks = self.ticks.saturating_add(tick_count);
        self.bytes += bytes;
        self.done.push(Done { commands, tick_count, dt_secs });
        self.share.grow(bytes)
    }

    /// Whether a new state should take the place of all this and what is done next.
    pub fn is_long_with(&self, commands: &[Command], tick_count: u32) -> bool {
        let ticks = self.ticks.saturating_add(tick_count) as usize;
        let bytes = self.bytes + size_of::<Done>() + bytes_of(commands);
        let times = 1 + self.misses;
        ticks >= RECOVERY_TICKS as usize * times || bytes >= RECOVERY_BYTES * times
    }

    /// Notes that no new state could be had; it is asked for again after as much again.
    pub fn miss(&mut self) {
        self.misses += 1;
    }

    /// Makes the world again, on whichever service takes it, as it was seen last. Tries again while
    /// services come and go: a question that was on its way to one that died may never be answered.
    pub async fn remake<M: Maker>(&self, maker: &M, seen: Seen<'_>) -> Remade<M::World> {
        let mut last = gone();
        for patience in PATIENCE {
            let attempt = self.try_remake(maker, patience);
            match within(patience + REPEATED_TICK * self.ticks, attempt).await {
                Ok((frame, world)) if seen.fits(&frame) => return Remade::Whole(world),
                Ok(_) => return Remade::Never(gone()),
                Err(error) if error.code == ErrorCode::Capacity => return Remade::Later(error),
                Err(error) if is_passing(error.code) => last = error,
                Err(error) => return Remade::Never(error),
            }
        }
        Remade::Later(last)
    }

    async fn try_remake<M: Maker>(
        &self,
        maker: &M,
        patience: Duration,
    ) -> Result<(SharedFrame, M::World), Error> {
        let (first, world) = within(patience, maker.make(&self.state)).await?;
        let mut frame = SharedFrame::decode(first)?;
        for done in &self.done {
            let item = TickItem {
                commands: done.commands.clone(),
                expected_tick: Some(frame.tick),
                dt_secs: done.dt_secs,
                ..TickItem::new(M::id(&world), done.tick_count)
            };
            let patience = patience + REPEATED_TICK * done.tick_count;
            frame = SharedFrame::decode(within(patience, maker.tick(item)).await?)?;
        }
        Ok((frame, world))
    }
}

/// An answer, or that it did not come in time.
async fn within<T>(
    patience: Duration,
    answer: impl Future<Output = Result<T, Error>>,
) -> Result<T, Error> {
    let late = || Error::new(ErrorCode::TimedOut, "the world was not made again in time");
    tokio::time::timeout(patience, answer).await.unwrap_or_else(|_| Err(late()))
}

impl Seen<'_> {
    /// Whether a world that shows this frame may take the place of the one that was seen; says so
    /// if not.
    pub fn fits(self, frame: &Frame) -> bool {
        match self {
            Self::Alone(seen) => is_same(frame, seen),
            Self::WithOthers(seen) => {
                let fits = frame.tick == seen.tick && frame.map.digest == seen.map.digest;
                if !fits {
                    let (wanted, found) = (seen.tick.0, frame.tick.0);
                    tracing::error!(
                        wanted,
                        found,
                        "a world that was made again is at another tick"
                    );
                }
                fits
            }
        }
    }
}

/// Whether two frames are of the same state; says so if they are not.
fn is_same(frame: &Frame, seen: &Frame) -> bool {
    let is_same = (frame.tick, frame.state_hash) == (seen.tick, seen.state_hash)
        && frame.map.digest == seen.map.digest;
    if !is_same {
        let of = |frame: &Frame| format!("tick {}, {:016x}", frame.tick.0, frame.state_hash);
        let (wanted, found) = (of(seen), of(frame));
        tracing::error!(wanted, found, "a world that was made again went another way");
    }
    is_same
}

/// Whether an error means that the world is gone, so that it may be made again. One that is slow is
/// still there, and one that panics would panic again.
pub fn is_gone(code: ErrorCode) -> bool {
    matches!(code, ErrorCode::UnknownWorld | ErrorCode::Unreachable)
}

/// Whether a later attempt may find another service, or room.
fn is_passing(code: ErrorCode) -> bool {
    use ErrorCode::{TimedOut, UnknownWorld, Unreachable};
    matches!(code, TimedOut | Unreachable | UnknownWorld)
}

fn gone() -> Error {
    Error::new(ErrorCode::UnknownWorld, "no world service has it, and it cannot be made again")
}

/// Of commands, with what the large ones among them hold.
pub fn bytes_of(commands: &[Command]) -> usize {
    let held = |command: &Command| match command {
        Command::SpawnActor { blueprint, attributes, .. } => {
            let held = |a: &Attribute| size_of::<Attribute>() + a.id.len() + a.value.len();
            blueprint.len() + attributes.iter().map(held).sum::<usize>()
        }
        Command::Vehicle(VehicleCommand::Physics { physics, .. }) => bytes_of_physics(physics),
        Command::Walker(WalkerCommand::Bones { change, .. }) => {
            change.bones.len() * size_of::<BonePose>()
        }
        Command::Agent(AgentCommand::SetRoute { places_m, .. }) => {
            places_m.len() * size_of::<Vec3>()
        }
        Command::Scenery(SceneryCommand::Paint { objects, texture, .. }) => {
            objects.len() * size_of::<u64>() + texture.bytes().len()
        }
        Command::Scenery(SceneryCommand::Objects { objects, .. }) => {
            objects.len() * size_of::<u64>()
        }
        Command::Sensor(SensorCommand::IgnoreVehicles { vehicles, .. }) => {
            vehicles.len() * size_of::<ActorId>()
        }
        Command::Sensor(SensorCommand::SendV2x { text, .. }) => text.len(),
        _ => 0,
    };
    size_of_val(commands) + commands.iter().map(held).sum::<usize>()
}

fn bytes_of_physics(physics: &VehiclePhysics) -> usize {
    size_of_val(physics)
        + size_of_val(physics.torque_curve.as_slice())
        + size_of_val(physics.forward_gears.as_slice())
        + size_of_val(physics.steering_curve.as_slice())
        + size_of_val(physics.wheels.as_slice())
}

#[cfg(test)]
mod tests;
