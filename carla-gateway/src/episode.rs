//! One world as clients see it: its map, its newest frame, and what is known of its actors.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use schemas::{
    ActorDescription, ActorId, ActorKind, ActorState, BonesChange, Pose, SharedFrame, WalkerPose,
    WorldId,
};

use crate::catalogue;
use crate::dialect::{Actor, ActorRef, ClientVersion};
use crate::navigation::Navigation;
use crate::pictures::{Film, TextureId};
use crate::rpc::Refusal;
use crate::snapshot::ReplayedLight;
use crate::stream::{StreamId, token};
use crate::wheels::{self, RollingOfAll};

/// The type of actors by which clients steer walkers.
const WALKER_CONTROLLER: &str = "controller.ai.walker";
/// Descriptions of actors that are gone are kept up to this number.
const GONE_MAX: usize = 256;

/// One episode.
pub(crate) struct Episode {
    version: ClientVersion,
    pub(crate) world: WorldId,
    pub(crate) map: Arc<roads::Map>,
    /// Whether the map has signs that tell speed limits.
    pub(crate) has_limit_signs: bool,
    /// For walkers.
    pub(crate) navigation: Arc<Navigation>,
    /// As clients name the map.
    pub(crate) map_name: String,
    /// The newest state.
    pub(crate) frame: SharedFrame,
    /// Who is otherwise by now: what clients changed since the frame, so that they read what they
    /// wrote.
    changed: BTreeMap<ActorId, ActorState>,
    /// As [`changed`](Self::changed): how walkers are posed.
    posed: BTreeMap<ActorId, WalkerPose>,
    pub(crate) spectator: Option<ActorId>,
    actors: BTreeMap<ActorId, Actor>,
    signals: BTreeMap<ActorId, String>,
    stream_of_actor: BTreeMap<ActorId, StreamId>,
    actor_of_stream: BTreeMap<StreamId, ActorId>,
    /// Of textures of cameras.
    texture_streams: BTreeMap<(ActorId, TextureId), StreamId>,
    /// Cameras whose textures clients switched on.
    textured: BTreeSet<ActorId>,
    /// Vehicles that sensors do not see, by sensor.
    ignored: BTreeMap<ActorId, Vec<ActorId>>,
    /// Actors whose physics clients switched off.
    unsimulated: BTreeSet<ActorId>,
    /// Angles at which clients hold wheels, by vehicle and wheel, in degrees.
    wheel_angles: BTreeMap<(ActorId, u8), WheelAngles>,
    /// How far wheels have turned under vehicles whose physics is on.
    rolling: RollingOfAll,
    /// What a replay says of traffic lights.
    replayed_lights: BTreeMap<ActorId, ReplayedLight>,
}

/// Angles at which a client holds a wheel, in degrees.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WheelAngles {
    pub(crate) steer: Option<f32>,
    pub(crate) pitch: Option<f32>,
}

impl Episode {
    /// An episode that knows none of its actors yet.
    pub(crate) fn new(
        world: WorldId,
        map: Arc<roads::Map>,
        map_name: String,
        frame: SharedFrame,
        version: ClientVersion,
    ) -> Self {
        let navigation = Arc::new(Navigation::new(Arc::clone(&map)));
        Self {
            version,
            world,
            has_limit_signs: map.has_speed_limit_signs(),
            map,
            navigation,
            map_name,
            frame,
            changed: BTreeMap::new(),
            posed: BTreeMap::new(),
            spectator: None,
            actors: BTreeMap::new(),
            signals: BTreeMap::new(),
            stream_of_actor: BTreeMap::new(),
            actor_of_stream: BTreeMap::new(),
            texture_streams: BTreeMap::new(),
            textured: BTreeSet::new(),
            ignored: BTreeMap::new(),
            unsimulated: BTreeSet::new(),
            wheel_angles: BTreeMap::new(),
            rolling: RollingOfAll::default(),
            replayed_lights: BTreeMap::new(),
        }
    }

    /// Goes on with a frame, in which all changes are.
    pub(crate) fn show(&mut self, frame: SharedFrame) {
        let dt_secs = (frame.sim_secs - self.frame.sim_secs).max(0.0) as f32;
        self.rolling.advance(&frame, dt_secs, |id| self.unsimulated.contains(id));
        self.frame = frame;
        self.changed.clear();
        self.posed.clear();
    }

    /// All actors, as clients changed them.
    pub(crate) fn states(&self) -> impl Iterator<Item = &ActorState> {
        self.frame.actors.iter().map(|state| self.changed.get(&state.id).unwrap_or(state))
    }

    /// Learns what an actor is. Gives `next_stream` if it is to be opened for it.
    pub(crate) fn learn(
        &mut self,
        described: &ActorDescription,
        next_stream: StreamId,
        stream_port: u16,
    ) -> Option<StreamId> {
        let mut actor = catalogue::actor(described, self.version);
        let id = described.id;
        let mut opened = None;
        if catalogue::has_stream(&described.blueprint) && self.version.knows(&described.blueprint) {
            let stream = *self.stream_of_actor.entry(id).or_insert_with(|| {
                opened = Some(next_stream);
                next_stream
            });
            self.actor_of_stream.insert(stream, id);
            actor.stream_token = token(stream, stream_port).to_vec();
        }
        if let Some(signal) = &described.signal {
            self.signals.insert(id, signal.clone());
        }
        self.actors.insert(id, actor);
        self.forget_the_gone();
        opened
    }

    fn forget_the_gone(&mut self) {
        if self.actors.len() > self.frame.actors.len() + GONE_MAX {
            let frame = &self.frame;
            self.actors.retain(|id, _| frame.actor(*id).is_some());
        }
    }

    /// Forgets an actor; gives its streams, which are to be closed.
    pub(crate) fn forget(&mut self, actor: ActorId) -> Vec<StreamId> {
        let streams: Vec<StreamId> = self.streams_of(actor).collect();
        self.actors.remove(&actor);
        self.signals.remove(&actor);
        self.stream_of_actor.remove(&actor);
        self.texture_streams.retain(|(camera, _), _| *camera != actor);
        self.textured.remove(&actor);
        self.ignored.remove(&actor);
        self.note_physics(actor, true);
        for stream in &streams {
            self.actor_of_stream.remove(stream);
        }
        streams
    }

    /// The own stream of an actor, and those of its textures.
    pub(crate) fn streams_of(&self, actor: ActorId) -> impl Iterator<Item = StreamId> {
        let textures = self.texture_streams.range(TextureId::of_camera(actor));
        self.stream(actor).into_iter().chain(textures.map(|(_, stream)| *stream))
    }

    /// How clients posed a walker, as of now.
    pub(crate) fn walker_pose(&self, walker: ActorId) -> Option<&WalkerPose> {
        self.posed.get(&walker).or_else(|| self.frame.walker_pose(walker))
    }

    /// Notes what the next frame will tell of the bones of a walker.
    pub(crate) fn note_bones(&mut self, walker: ActorId, change: &BonesChange) {
        let known = self.walker_pose(walker).cloned();
        let mut pose = known.unwrap_or_else(|| WalkerPose::none(walker));
        pose.change(change);
        self.posed.insert(walker, pose);
    }

    /// The stream of a camera's texture, which is `next` if it had none yet; `None` for what is no
    /// camera or no texture.
    pub(crate) fn texture_stream(
        &mut self,
        camera: ActorId,
        texture: TextureId,
        next: StreamId,
    ) -> Option<StreamId> {
        Film::of_texture(texture)?;
        let is_camera =
            self.actor(camera).is_some_and(|actor| Film::of(&actor.description.type_id).is_some());
        if !is_camera {
            return None;
        }
        let stream = *self.texture_streams.entry((camera, texture)).or_insert(next);
        self.actor_of_stream.insert(stream, camera);
        Some(stream)
    }

    /// Streams of the textures of a camera, and what they show.
    pub(crate) fn textures(&self, camera: ActorId) -> impl Iterator<Item = (StreamId, Film)> {
        let streams = self.texture_streams.range(TextureId::of_camera(camera));
        streams.filter_map(|((_, texture), stream)| Some((*stream, Film::of_texture(*texture)?)))
    }

    /// Remembers that a client switched the textures of a camera on or off.
    pub(crate) fn set_textured(&mut self, camera: ActorId, on: bool) {
        if on {
            self.textured.insert(camera);
        } else {
            self.textured.remove(&camera);
        }
    }

    /// Whether a client switched the textures of a camera on.
    pub(crate) fn is_textured(&self, camera: ActorId) -> bool {
        self.textured.contains(&camera)
    }

    /// Notes that the physics of an actor was switched: it takes its wheels back from clients.
    pub(crate) fn note_physics(&mut self, actor: ActorId, on: bool) {
        if on {
            self.unsimulated.remove(&actor);
            self.wheel_angles.retain(|(vehicle, _), _| *vehicle != actor);
        } else if self.state(actor).is_some() {
            self.unsimulated.insert(actor);
        }
    }

    /// How a wheel of a vehicle stands, as a client holds it or as it is driven: how far to the
    /// right it is steered, and how far it has turned backwards, both in degrees.
    pub(crate) fn wheel_deg(&self, vehicle: &ActorState, wheel: u8) -> (f32, f32) {
        let index = usize::from(wheel);
        let held = self.wheel_angles.get(&(vehicle.id, wheel)).copied().unwrap_or_default();
        let driven_deg = || {
            let model = wheels::model(self.frame.type_of(vehicle));
            let left_rad = |model| wheels::wheel_rad(model, index, vehicle.road_wheel_rad);
            -model.map_or(0.0, left_rad).to_degrees()
        };
        let rolled_deg = || self.rolling.rotation_deg(vehicle.id, index);
        (held.steer.unwrap_or_else(driven_deg), held.pitch.unwrap_or_else(rolled_deg))
    }

    /// How clients hold a wheel, to change it; `None` while its physics is on.
    pub(crate) fn wheel_angles_mut(
        &mut self,
        vehicle: ActorId,
        wheel: u8,
    ) -> Option<&mut WheelAngles> {
        let is_held = self.unsimulated.contains(&vehicle);
        is_held.then(|| self.wheel_angles.entry((vehicle, wheel)).or_default())
    }

    /// Remembers which vehicles a sensor does not see.
    pub(crate) fn set_ignored(&mut self, sensor: ActorId, vehicles: Vec<ActorId>) {
        self.ignored.insert(sensor, vehicles);
    }

    /// The vehicles that a sensor does not see.
    pub(crate) fn ignored(&self, sensor: ActorId) -> &[ActorId] {
        self.ignored.get(&sensor).map_or(&[], Vec::as_slice)
    }

    /// What is known of an actor.
    pub(crate) fn actor(&self, id: ActorId) -> Option<&Actor> {
        self.actors.get(&id)
    }

    /// Whether a client steers a walker.
    pub(crate) fn is_steered(&self, walker: ActorId) -> bool {
        let on_it = |actor: &&Actor| actor.parent_id.id() == Some(walker);
        let mut hanging = self.actors.values().filter(on_it);
        hanging.any(|actor| actor.description.type_id == WALKER_CONTROLLER)
    }

    /// The OpenDRIVE signal that a light or sign stands for.
    pub(crate) fn signal(&self, id: ActorId) -> Option<&str> {
        self.signals.get(&id).map(String::as_str)
    }

    /// What a replay says of a light.
    pub(crate) fn replayed_light(&self, id: ActorId) -> Option<ReplayedLight> {
        self.replayed_lights.get(&id).copied()
    }

    /// Tells clients of a light what a replay says, until
    /// [`release_lights`](Self::release_lights).
    pub(crate) fn replay_light(&mut self, id: ActorId, light: ReplayedLight) {
        self.replayed_lights.insert(id, light);
    }

    /// Clients see the lights of the world again.
    pub(crate) fn release_lights(&mut self) {
        self.replayed_lights.clear();
    }

    /// Where an actor's measurements go.
    pub(crate) fn stream(&self, actor: ActorId) -> Option<StreamId> {
        self.stream_of_actor.get(&actor).copied()
    }

    /// The sensor behind a stream.
    pub(crate) fn sensor(&self, stream: StreamId) -> Option<ActorId> {
        self.actor_of_stream.get(&stream).copied()
    }

    /// All streams of sensors.
    pub(crate) fn streams(&self) -> impl Iterator<Item = StreamId> {
        self.actor_of_stream.keys().copied()
    }

    /// The newest state of an actor.
    pub(crate) fn state(&self, id: ActorId) -> Option<&ActorState> {
        self.changed.get(&id).or_else(|| self.frame.actor(id))
    }

    /// The newest state of whom a client means.
    ///
    /// # Errors
    /// Nobody has the id.
    pub(crate) fn found(&self, id: ActorRef) -> Result<&ActorState, Refusal> {
        id.id().and_then(|actor| self.state(actor)).ok_or_else(|| id.unknown())
    }

    /// As [`found`](Self::found), of what has to be of a kind.
    ///
    /// # Errors
    /// Nobody has the id, or somebody else.
    pub(crate) fn found_as(&self, id: ActorRef, kind: ActorKind) -> Result<&ActorState, Refusal> {
        let state = self.found(id)?;
        if state.kind == kind { Ok(state) } else { Err(id.wrong_kind()) }
    }

    /// The id of whom a client means, if it is known what that is.
    ///
    /// # Errors
    /// Nobody has the id.
    pub(crate) fn known(&self, id: ActorRef) -> Result<ActorId, Refusal> {
        id.id().filter(|actor| self.actors.contains_key(actor)).ok_or_else(|| id.unknown())
    }

    /// The frame in which clients put an actor elsewhere: that of its parent, or the world.
    pub(crate) fn carrier(&self, state: &ActorState) -> Pose {
        let parent = state.parent.and_then(|parent| self.state(parent));
        parent.map_or_else(Pose::identity, |parent| parent.world_from_actor)
    }

    /// As [`state`](Self::state), to keep it true between ticks.
    pub(crate) fn state_mut(&mut self, id: ActorId) -> Option<&mut ActorState> {
        match self.changed.entry(id) {
            Entry::Occupied(changed) => Some(changed.into_mut()),
            Entry::Vacant(vacant) => Some(vacant.insert(self.frame.actor(id)?.clone())),
        }
    }

    /// Actors of the newest frame that nothing is known of.
    pub(crate) fn strangers(&self) -> Vec<ActorId> {
        let ids = self.frame.actors.iter().map(|actor| actor.id);
        ids.filter(|id| !self.actors.contains_key(id)).collect()
    }
}
