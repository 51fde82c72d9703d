//! Frames of a log, rebuilt from what CARLA's format says: poses in whole hundredths, no state that
//! a world could go on from.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use recording::{Add, Class, Packet, Position, Reader, Vector};
use schemas::carla::{RotationDeg, mirror_y, pose_from_transform};
use schemas::{
    ActorId, ActorKind, ActorState, Collision, Frame, MapRef, Pose, Tick, TrafficLightColour,
    TrafficLightState, Vec3, VehicleControl, WorldId,
};

use super::RecordError;
use super::played::EGO_ROLES;

/// Logs have lengths in centimetres.
const CM_PER_M: f32 = 100.0;
/// Half sizes of those whose box a log does not tell, as it does with additional data.
const CAR_HALF_M: Vec3 = Vec3::new(2.3, 0.95, 0.75);
const WALKER_HALF_M: Vec3 = Vec3::new(0.3, 0.3, 0.9);

/// The frames of one log, one after the other.
pub(super) struct Rebuilt {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    frame: Frame,
    hero: Option<ActorId>,
    parents: BTreeMap<u32, u32>,
}

impl Rebuilt {
    pub(super) fn new(path: &Path, reader: Reader<BufReader<File>>, map: &roads::Map) -> Self {
        let map = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
        let id = WorldId::of_host(0, 1);
        let (frame, parents) = (Frame::empty(id, map), BTreeMap::new());
        Self { path: path.to_owned(), reader, frame, hero: None, parents }
    }

    /// The hero among those who came so far.
    pub(super) fn hero(&self) -> Option<ActorId> {
        self.hero
    }

    /// The next frame; `None` at the end or where the log is cut.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn next(&mut self) -> Result<Option<Frame>, RecordError> {
        let refused = |cause| RecordError::Open { path: self.path.clone(), cause };
        let Some(frame) = self.reader.next_frame().map_err(refused)? else { return Ok(None) };
        let start = frame.start.clone();
        let packets: Vec<Packet> =
            frame.packets().filter_map(|packet| packet.decode().ok()).collect();
        let before_secs = self.frame.sim_secs;
        self.frame.tick = Tick(start.number);
        self.frame.sim_secs = start.elapsed_secs;
        self.frame.dt_secs = (start.elapsed_secs - before_secs).max(0.0);
        self.frame.collisions.clear();
        packets.iter().for_each(|packet| self.note(packet));
        Ok(Some(self.frame.clone()))
    }

    fn note(&mut self, packet: &Packet) {
        match packet {
            Packet::Adds(adds) => adds.iter().for_each(|add| self.add(add)),
            Packet::Destroys(gone) => {
                let is_gone = |id: ActorId| gone.iter().any(|one| one.id == id.get());
                self.frame.actors.retain(|actor| !is_gone(actor.id));
                self.frame.traffic_lights.retain(|light| !is_gone(light.actor));
            }
            Packet::Parents(parents) => {
                self.parents.extend(parents.iter().map(|one| (one.child, one.parent)));
                for one in parents {
                    if let Some(actor) = self.actor(one.child) {
                        actor.parent = ActorId::new(one.parent);
                    }
                }
            }
            Packet::Positions(all) => self.place(all),
            Packet::Kinematics(all) => {
                for one in all {
                    if let Some(actor) = self.actor(one.id) {
                        actor.linear_velocity_mps = ours(one.linear_velocity);
                        let [x, y, z] = ours(one.angular_velocity).map(f32::to_radians).into();
                        // Turns about mirrored axes go the other way round.
                        actor.angular_velocity_radps = -Vec3::new(x, y, z);
                    }
                }
            }
            Packet::BoundingBoxes(all) => {
                for one in all {
                    if let Some(actor) = self.actor(one.id) {
                        actor.box_centre_m = ours(one.origin) / CM_PER_M;
                        actor.box_half_extent_m = ours(one.extent).abs() / CM_PER_M;
                    }
                }
            }
            Packet::VehicleControls(all) => {
                for one in all {
                    let Some(actor) = self.actor(one.id) else { continue };
                    let (throttle, steer, brake) = (one.throttle, -one.steer, one.brake);
                    let hand_brake = one.hand_brake;
                    let gear = one.gear.clamp(-1, 127) as i8;
                    let control =
                        VehicleControl { throttle, steer, brake, hand_brake, ..actor.control };
                    (actor.control, actor.gear) = (control, gear);
                }
            }
            Packet::LightStates(all) => {
                self.frame.traffic_lights = all.iter().filter_map(light).collect();
            }
            Packet::Collisions(all) => {
                let met = all.iter().filter_map(|one| {
                    let other = ActorId::new(one.id2).filter(|id| id.get() != u32::MAX);
                    Some((ActorId::new(one.id1)?, other))
                });
                let met: Vec<_> = met.collect();
                self.frame.collisions = met.into_iter().map(|met| self.collision(met)).collect();
            }
            _ => {}
        }
    }

    fn add(&mut self, add: &Add) {
        let Some(id) = ActorId::new(add.id) else { return };
        let kind = match add.class {
            Class::VEHICLE => ActorKind::Vehicle,
            Class::WALKER => ActorKind::Walker,
            Class::TRAFFIC_LIGHT => ActorKind::TrafficLight,
            Class::TRAFFIC_SIGN => ActorKind::TrafficSign,
            Class::SENSOR => ActorKind::Sensor,
            _ if add.blueprint.starts_with("static.prop") => ActorKind::Prop,
            _ => ActorKind::Marker,
        };
        let types = &mut self.frame.types;
        let at = types.iter().position(|name| *name == add.blueprint).unwrap_or_else(|| {
            types.push(add.blueprint.clone());
            types.len() - 1
        });
        let place =
            pose_of(add.location, [add.rotation.roll, add.rotation.pitch, add.rotation.yaw]);
        let mut state = ActorState::at_rest(id, kind, at.min(usize::from(u16::MAX)) as u16, place);
        if kind == ActorKind::Vehicle {
            state.box_half_extent_m = CAR_HALF_M;
            state.box_centre_m = Vec3::new(0.0, 0.0, CAR_HALF_M.z);
        } else if kind == ActorKind::Walker {
            state.box_half_extent_m = WALKER_HALF_M;
        }
        for attribute in &add.attributes {
            match attribute.name.as_str() {
                "color" => state.colour_rgb = colour(&attribute.value).unwrap_or(0),
                "role_name" if EGO_ROLES.contains(&attribute.value.as_str()) => {
                    self.hero.get_or_insert(id);
                }
                _ => {}
            }
        }
        match self.frame.actors.binary_search_by_key(&id, |actor| actor.id) {
            Ok(at) => self.frame.actors[at] = state,
            Err(at) => self.frame.actors.insert(at, state),
        }
    }

    fn place(&mut self, all: &[Position]) {
        let dt_secs = self.frame.dt_secs as f32;
        for one in all {
            let rotation = [one.rotation.roll, one.rotation.pitch, one.rotation.yaw];
            let place = pose_of(one.location, rotation);
            let Some(actor) = self.actor(one.id) else { continue };
            let way_m = place.translation.vector - actor.world_from_actor.translation.vector;
            let velocity_mps = if dt_secs > 0.0 { way_m / dt_secs } else { Vec3::zeros() };
            actor.world_from_actor = place;
            // Velocities of the log, which are told later in the frame, count more.
            actor.linear_velocity_mps = velocity_mps;
        }
    }

    fn collision(&self, (actor, other): (ActorId, Option<ActorId>)) -> Collision {
        let place = self.frame.actor(actor).map(|actor| actor.world_from_actor);
        Collision {
            actor,
            other,
            started: true,
            position_m: place.map_or(Vec3::zeros(), |place| place.translation.vector),
            impulse_ns: Vec3::zeros(),
            closing_speed_mps: 0.0,
        }
    }

    fn actor(&mut self, id: u32) -> Option<&mut ActorState> {
        let id = ActorId::new(id)?;
        let at = self.frame.actors.binary_search_by_key(&id, |actor| actor.id).ok()?;
        self.frame.actors.get_mut(at)
    }
}

fn ours(of: Vector) -> Vec3 {
    mirror_y(Vec3::new(of.x, of.y, of.z))
}

fn pose_of(location: Vector, [roll, pitch, yaw]: [f32; 3]) -> Pose {
    let place_m = Vec3::new(location.x, location.y, location.z) / CM_PER_M;
    pose_from_transform(place_m, RotationDeg { pitch, yaw, roll })
}

fn light(state: &recording::LightState) -> Option<TrafficLightState> {
    let colour = match state.state {
        0 => TrafficLightColour::Red,
        1 => TrafficLightColour::Yellow,
        2 => TrafficLightColour::Green,
        3 => TrafficLightColour::Off,
        _ => TrafficLightColour::Unknown,
    };
    Some(TrafficLightState {
        actor: ActorId::new(state.id)?,
        colour,
        group: 0,
        frozen: state.is_frozen,
        elapsed_secs: state.elapsed_secs,
        green_secs: 0.0,
        yellow_secs: 0.0,
        red_secs: 0.0,
    })
}

/// Of the text `r,g,b`.
fn colour(text: &str) -> Option<u32> {
    let parts: Vec<u8> =
        text.split(',').map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
    let [r, g, b] = parts[..] else { return None };
    Some(u32::from_be_bytes([0, r, g, b]))
}
