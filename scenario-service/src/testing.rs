//! What several unit tests share: the default town, and worlds with toy physics behind the port.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex};

use schemas::{
    ActorId, ActorKind, ActorState, AgentCommand, Camera, Collision, Command, CommandReply,
    EncodedFrame, Error, ErrorCode, Frame, Image, MapRef, PilotMode, Pose, ServiceId, SharedFrame,
    Tick, TickItem, TickOutcome, TickResult, Vec3, VehicleCommand, VehicleControl, WorldId, wire,
};
use tenancy::{Quotas, Visitor};
use worlds::NewWorld;

use crate::scenario::Profile;
use crate::session::table::{IdleTimes, Sessions};
use crate::session::{Contexts, SessionContext};
use crate::world_port::{Answer, CreatedWorld, DT_SECS, Sharing, WorldPort};

/// The default town.
pub(crate) fn map() -> Arc<roads::Map> {
    static MAP: LazyLock<Arc<roads::Map>> = LazyLock::new(|| {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        Arc::new(roads::Map::parse("Town10HD_Opt", &text).unwrap())
    });
    Arc::clone(&MAP)
}

/// Everything behind the sessions, over toy worlds.
pub(crate) fn context() -> (Arc<ToyWorlds>, Arc<SessionContext>) {
    let port = Arc::new(ToyWorlds::default());
    let shared = Arc::clone(&port) as Arc<dyn WorldPort>;
    let context = SessionContext::new(
        visitor().tenant,
        shared,
        "trolley_saves".to_owned(),
        Profile::Documented,
    );
    (port, Arc::new(context))
}

/// All sessions, of whatever tenants, over the worlds of one context.
pub(crate) fn sessions(context: &Arc<SessionContext>, max: u32, idle: IdleTimes) -> Arc<Sessions> {
    let port = Arc::clone(&context.port);
    let contexts = Contexts::new(visitor().tenant, Arc::clone(context), move |_| Arc::clone(&port));
    Arc::new(Sessions::new(contexts, max, idle))
}

/// Whoever comes where nobody is asked who it is.
pub(crate) fn visitor() -> Visitor {
    let tenant = "local".parse().unwrap();
    Visitor { tenant, token: None, quotas: Quotas::default() }
}

/// Worlds in which cars slide along their heading and brake at 9 m/s².
#[derive(Default)]
pub(crate) struct ToyWorlds {
    worlds: Mutex<BTreeMap<WorldId, Toy>>,
    next: Mutex<u64>,
    /// States that were told.
    pub(crate) saved: Mutex<Vec<Toy>>,
    /// Refuse to make worlds.
    pub(crate) full: AtomicBool,
    /// A state is never told.
    pub(crate) is_slow_to_save: AtomicBool,
    /// No world is made from a state.
    pub(crate) is_slow_to_restore: AtomicBool,
    /// As whom each request for ticks was asked.
    asked_by: Mutex<Vec<Option<String>>>,
    /// No picture can be drawn.
    pub(crate) blind: AtomicBool,
    /// Worlds should be elsewhere.
    pub(crate) drains: AtomicBool,
    /// Who shares the clocks of all worlds beside their owner.
    pub(crate) guests: Mutex<Vec<ServiceId>>,
    /// Whether one of them, or who has gone, had something done since the owner was told last.
    have_acted: AtomicBool,
    /// No state can be had.
    pub(crate) refuses_to_save: AtomicBool,
    /// What was opened to guests.
    pub(crate) sharings: Mutex<Vec<Sharing>>,
}

impl ToyWorlds {
    /// Worlds that exist.
    pub(crate) fn count(&self) -> usize {
        self.ids().len()
    }

    /// Which.
    pub(crate) fn ids(&self) -> Vec<WorldId> {
        self.worlds.lock().unwrap().keys().copied().collect()
    }

    /// The present tick of a world and what tells its state from others.
    pub(crate) fn look(&self, world: WorldId) -> Option<(Tick, u64)> {
        let worlds = self.worlds.lock().unwrap();
        worlds.get(&world).map(|toy| (toy.frame.tick, toy.frame.state_hash))
    }

    /// What tells one state of the oldest world from another.
    pub(crate) fn first_hash(&self) -> u64 {
        self.worlds.lock().unwrap().values().next().unwrap().frame.state_hash
    }

    /// As whom each request for ticks was asked.
    pub(crate) fn participants(&self) -> Vec<Option<String>> {
        self.asked_by.lock().unwrap().clone()
    }

    /// A guest changes all worlds.
    pub(crate) fn disturb(&self) {
        self.have_acted.store(true, Ordering::Relaxed);
        for toy in self.worlds.lock().unwrap().values_mut() {
            toy.frame.state_hash = toy.frame.state_hash.wrapping_mul(43);
        }
    }

    /// All worlds vanish, as when their service dies.
    pub(crate) fn crash(&self) {
        self.worlds.lock().unwrap().clear();
    }

    pub(crate) fn make(&self, new: &NewWorld) -> Result<CreatedWorld, Error> {
        if self.full.load(Ordering::Relaxed) {
            return Err(Error::new(ErrorCode::Capacity, "the service is full"));
        }
        let mut next = self.next.lock().unwrap();
        *next += 1;
        let world = WorldId::new(*next).unwrap();
        let mut toy = Toy::new(world, new.seed);
        let replies = new.commands.iter().map(|command| toy.apply(command)).collect();
        let frame = toy.encode();
        self.worlds.lock().unwrap().insert(world, toy);
        Ok(CreatedWorld { world, frame, replies })
    }

    pub(crate) fn end(&self, world: WorldId) -> Result<(), Error> {
        self.worlds.lock().unwrap().remove(&world).map(drop).ok_or_else(unknown)
    }

    pub(crate) fn copy(&self, world: WorldId) -> Result<WorldId, Error> {
        let mut next = self.next.lock().unwrap();
        let mut worlds = self.worlds.lock().unwrap();
        let toy = worlds.get(&world).ok_or_else(unknown)?.clone();
        *next += 1;
        let fork = WorldId::new(*next).unwrap();
        worlds.insert(fork, toy);
        Ok(fork)
    }

    /// A state is known by its number, wherever worlds are.
    pub(crate) fn save(&self, world: WorldId) -> Result<Vec<u8>, Error> {
        if self.refuses_to_save.load(Ordering::Relaxed) {
            return Err(Error::new(ErrorCode::TimedOut, "too busy"));
        }
        let toy = self.worlds.lock().unwrap().get(&world).ok_or_else(unknown)?.clone();
        let mut saved = self.saved.lock().unwrap();
        saved.push(toy);
        Ok((saved.len() - 1).to_le_bytes().to_vec())
    }

    pub(crate) fn load(&self, snapshot: &[u8]) -> Result<CreatedWorld, Error> {
        if self.full.load(Ordering::Relaxed) {
            return Err(Error::new(ErrorCode::Capacity, "the service is full"));
        }
        let index = usize::from_le_bytes(snapshot.try_into().unwrap());
        let toy = self.saved.lock().unwrap()[index].clone();
        let mut next = self.next.lock().unwrap();
        *next += 1;
        let world = WorldId::new(*next).unwrap();
        let frame = toy.encode();
        self.worlds.lock().unwrap().insert(world, toy);
        Ok(CreatedWorld { world, frame, replies: Vec::new() })
    }

    pub(crate) fn tick_one(&self, item: &TickItem) -> Result<TickOutcome, Error> {
        let mut worlds = self.worlds.lock().unwrap();
        let toy = worlds.get_mut(&item.world).ok_or_else(unknown)?;
        if item.expected_tick.is_some_and(|tick| tick != toy.frame.tick) {
            return Err(Error::new(ErrorCode::WrongTick, "another tick"));
        }
        let replies = item.commands.iter().map(|command| toy.apply(command)).collect();
        if item.tick_count > 0 {
            let name = item.participant.as_ref().map(ToString::to_string);
            self.asked_by.lock().unwrap().push(name);
        }
        let mut collisions = Vec::new();
        for _ in 0..item.tick_count {
            toy.tick();
            collisions.extend(toy.frame.collisions.iter().cloned());
        }
        let told = TickOutcome { replies, collisions, ..TickOutcome::new(toy.encode()) };
        if item.participant.is_none() {
            return Ok(told);
        }
        let guests = self.guests.lock().unwrap().clone();
        let is_changed_by_others = self.have_acted.swap(false, Ordering::Relaxed);
        Ok(TickOutcome { guests, is_changed_by_others, ..told })
    }
}

pub(crate) fn unknown() -> Error {
    Error::new(ErrorCode::UnknownWorld, "no such world")
}

#[derive(Clone)]
pub(crate) struct Toy {
    frame: Frame,
    lane_shift_m: f32,
}

impl Toy {
    fn new(world: WorldId, seed: u64) -> Self {
        let map = map();
        let map = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
        let frame = Frame { state_hash: seed, seed, ..Frame::empty(world, map) };
        Self { frame, lane_shift_m: 0.0 }
    }

    fn encode(&self) -> EncodedFrame {
        EncodedFrame(wire::encode_frame(&self.frame).0)
    }

    fn apply(&mut self, command: &Command) -> CommandReply {
        match command {
            Command::SpawnActor {
                blueprint,
                reference_from_actor: world_from_actor,
                linear_velocity_mps,
                ..
            } => {
                return Ok(Some(self.spawn(blueprint, *world_from_actor, *linear_velocity_mps)));
            }
            Command::Vehicle(VehicleCommand::Control { actor, control }) => {
                self.actor(*actor).control = *control
            }
            Command::Vehicle(VehicleCommand::Pilot { actor, mode, .. }) => {
                self.actor(*actor).control = VehicleControl::default();
                self.lane_shift_m = match mode {
                    PilotMode::ChangeLaneLeft => 3.5,
                    PilotMode::ChangeLaneRight => -3.5,
                    PilotMode::KeepLane => 0.0,
                };
            }
            Command::Agent(AgentCommand::SetRoute { places_m, .. }) => {
                if places_m.iter().any(|place_m| place_m.amax() > 1_000.0) {
                    return Err(Error::new(ErrorCode::InvalidArgument, "no lanes lead there"));
                }
                self.frame.state_hash = self.frame.state_hash.wrapping_mul(37);
            }
            Command::Agent(_) => self.frame.state_hash = self.frame.state_hash.wrapping_mul(41),
            _ => {}
        }
        Ok(None)
    }

    fn actor(&mut self, id: ActorId) -> &mut ActorState {
        self.frame.actors.iter_mut().find(|actor| actor.id == id).unwrap()
    }

    fn spawn(&mut self, blueprint: &str, pose: Pose, velocity_mps: Vec3) -> ActorId {
        let id = ActorId::new(self.frame.actors.len() as u32 + 1).unwrap();
        self.frame.types.push(blueprint.to_owned());
        let walks = blueprint.starts_with("walker.");
        let kind = if walks { ActorKind::Walker } else { ActorKind::Vehicle };
        self.frame.actors.push(ActorState {
            gear: 1,
            linear_velocity_mps: velocity_mps,
            box_half_extent_m: Vec3::new(2.45, 0.95, 0.75),
            ..ActorState::at_rest(id, kind, id.get() as u16 - 1, pose)
        });
        id
    }

    fn tick(&mut self) {
        let dt = DT_SECS as f32;
        let was_touching = touched(&self.frame);
        let shift_m = self.lane_shift_m.clamp(-0.2, 0.2);
        self.lane_shift_m -= shift_m;
        let ego = &mut self.frame.actors[0];
        let forward = ego.world_from_actor.rotation * Vec3::x();
        let left = ego.world_from_actor.rotation * Vec3::y();
        let change = 3.0 * ego.control.throttle - 9.0 * ego.control.brake;
        let speed_mps = (ego.linear_velocity_mps.norm() + change * dt).max(0.0);
        ego.linear_velocity_mps = forward * speed_mps;
        ego.world_from_actor.translation.vector += forward * (speed_mps * dt) + left * shift_m;
        self.frame.tick = Tick(self.frame.tick.0 + 1);
        self.frame.sim_secs = self.frame.tick.0 as f64 * DT_SECS;
        self.frame.state_hash = self.frame.state_hash.wrapping_mul(31).wrapping_add(1);
        let touching = touched(&self.frame);
        self.frame.collisions = touching
            .into_iter()
            .map(|other| Collision {
                actor: ActorId::new(1).unwrap(),
                other: Some(other),
                started: !was_touching.contains(&other),
                position_m: Vec3::zeros(),
                impulse_ns: Vec3::x(),
                closing_speed_mps: speed_mps,
            })
            .collect();
    }
}

/// Pedestrians inside the first actor's box.
fn touched(frame: &Frame) -> Vec<ActorId> {
    let ego = &frame.actors[0];
    let is_inside = |other: &&ActorState| {
        let at = ego.world_from_actor.inverse() * other.world_from_actor;
        at.translation.vector.x.abs() < 2.75 && at.translation.vector.y.abs() < 1.25
    };
    frame.actors.iter().skip(1).filter(is_inside).map(|other| other.id).collect()
}

impl WorldPort for ToyWorlds {
    fn snapshot(&self, world: WorldId) -> Answer<'_, Vec<u8>> {
        Box::pin(async move {
            if self.is_slow_to_save.load(Ordering::Relaxed) {
                std::future::pending::<()>().await;
            }
            self.save(world)
        })
    }

    fn restore(&self, snapshot: Vec<u8>) -> Answer<'_, CreatedWorld> {
        Box::pin(async move {
            if self.is_slow_to_restore.load(Ordering::Relaxed) {
                std::future::pending::<()>().await;
            }
            self.load(&snapshot)
        })
    }

    fn create(&self, new: NewWorld) -> Answer<'_, CreatedWorld> {
        Box::pin(async move { self.make(&new) })
    }

    fn destroy(&self, world: WorldId) -> Answer<'_, ()> {
        Box::pin(async move { self.end(world) })
    }

    fn fork(&self, world: WorldId) -> Answer<'_, WorldId> {
        Box::pin(async move { self.copy(world) })
    }

    fn share_clock(&self, sharing: Sharing) -> Answer<'_, ServiceId> {
        self.sharings.lock().unwrap().push(sharing);
        Box::pin(async { Ok("face".parse().unwrap()) })
    }

    fn should_move(&self, _: WorldId) -> bool {
        self.drains.load(Ordering::Relaxed)
    }

    fn is_gone(&self, world: WorldId) -> bool {
        !self.worlds.lock().unwrap().contains_key(&world)
    }

    fn owned(&self) -> Answer<'_, Vec<WorldId>> {
        Box::pin(async move { Ok(self.ids()) })
    }

    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>> {
        Box::pin(async move {
            let result =
                |item: &TickItem| TickResult { world: item.world, outcome: self.tick_one(item) };
            Ok(items.iter().map(result).collect())
        })
    }

    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Answer<'_, Vec<Image>> {
        Box::pin(async move {
            if self.blind.load(Ordering::Relaxed) {
                return Err(Error::new(ErrorCode::RendererUnavailable, "no renderer is up"));
            }
            let image = |camera: Camera| Image {
                camera: camera.id,
                width_px: camera.width_px,
                height_px: camera.height_px,
                kind: camera.kind,
                encoding: camera.encoding,
                data: frame.state_hash.to_le_bytes().to_vec(),
            };
            Ok(cameras.into_iter().map(image).collect())
        })
    }

    fn maps(&self) -> Answer<'_, Vec<MapRef>> {
        Box::pin(async move {
            let map = map();
            Ok(vec![MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() }])
        })
    }

    fn map_text(&self, _: String) -> Answer<'_, Vec<u8>> {
        Box::pin(async move { Ok(map().text().as_bytes().to_vec()) })
    }
}
