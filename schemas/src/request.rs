//! What can be asked of a world service, and what it answers.

use crate::{ActorDescription, ActorId, Collision, Command, Error, Image, MapRef, RayHit};
use crate::{SensorDatum, ServiceId, Tick, Vec3, VehicleReport, WorldId};

/// Keeps a world alive as long as a service is, plus a grace time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lease {
    /// Whose liveliness counts.
    pub owner: ServiceId,
    /// How long the world outlives its owner.
    pub millis: u32,
}

/// A request to a world service.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Makes a world and applies commands to it; nothing is made if one is refused.
    CreateWorld {
        /// Map name.
        map: String,
        /// Root of all randomness.
        seed: u64,
        /// Length of a tick in seconds.
        dt_secs: f64,
        /// Applied in order before the first frame.
        commands: Vec<Command>,
        /// `None`: lives until destroyed.
        lease: Option<Lease>,
        /// Whether the map's traffic lights and signs are actors of the world, the first ones.
        traffic: bool,
        /// Id of its first actor. Whoever follows one world with another gives no id again.
        first_actor: ActorId,
    },
    /// All worlds of the tenant.
    ListWorlds,
    /// All maps.
    ListMaps,
    /// Frees a world.
    DestroyWorld {
        /// Which.
        world: WorldId,
    },
    /// The whole state of a world as bytes.
    SnapshotWorld {
        /// Which.
        world: WorldId,
    },
    /// A new world that continues a snapshot bit for bit.
    RestoreWorld {
        /// From [`Reply::Snapshot`].
        snapshot: Vec<u8>,
        /// As for creation.
        lease: Option<Lease>,
    },
    /// Copies of a world, each continuing bit for bit.
    ForkWorld {
        /// Which.
        world: WorldId,
        /// How many.
        count: u32,
        /// As for creation.
        lease: Option<Lease>,
    },
    /// Applies commands without ticking.
    RunCommands {
        /// To which world.
        world: WorldId,
        /// In order.
        commands: Vec<Command>,
    },
    /// Advances one or many worlds.
    TickWorlds(Vec<TickItem>),
    /// What does not change from tick to tick.
    DescribeActors {
        /// Of which world.
        world: WorldId,
        /// Empty: all.
        actors: Vec<ActorId>,
    },
    /// Physics parameters and last measurements of vehicles.
    InspectVehicles {
        /// Of which world.
        world: WorldId,
        /// Which vehicles.
        actors: Vec<ActorId>,
    },
    /// Makes a map known, or replaces one that was made known this way.
    PutMap {
        /// As worlds will name it.
        name: String,
        /// OpenDRIVE.
        text: String,
    },
    /// From now on a world goes on only when all who share its clock have asked for its next tick.
    ShareClock {
        /// Which.
        world: WorldId,
        /// Who takes part from now on; any name.
        participant: ServiceId,
        /// How long the others wait for this one before it no longer takes part; 0: it leaves.
        lease_millis: u32,
        /// The first of the worlds that this one goes on from, for those who look for it.
        stands_for: Option<WorldId>,
    },
    /// Keeps a journal of a world from now on, or ends it.
    RecordWorld {
        /// Which.
        world: WorldId,
        /// Begin or end.
        on: bool,
        /// Its file in the folder of the tenant; `None`: a new one.
        name: Option<String>,
    },
    /// A new world that goes on from a state of a journal, bit for bit.
    BranchJournal {
        /// Its file in the folder of the tenant.
        name: String,
        /// After which tick; `None`: its last one.
        tick: Option<Tick>,
        /// As for creation.
        lease: Option<Lease>,
    },
    /// Everything that each ray meets.
    CastRays {
        /// In which world.
        world: WorldId,
        /// From where to where, world frame, metres.
        rays: Vec<(Vec3, Vec3)>,
    },
}

/// One world's part of [`Request::TickWorlds`].
#[derive(Clone, Debug, PartialEq)]
pub struct TickItem {
    /// Which world.
    pub world: WorldId,
    /// 0 applies the commands and answers with the present frame.
    pub tick_count: u32,
    /// Applied before the first tick.
    pub commands: Vec<Command>,
    /// Refuse unless the world is at this tick: makes a retry harmless.
    pub expected_tick: Option<Tick>,
    /// Length of these ticks in seconds; `None`: the world's own.
    pub dt_secs: Option<f64>,
    /// Who ticks, in a world whose [clock is shared](Request::ShareClock).
    pub participant: Option<ServiceId>,
}

impl TickItem {
    /// `tick_count` ticks of a world and nothing else.
    pub fn new(world: WorldId, tick_count: u32) -> Self {
        Self {
            world,
            tick_count,
            commands: Vec::new(),
            expected_tick: None,
            dt_secs: None,
            participant: None,
        }
    }
}

/// The answer to one command: the actor it spawned, if it spawned one.
pub type CommandReply = Result<Option<ActorId>, Error>;

/// An answer of a world service or a renderer.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Refused.
    Error(Error),
    /// Done, nothing to say.
    Done,
    /// One per command, in order.
    CommandReplies(Vec<CommandReply>),
    /// The new world.
    WorldCreated {
        /// Its id.
        world: WorldId,
        /// Its first frame, encoded.
        frame: EncodedFrame,
        /// One per command, in order.
        replies: Vec<CommandReply>,
    },
    /// All worlds of the tenant, ordered by id.
    Worlds(Vec<WorldInfo>),
    /// All maps, ordered by name.
    Maps(Vec<MapRef>),
    /// The whole state of a world.
    Snapshot(Vec<u8>),
    /// The copies, in order.
    Forked(Vec<WorldId>),
    /// One per item, in order.
    Ticked(Vec<TickResult>),
    /// The pictures.
    Images(Images),
    /// Known actors of those asked for, ordered by id.
    Actors(Vec<ActorDescription>),
    /// One per vehicle, in the order of the request.
    Vehicles(Vec<VehicleReport>),
    /// Ordered by ray, then by distance.
    RayHits(Vec<RayHit>),
    /// From which state a journal goes on.
    JournalBegun {
        /// Its file in the folder of the tenant.
        name: String,
        /// Of its map and first state.
        digest: u64,
        /// Of the state.
        tick: Tick,
        /// Of the state.
        state_hash: u64,
    },
}

/// Pictures of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Images {
    /// The frame's tick.
    pub tick: Tick,
    /// The frame's state hash.
    pub state_hash: u64,
    /// One per camera, in order.
    pub images: Vec<Image>,
}

/// One world's part of [`Reply::Ticked`].
#[derive(Clone, Debug, PartialEq)]
pub struct TickResult {
    /// Which world.
    pub world: WorldId,
    /// What came of it.
    pub outcome: Result<TickOutcome, Error>,
}

/// A world after its ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct TickOutcome {
    /// The last frame, encoded.
    pub frame: EncodedFrame,
    /// One per command, in order.
    pub replies: Vec<CommandReply>,
    /// Collisions of every tick of the request, when it was more than one.
    pub collisions: Vec<Collision>,
    /// Of every tick of the request, ordered by tick and sensor.
    pub sensors: Vec<SensorDatum>,
    /// Cameras with listeners whose picture of the last tick is due.
    pub cameras_due: Vec<ActorId>,
    /// Who shares the clock beside the owner, which alone is told.
    pub guests: Vec<ServiceId>,
    /// Whether others than the owner had something done since it was told last; it alone is told.
    pub is_changed_by_others: bool,
}

impl TickOutcome {
    /// A frame and nothing else.
    pub fn new(frame: EncodedFrame) -> Self {
        Self {
            frame,
            replies: Vec::new(),
            collisions: Vec::new(),
            sensors: Vec::new(),
            cameras_due: Vec::new(),
            guests: Vec::new(),
            is_changed_by_others: false,
        }
    }
}

/// What a list tells about a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorldInfo {
    /// Its id.
    pub world: WorldId,
    /// Its map's name.
    pub map: String,
    /// Its present tick.
    pub tick: Tick,
    /// Its actors.
    pub actor_count: u32,
    /// Whose liveliness keeps it.
    pub owner: Option<ServiceId>,
    /// Why it is quarantined; `None` while it is healthy.
    pub quarantined: Option<String>,
    /// The first of the worlds that it goes on from, as who shares its clock has said.
    pub stands_for: Option<WorldId>,
}

/// The bytes of one [`Frame`](crate::Frame), made once by the world and then only copied.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedFrame(pub Vec<u8>);
