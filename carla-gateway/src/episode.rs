//! One world as clients see it: its map, its newest frame, and what is known of its actors.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use schemas::{ActorDescription, ActorId, ActorState, Frame, Pose, WorldId};

use crate::catalogue;
use crate::dialect::Actor;
use crate::navigation::Navigation;
use crate::pictures::Film;
use crate::skeleton::Custom;
use crate::stream::token;

/// The type of actors by which clients steer walkers.
const WALKER_CONTROLLER: &str = "controller.ai.walker";
/// Descriptions of actors that are gone are kept up to this number.
const GONE_MAX: usize = 256;

/// One episode.
pub(crate) struct Episode {
    pub(crate) world: WorldId,
    pub(crate) map: Arc<roads::Map>,
    /// For walkers.
    pub(crate) navigation: Arc<Navigation>,
    /// As clients name the map.
    pub(crate) map_name: String,
    /// The newest state; kept true while commands change it between ticks.
    pub(crate) frame: Frame,
    pub(crate) spectator: Option<ActorId>,
    actors: BTreeMap<u32, Actor>,
    signals: BTreeMap<u32, String>,
    stream_of_actor: BTreeMap<u32, u32>,
    actor_of_stream: BTreeMap<u32, u32>,
    /// Of textures of cameras, by camera and CARLA's number.
    texture_streams: BTreeMap<(u32, u32), u32>,
    /// Cameras whose textures clients switched on.
    textured: BTreeSet<u32>,
    /// Vehicles that sensors do not see, by sensor.
    ignored: BTreeMap<u32, Vec<ActorId>>,
    /// Poses that clients made, by walker.
    custom_poses: BTreeMap<u32, Custom>,
    /// Actors whose physics clients switched off.
    unsimulated: BTreeSet<u32>,
    /// Angles at which clients hold wheels, by vehicle and wheel, in degrees.
    wheel_angles: BTreeMap<(u32, u8), WheelAngles>,
}

/// Angles at which a client holds a wheel, in degrees.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WheelAngles {
    pub(crate) steer: Option<f32>,
    pub(crate) pitch: f32,
}

impl Episode {
    /// An episode that knows none of its actors yet.
    pub(crate) fn new(
        world: WorldId,
        map: Arc<roads::Map>,
        map_name: String,
        frame: Frame,
    ) -> Self {
        let navigation = Arc::new(Navigation::new(Arc::clone(&map)));
        Self {
            world,
            map,
            navigation,
            map_name,
            frame,
            spectator: None,
            actors: BTreeMap::new(),
            signals: BTreeMap::new(),
            stream_of_actor: BTreeMap::new(),
            actor_of_stream: BTreeMap::new(),
            texture_streams: BTreeMap::new(),
            textured: BTreeSet::new(),
            ignored: BTreeMap::new(),
            custom_poses: BTreeMap::new(),
            unsimulated: BTreeSet::new(),
            wheel_angles: BTreeMap::new(),
        }
    }

    /// Learns what an actor is. Gives the stream that is to be opened for it, with `next_stream`.
    pub(crate) fn learn(
        &mut self,
        described: &ActorDescription,
        next_stream: &mut u32,
        stream_port: u16,
    ) -> Option<u32> {
        let mut actor = catalogue::actor(described);
        let id = actor.id;
        let mut opened = None;
        if catalogue::has_stream(&described.blueprint) {
            let stream = *self.stream_of_actor.entry(id).or_insert_with(|| {
                *next_stream += 1;
                opened = Some(*next_stream);
                *next_stream
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
            self.actors
                .retain(|id, _| ActorId::new(*id).is_some_and(|id| frame.actor(id).is_some()));
        }
    }

    /// Forgets an actor; gives its streams, which are to be closed.
    pub(crate) fn forget(&mut self, actor: u32) -> Vec<u32> {
        let streams: Vec<u32> = self.streams_of(actor).collect();
        self.actors.remove(&actor);
        self.signals.remove(&actor);
        self.stream_of_actor.remove(&actor);
        self.texture_streams.retain(|(camera, _), _| *camera != actor);
        self.textured.remove(&actor);
        self.ignored.remove(&actor);
        self.custom_poses.remove(&actor);
        self.note_physics(actor, true);
        for stream in &streams {
            self.actor_of_stream.remove(stream);
        }
        streams
    }

    /// The own stream of an actor, and those of its textures.
    pub(crate) fn streams_of(&self, actor: u32) -> impl Iterator<Item = u32> {
        let textures = self.texture_streams.range((actor, 0)..=(actor, u32::MAX));
        self.stream(actor).into_iter().chain(textures.map(|(_, stream)| *stream))
    }

    /// The pose that a client made for a walker.
    pub(crate) fn custom_pose(&self, walker: u32) -> Option<&Custom> {
        self.custom_poses.get(&walker)
    }

    /// As [`custom_pose`](Self::custom_pose), begun where there was none.
    pub(crate) fn custom_pose_mut(&mut self, walker: u32) -> &mut Custom {
        self.custom_poses.entry(walker).or_default()
    }

    /// The stream of a camera's texture, which is `next` if it had none yet; `None` for what is no
    /// camera or no texture.
    pub(crate) fn texture_stream(&mut self, camera: u32, number: u32, next: u32) -> Option<u32> {
        Film::of_texture(number)?;
        let is_camera =
            self.actor(camera).is_some_and(|actor| Film::of(&actor.description.type_id).is_some());
        if !is_camera {
            return None;
        }
        let stream = *self.texture_streams.entry((camera, number)).or_insert(next);
        self.actor_of_stream.insert(stream, camera);
        Some(stream)
    }

    /// Streams of the textures of a camera, and what they show.
    pub(crate) fn textures(&self, camera: u32) -> impl Iterator<Item = (u32, Film)> {
        let streams = self.texture_streams.range((camera, 0)..=(camera, u32::MAX));
        streams.filter_map(|((_, number), stream)| Some((*stream, Film::of_texture(*number)?)))
    }

    /// Remembers that a client switched the textures of a camera on or off.
    pub(crate) fn set_textured(&mut self, camera: u32, on: bool) {
        if on {
            self.textured.insert(camera);
        } else {
            self.textured.remove(&camera);
        }
    }

    /// Whether a client switched the textures of a camera on.
    pub(crate) fn is_textured(&self, camera: u32) -> bool {
        self.textured.contains(&camera)
    }

    /// Notes that the physics of an actor was switched: it takes its wheels back from clients.
    pub(crate) fn note_physics(&mut self, actor: u32, on: bool) {
        if on {
            self.unsimulated.remove(&actor);
            self.wheel_angles.retain(|(vehicle, _), _| *vehicle != actor);
        } else if self.state(actor).is_some() {
            self.unsimulated.insert(actor);
        }
    }

    /// How clients hold a wheel.
    pub(crate) fn wheel_angles(&self, vehicle: u32, wheel: u8) -> WheelAngles {
        self.wheel_angles.get(&(vehicle, wheel)).copied().unwrap_or_default()
    }

    /// As [`wheel_angles`](Self::wheel_angles), to change it; `None` while its physics is on.
    pub(crate) fn wheel_angles_mut(&mut self, vehicle: u32, wheel: u8) -> Option<&mut WheelAngles> {
        let is_held = self.unsimulated.contains(&vehicle);
        is_held.then(|| self.wheel_angles.entry((vehicle, wheel)).or_default())
    }

    /// Remembers which vehicles a sensor does not see.
    pub(crate) fn set_ignored(&mut self, sensor: u32, vehicles: Vec<ActorId>) {
        self.ignored.insert(sensor, vehicles);
    }

    /// The vehicles that a sensor does not see.
    pub(crate) fn ignored(&self, sensor: u32) -> &[ActorId] {
        self.ignored.get(&sensor).map_or(&[], Vec::as_slice)
    }

    /// What is known of an actor.
    pub(crate) fn actor(&self, id: u32) -> Option<&Actor> {
        self.actors.get(&id)
    }

    /// Whether a client steers a walker.
    pub(crate) fn is_steered(&self, walker: u32) -> bool {
        let mut hanging = self.actors.values().filter(|actor| actor.parent_id == walker);
        hanging.any(|actor| actor.description.type_id == WALKER_CONTROLLER)
    }

    /// The OpenDRIVE signal that a light or sign stands for.
    pub(crate) fn signal(&self, id: u32) -> Option<&str> {
        self.signals.get(&id).map(String::as_str)
    }

    /// Where an actor's measurements go.
    pub(crate) fn stream(&self, actor: u32) -> Option<u32> {
        self.stream_of_actor.get(&actor).copied()
    }

    /// The sensor behind a stream.
    pub(crate) fn sensor(&self, stream: u32) -> Option<ActorId> {
        self.actor_of_stream.get(&stream).and_then(|id| ActorId::new(*id))
    }

    /// All streams of sensors.
    pub(crate) fn streams(&self) -> impl Iterator<Item = u32> {
        self.actor_of_stream.keys().copied()
    }

    /// The newest state of an actor.
    pub(crate) fn state(&self, id: u32) -> Option<&ActorState> {
        self.frame.actor(ActorId::new(id)?)
    }

    /// The frame in which clients put an actor elsewhere: that of its parent, or the world.
    pub(crate) fn carrier(&self, state: &ActorState) -> Pose {
        let parent = state.parent.and_then(|parent| self.frame.actor(parent));
        parent.map_or_else(Pose::identity, |parent| parent.world_from_actor)
    }

    /// As [`state`](Self::state), to keep it true between ticks.
    pub(crate) fn state_mut(&mut self, id: u32) -> Option<&mut ActorState> {
        let id = ActorId::new(id)?;
        let at = self.frame.actors.binary_search_by_key(&id, |actor| actor.id).ok()?;
        self.frame.actors.get_mut(at)
    }

    /// Actors of the newest frame that nothing is known of.
    pub(crate) fn strangers(&self) -> Vec<ActorId> {
        let ids = self.frame.actors.iter().map(|actor| actor.id);
        ids.filter(|id| !self.actors.contains_key(&id.get())).collect()
    }
}
