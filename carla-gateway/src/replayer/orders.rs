//! What a recording says, as commands.

use std::collections::{BTreeMap, BTreeSet};

use recording::{
    Add, Bones, Class, Kinematics, Packet, Position, Rotation, Vector, VehicleControl as Control,
};
use schemas::{
    ActorId, AgentBehaviour, BodyCommand, BodySwitch, BonesChange, Command, Pose, TrafficCommand,
    TrafficLightCommand, Vec3, VehicleCommand, VehicleControl, WalkerCommand, WalkerControl,
    limits,
};

use super::cast::{Cast, Member};
use crate::dialect::{Transform, Vector3D, WeatherParameters, spin_from_deg};
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;
use crate::skeleton;
use crate::snapshot::ReplayedLight;
use crate::snapshot::{colour_index, colour_of};

/// Recordings have lengths in centimetres.
const CM_PER_M: f32 = 100.0;
/// The door that is all of them.
const ALL_DOORS: u8 = 6;

/// What was said last, so that nothing is said twice.
#[derive(Default)]
pub(super) struct Said {
    controls: BTreeMap<u32, Control>,
    lights: BTreeMap<u32, u32>,
    /// In metres per second.
    walkers: BTreeMap<u32, f32>,
    /// Walkers in the world whose limbs are held.
    pub(super) posed: BTreeSet<ActorId>,
}

impl Said {
    /// In metres per second.
    pub(super) fn walker_speed(&self, id: u32) -> f32 {
        self.walkers.get(&id).copied().unwrap_or_default()
    }
}

/// A pose of a recording in our axes.
pub(super) fn pose_at(location: Vector, rotation: Rotation) -> Pose {
    let Vector { x, y, z } = location;
    let [x, y, z] = [x, y, z].map(|number| number / CM_PER_M);
    let Rotation { roll, pitch, yaw } = rotation;
    let rotation = crate::dialect::Rotation { pitch, yaw, roll };
    Transform { location: Vector3D { x, y, z }, rotation }.ours()
}

pub(super) fn pose_of(position: &Position) -> Pose {
    pose_at(position.location, position.rotation)
}

fn is_finite(pose: &Pose) -> bool {
    pose.to_homogeneous().iter().all(|number| number.is_finite())
}

/// Where a recorded actor came, in centimetres.
pub(super) fn location_of(add: &Add) -> [f32; 3] {
    let Vector { x, y, z } = add.location;
    [x, y, z]
}

/// Where an actor of ours is, in centimetres of recordings.
pub(super) fn centimetres(pose: &Pose) -> [f32; 3] {
    let Vector3D { x, y, z } = Vector3D::of(pose.translation.vector);
    [x, y, z].map(|number| number * CM_PER_M)
}

/// Puts a member where the recording has it. Numbers that are none move nobody.
pub(super) fn placed(
    member: &Member,
    position: &Position,
    kinematics: Option<&Kinematics>,
    walker_speed_mps: f32,
) -> Vec<Command> {
    let (actor, world_from_actor) = (member.id, pose_of(position));
    if !is_finite(&world_from_actor) {
        return Vec::new();
    }
    if member.class == Class::WALKER {
        let speed_mps = walker_speed_mps;
        return vec![Command::Walker(WalkerCommand::State { actor, world_from_actor, speed_mps })];
    }
    let mut commands =
        vec![Command::Body(BodyCommand::SetPose { actor, reference_from_actor: world_from_actor })];
    if let Some(kinematics) = kinematics.filter(|_| member.class == Class::VEHICLE) {
        commands.extend(moving(actor, kinematics));
    }
    commands
}

fn moving(actor: ActorId, kinematics: &Kinematics) -> Option<Command> {
    let theirs = |Vector { x, y, z }: Vector| Vector3D { x, y, z };
    let linear: Vec3 = theirs(kinematics.linear_velocity).ours();
    let angular = spin_from_deg(theirs(kinematics.angular_velocity));
    let is_finite = linear.iter().chain(angular.iter()).all(|number| number.is_finite());
    is_finite.then_some(Command::Body(BodyCommand::SetVelocity {
        actor,
        linear_mps: Some(linear),
        angular_radps: Some(angular),
    }))
}

/// A vehicle or walker has its physics again, and nothing is to be done any more; or it goes on in
/// traffic, if it is a vehicle and on a road.
pub(super) fn let_go(member: &Member, drives: bool) -> Vec<Command> {
    let actor = member.id;
    let on = BodyCommand::SetSwitch { actor, switch: BodySwitch::Physics, on: true };
    let (linear_mps, angular_radps) = (Some(Vec3::zeros()), Some(Vec3::zeros()));
    let still = BodyCommand::SetVelocity { actor, linear_mps, angular_radps };
    if member.class == Class::WALKER {
        let control = WalkerControl::default();
        let idle = Command::Walker(WalkerCommand::Control { actor, control });
        return vec![idle, Command::Body(on), Command::Body(still)];
    }
    let control = VehicleControl::default();
    let idle = Command::Vehicle(VehicleCommand::Control { actor, control });
    let behaviour = AgentBehaviour::Normal;
    let then = match drives {
        true => Command::Traffic(TrafficCommand::Join { actor, behaviour }),
        false => Command::Body(still),
    };
    vec![idle, Command::Body(on), then]
}

/// In our signs.
fn control_of(control: &Control) -> VehicleControl {
    VehicleControl {
        throttle: control.throttle,
        steer: -control.steer,
        brake: control.brake,
        hand_brake: control.hand_brake,
        reverse: control.gear < 0,
        manual_gear: false,
        gear: control.gear.clamp(-1, i32::from(i8::MAX)) as i8,
    }
}

impl Endpoint {
    /// Tells the world what frames of a recording say.
    pub(super) fn say(
        &mut self,
        cast: &Cast,
        said: &mut Said,
        packets: &[Packet],
    ) -> Result<(), Refusal> {
        let member = |id| cast.member(id).map(|member| member.id);
        for packet in packets {
            match packet {
                Packet::LightStates(states) => self.show_lights(cast, states)?,
                Packet::VehicleControls(controls) => {
                    for control in controls {
                        let Some(actor) = member(control.id) else { continue };
                        if said.controls.insert(control.id, control.clone()).as_ref()
                            != Some(control)
                        {
                            let control = control_of(control);
                            let order = VehicleCommand::Control { actor, control };
                            self.pending.push(Command::Vehicle(order));
                        }
                    }
                }
                Packet::VehicleLights(all) => {
                    for one in all {
                        let Some(actor) = member(one.id) else { continue };
                        if said.lights.insert(one.id, one.flags) != Some(one.flags) {
                            let lights = one.flags;
                            let order = VehicleCommand::Lights { actor, lights };
                            self.pending.push(Command::Vehicle(order));
                        }
                    }
                }
                Packet::WalkerSpeeds(speeds) => {
                    let finite = speeds.iter().filter(|one| one.speed.is_finite());
                    said.walkers.extend(finite.map(|one| (one.id, one.speed / CM_PER_M)));
                }
                Packet::Doors(doors) => {
                    let open = doors.iter().filter_map(|door| {
                        let actor = member(door.id)?;
                        let doors = match door.door {
                            ALL_DOORS => (1 << ALL_DOORS) - 1,
                            door => 1u8.checked_shl(u32::from(door))?,
                        };
                        let order = VehicleCommand::Doors { actor, doors, open: door.is_open };
                        Some(Command::Vehicle(order))
                    });
                    self.pending.extend(open);
                }
                Packet::SceneLights(lamps) => self.lamps.take_over(lamps),
                Packet::Weather(weather) => {
                    let Some(weather) = WeatherParameters::of_recorded(weather) else { continue };
                    self.weather = weather;
                    let weather = self.weather.ours();
                    self.pending.push(Command::SetWeather { weather });
                }
                Packet::Wheels(all) => self.hold_wheels(cast, all)?,
                Packet::Bones(all) => self.hold_bones(cast, said, all)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn show_lights(
        &mut self,
        cast: &Cast,
        states: &[recording::LightState],
    ) -> Result<(), Refusal> {
        let episode = self.episode()?;
        let mut changed = Vec::new();
        for state in states {
            let Some(actor) = cast.member(state.id).map(|member| member.id) else { continue };
            let lights = &episode.frame.traffic_lights;
            let Some(light) = lights
                .binary_search_by_key(&actor, |light| light.actor)
                .ok()
                .and_then(|at| lights.get(at))
            else {
                continue;
            };
            if colour_index(light.colour) != state.state {
                changed.push(Command::TrafficLight(TrafficLightCommand::Set {
                    actor,
                    colour: Some(colour_of(state.state)),
                    green_secs: None,
                    yellow_secs: None,
                    red_secs: None,
                }));
            }
            let recording::LightState { elapsed_secs, is_frozen, .. } = *state;
            if elapsed_secs.is_finite() {
                episode.replay_light(actor, ReplayedLight { elapsed_secs, is_frozen });
            }
        }
        self.pending.extend(changed);
        Ok(())
    }

    fn hold_wheels(&mut self, cast: &Cast, all: &[recording::Wheels]) -> Result<(), Refusal> {
        let episode = self.episode()?;
        for one in all {
            let Some(member) = cast.member(one.id) else { continue };
            for wheel in one.wheels.iter() {
                if let Some(angles) = episode.wheel_angles_mut(member.id, wheel.wheel) {
                    angles.steer = Some(wheel.steer_deg);
                    angles.pitch = Some(wheel.rotation_deg);
                }
            }
        }
        Ok(())
    }

    /// Walkers hold their limbs as recorded, those that ours have.
    fn hold_bones(&mut self, cast: &Cast, said: &mut Said, all: &[Bones]) -> Result<(), Refusal> {
        for one in all {
            let walker = cast.member(one.id).filter(|member| member.class == Class::WALKER);
            let Some(actor) = walker.map(|member| member.id) else { continue };
            if said.posed.len() >= limits::POSED_WALKERS_MAX && !said.posed.contains(&actor) {
                continue;
            }
            let poses = one
                .bones
                .iter()
                .map(|bone| (bone.name.clone(), pose_at(bone.location, bone.rotation)));
            let mut bones = skeleton::named(poses.filter(|(_, pose)| is_finite(pose)));
            let episode = self.episode()?;
            let held = episode.walker_pose(actor);
            let held_in_parent = |bone| held.and_then(|pose| pose.of_bone(bone));
            bones.retain(|it| held_in_parent(it.bone) != Some(&it.parent_from_bone));
            said.posed.insert(actor);
            if bones.is_empty() && held.is_some_and(|pose| pose.share == 1.0) {
                continue;
            }
            let change = BonesChange { afresh: false, bones, share: Some(1.0) };
            episode.note_bones(actor, &change);
            self.pending.push(Command::Walker(WalkerCommand::Bones { actor, change }));
        }
        Ok(())
    }
}
