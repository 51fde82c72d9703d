//! What a recording has of a frame.

mod poses;

use std::collections::BTreeMap;

use blueprints::VehicleModel;
use recording::{
    Add, Additional, Attribute, Collision, Destroy, Door, FrameContent, LightState, LightTimes,
    Packet, Parent, PhysicsControl, SceneLight,
};
use schemas::{ActorId, ActorKind, ActorState, Frame, SharedFrame, TrafficLightState};

use super::arrivals::Arrival;
use crate::catalogue;
use crate::dialect::{ActorDescription, LightState as Lamp, WeatherParameters};
use crate::snapshot::colour_index;
use crate::wheels::{self, Rolling};

/// The type of sensors whose contacts are recorded.
const COLLISION_SENSOR: &str = "sensor.other.collision";
/// Doors of a vehicle, as CARLA counts them.
const DOORS: u8 = 6;

/// What there is to record of a frame.
#[derive(Debug)]
pub(super) struct Shot {
    pub(super) frame: SharedFrame,
    pub(super) arrivals: Vec<Arrival>,
    /// All of them, if some were changed.
    pub(super) lamps: Option<Vec<Lamp>>,
    pub(super) weather: WeatherParameters,
    /// `None` without additional data.
    pub(super) additional: Option<Further>,
    /// Of the journal beside it.
    pub(super) foreign: Vec<Packet>,
}

/// What there is to record of a frame with additional data.
#[derive(Debug)]
pub(super) struct Further {
    /// Since the recording began.
    pub(super) platform_secs: f64,
    /// Of vehicles that were inspected.
    pub(super) physics: Vec<PhysicsControl>,
}

/// What earlier frames of a recording said.
#[derive(Default)]
pub(super) struct Notes {
    first_secs: Option<f64>,
    /// The actors of the newest frame, in its order, which is that of their ids.
    known: Vec<Known>,
    light_times: BTreeMap<ActorId, [f32; 3]>,
    lamps: BTreeMap<u32, Lamp>,
    weather: Option<WeatherParameters>,
    collisions: u32,
}

/// What earlier frames said of one actor.
struct Known {
    id: ActorId,
    /// Whether the newest frame is its first one.
    is_new: bool,
    is_hero: bool,
    carrier: Option<ActorId>,
    doors: u8,
    /// How far wheels have turned.
    rolling: Rolling,
    /// Of a vehicle.
    model: Option<&'static VehicleModel>,
}

impl Known {
    fn new(frame: &Frame, actor: &ActorState) -> Self {
        let is_vehicle = actor.kind == ActorKind::Vehicle;
        Self {
            id: actor.id,
            is_new: true,
            is_hero: false,
            carrier: None,
            doors: 0,
            rolling: Rolling::default(),
            model: is_vehicle.then(|| wheels::model(frame.type_of(actor))).flatten(),
        }
    }
}

impl Notes {
    /// All that a recording has of a frame.
    pub(super) fn content(&mut self, shot: Shot) -> FrameContent {
        let Shot { frame, arrivals, lamps, weather, additional, foreign } = shot;
        let is_first = self.first_secs.is_none();
        let first_secs = *self.first_secs.get_or_insert(frame.sim_secs);
        let destroys = self.meet(&frame);
        let mut content = FrameContent {
            elapsed_secs: frame.sim_secs - first_secs,
            visual_secs: frame.sim_secs,
            adds: self.adds(&frame, &arrivals, is_first),
            destroys,
            parents: self.parents(&frame),
            collisions: self.collisions(&frame),
            doors: self.doors(&frame),
            light_states: lights(&frame).map(light_state).collect(),
            scene_lights: self.scene_lights(lamps.unwrap_or_default()),
            weather: self.weather(&weather),
            additional: additional.map(|further| self.additional(&frame, further)),
            foreign,
            ..FrameContent::default()
        };
        self.put_motion(&mut content, &frame);
        content
    }

    /// Goes on to the actors of a frame; gives those who are gone.
    fn meet(&mut self, frame: &Frame) -> Vec<Destroy> {
        let ids = || frame.actors.iter().map(|actor| actor.id);
        if self.known.iter().map(|one| one.id).eq(ids()) {
            self.known.iter_mut().for_each(|one| one.is_new = false);
            return Vec::new();
        }
        let mut gone = Vec::new();
        let mut before = std::mem::take(&mut self.known).into_iter().peekable();
        for actor in &frame.actors {
            while let Some(one) = before.next_if(|one| one.id < actor.id) {
                gone.push(one.id);
            }
            let same = before.next_if(|one| one.id == actor.id);
            self.known.push(match same {
                Some(one) => Known { is_new: false, ..one },
                None => Known::new(frame, actor),
            });
        }
        gone.extend(before.map(|one| one.id));
        self.light_times.retain(|id, _| !gone.contains(id));
        gone.into_iter().map(|id| Destroy { id: id.get() }).collect()
    }

    /// The actors of the newest frame, each with what is known of it.
    fn all<'a>(
        &'a mut self,
        frame: &'a Frame,
    ) -> impl Iterator<Item = (&'a ActorState, &'a mut Known)> {
        frame.actors.iter().zip(&mut self.known)
    }

    fn new_actors<'a>(&'a self, frame: &'a Frame) -> impl Iterator<Item = &'a ActorState> {
        let all = frame.actors.iter().zip(&self.known);
        all.filter(|(_, known)| known.is_new).map(|(actor, _)| actor)
    }

    fn is_hero(&self, id: ActorId) -> bool {
        let at = self.known.binary_search_by_key(&id, |one| one.id);
        at.is_ok_and(|at| self.known[at].is_hero)
    }

    /// Who is new. As in CARLA, what is attached while recording has its place on its carrier, all
    /// that was there before one in the world.
    fn adds(&mut self, frame: &Frame, arrivals: &[Arrival], is_first: bool) -> Vec<Add> {
        let mut adds = Vec::with_capacity(arrivals.len());
        for Arrival { id, description, place } in arrivals {
            let Ok(at) = frame.actors.binary_search_by_key(id, |actor| actor.id) else { continue };
            let actor = &frame.actors[at];
            let role = description.as_ref().and_then(|known| known.text("role_name"));
            self.known[at].is_hero = role == Some("hero");
            let place = if is_first { &place.in_world } else { &place.on_carrier };
            let (location, rotation) = poses::in_file(place);
            adds.push(Add {
                id: id.get(),
                class: poses::class_of(actor.kind),
                location,
                rotation,
                uid: description.as_ref().map_or(0, |known| known.uid),
                blueprint: frame.type_of(actor).to_owned(),
                attributes: description.as_ref().map_or_else(Vec::new, attributes),
            });
        }
        adds
    }

    fn parents(&mut self, frame: &Frame) -> Vec<Parent> {
        let attached = self.all(frame).filter_map(|(actor, known)| {
            let before = std::mem::replace(&mut known.carrier, actor.parent);
            let parent = actor.parent.filter(|parent| before != Some(*parent))?;
            Some(Parent { child: actor.id.get(), parent: parent.get() })
        });
        attached.collect()
    }

    /// Contacts of those who carry a collision sensor, from their side.
    fn collisions(&mut self, frame: &Frame) -> Vec<Collision> {
        if frame.collisions.is_empty() {
            return Vec::new();
        }
        let is_sensor = |actor: &&ActorState| {
            actor.kind == ActorKind::Sensor && frame.type_of(actor) == COLLISION_SENSOR
        };
        let sensors = frame.actors.iter().filter(is_sensor);
        let carriers: Vec<ActorId> = sensors.filter_map(|sensor| sensor.parent).collect();
        let mut told = Vec::new();
        for collision in &frame.collisions {
            let (one, other) = (Some(collision.actor), collision.other);
            for (carrier, met) in [(one, other), (other, one)] {
                let Some(id) = carrier.filter(|id| carriers.contains(id)) else { continue };
                told.push(Collision {
                    serial: self.collisions,
                    id1: id.get(),
                    id2: met.map_or(Collision::NO_ACTOR, ActorId::get),
                    is_hero1: self.is_hero(id),
                    is_hero2: met.is_some_and(|id| self.is_hero(id)),
                });
                self.collisions = self.collisions.wrapping_add(1);
            }
        }
        told
    }

    /// Doors that were opened or closed.
    fn doors(&mut self, frame: &Frame) -> Vec<Door> {
        let mut changed = Vec::new();
        for (vehicle, known) in self.all(frame) {
            let before = std::mem::replace(&mut known.doors, vehicle.doors);
            let differs = |door: &u8| (before ^ vehicle.doors) & (1 << door) != 0;
            changed.extend((0..DOORS).filter(differs).map(|door| Door {
                id: vehicle.id.get(),
                door,
                is_open: vehicle.doors & (1 << door) != 0,
            }));
        }
        changed
    }

    /// All lamps in the first frame, later those that changed.
    fn scene_lights(&mut self, lamps: Vec<Lamp>) -> Vec<SceneLight> {
        let mut changed = Vec::new();
        for lamp in lamps {
            if self.lamps.get(&lamp.id) != Some(&lamp) {
                changed.push(lamp.recorded());
                self.lamps.insert(lamp.id, lamp);
            }
        }
        changed
    }

    fn weather(&mut self, weather: &WeatherParameters) -> Option<recording::Weather> {
        let is_new = self.weather.replace(*weather) != Some(*weather);
        is_new.then(|| weather.recorded())
    }

    fn additional(&mut self, frame: &Frame, further: Further) -> Additional {
        let is_sign = |kind| matches!(kind, ActorKind::TrafficLight | ActorKind::TrafficSign);
        let has_volume = |actor: &&ActorState| {
            is_sign(actor.kind) && actor.box_half_extent_m.norm_squared() > 0.0
        };
        let volumes = self.new_actors(frame).filter(has_volume).map(poses::volume_of);
        let boxes = self.new_actors(frame).filter(|actor| !has_volume(actor)).map(poses::box_of);
        Additional {
            kinematics: frame.actors.iter().filter_map(poses::kinematics_of).collect(),
            bounding_boxes: boxes.collect(),
            trigger_volumes: volumes.collect(),
            platform_secs: further.platform_secs,
            physics: further.physics,
            bones: poses::bones_of(frame),
            light_times: self.light_times(frame),
        }
    }

    /// Times of lights that are new or were changed.
    fn light_times(&mut self, frame: &Frame) -> Vec<LightTimes> {
        let mut changed = Vec::new();
        for light in lights(frame) {
            let times = [light.green_secs, light.yellow_secs, light.red_secs];
            if self.light_times.insert(light.actor, times) != Some(times) {
                let [green_secs, yellow_secs, red_secs] = times;
                let id = light.actor.get();
                changed.push(LightTimes { id, green_secs, yellow_secs, red_secs });
            }
        }
        changed
    }
}

fn attributes(description: &ActorDescription) -> Vec<Attribute> {
    let told = description.attributes.iter().filter(|attribute| !attribute.id.is_empty());
    let one = |attribute: &crate::dialect::AttributeValue| Attribute {
        kind: catalogue::recorded_kind(&description.type_id, &attribute.id),
        name: attribute.id.clone(),
        value: attribute.value.clone(),
    };
    told.map(one).collect()
}

/// Those that were not destroyed.
fn lights(frame: &Frame) -> impl Iterator<Item = &TrafficLightState> {
    frame.traffic_lights.iter().filter(|light| frame.actor(light.actor).is_some())
}

fn light_state(light: &TrafficLightState) -> LightState {
    LightState {
        id: light.actor.get(),
        is_frozen: light.frozen,
        elapsed_secs: light.elapsed_secs,
        state: colour_index(light.colour),
    }
}
