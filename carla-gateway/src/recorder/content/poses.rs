//! Where actors are and how they move, in the units of recordings: centimetres and degrees.

use recording::{
    Biker, Bone, Bones, Box3, Class, FrameContent, Kinematics, Long, Position, Rotation, Vector,
    VehicleControl, VehicleLights, WalkerSpeed, WheelPose, Wheels,
};
use schemas::{ActorKind, ActorState, Frame, Pose, Translation3, Vec3, skeleton};

use super::{Known, Notes};
use crate::dialect::{Transform, Vector3D, spin_deg};
use crate::wheels::wheel_rad;

/// Recordings have lengths in centimetres.
const CM_PER_M: f32 = 100.0;

/// The class of an actor in the engine.
pub(super) fn class_of(kind: ActorKind) -> Class {
    match kind {
        ActorKind::Vehicle => Class::VEHICLE,
        ActorKind::Walker => Class::WALKER,
        ActorKind::TrafficLight => Class::TRAFFIC_LIGHT,
        ActorKind::TrafficSign => Class::TRAFFIC_SIGN,
        ActorKind::Sensor => Class::SENSOR,
        ActorKind::Prop | ActorKind::Marker => Class::OTHER,
    }
}

/// A pose as recordings have it.
pub(super) fn in_file(pose: &Pose) -> (Vector, Rotation) {
    let Transform { location, rotation } = Transform::of(pose);
    let crate::dialect::Rotation { pitch, yaw, roll } = rotation;
    (length(location), Rotation { roll, pitch, yaw })
}

fn length(Vector3D { x, y, z }: Vector3D) -> Vector {
    let [x, y, z] = [x, y, z].map(|metres| metres * CM_PER_M);
    Vector { x, y, z }
}

fn velocity(Vector3D { x, y, z }: Vector3D) -> Vector {
    Vector { x, y, z }
}

/// About an actor, in its axes.
pub(super) fn box_of(actor: &ActorState) -> Box3 {
    let origin = length(Vector3D::of(actor.box_centre_m));
    Box3 { id: actor.id.get(), origin, extent: length(Vector3D::size(actor.box_half_extent_m)) }
}

/// Where a sign or light acts, in the world.
pub(super) fn volume_of(actor: &ActorState) -> Box3 {
    let centre = actor.world_from_actor * Translation3::from(actor.box_centre_m);
    Box3 { origin: length(Vector3D::of(centre.translation.vector)), ..box_of(actor) }
}

/// How a vehicle or walker moves.
pub(super) fn kinematics_of(actor: &ActorState) -> Option<Kinematics> {
    matches!(actor.kind, ActorKind::Vehicle | ActorKind::Walker).then(|| Kinematics {
        id: actor.id.get(),
        linear_velocity: velocity(Vector3D::of(actor.linear_velocity_mps)),
        angular_velocity: velocity(spin_deg(actor.angular_velocity_radps)),
    })
}

/// The limbs of all walkers.
pub(super) fn bones_of(frame: &Frame) -> Vec<Bones> {
    let walkers = frame.actors.iter().filter(|actor| actor.kind == ActorKind::Walker);
    let bones = |walker: &ActorState| {
        let posed = skeleton::posed(walker, frame.walker_pose(walker.id));
        let bones = posed.iter().map(|bone| {
            let (location, rotation) = in_file(&bone.in_parent);
            Bone { name: bone.name.to_owned(), location, rotation }
        });
        Bones { id: walker.id.get(), bones: bones.collect() }
    };
    walkers.map(bones).collect()
}

impl Notes {
    /// Poses, and what vehicles and walkers are told to do.
    pub(super) fn put_motion(&mut self, content: &mut FrameContent, frame: &Frame) {
        let vehicles = self.known.iter().filter(|known| known.model.is_some()).count();
        content.positions.reserve(frame.actors.len());
        content.vehicle_controls.reserve(vehicles);
        content.vehicle_lights.reserve(vehicles);
        content.wheels.reserve(vehicles);
        for (actor, known) in self.all(frame) {
            let id = actor.id.get();
            match actor.kind {
                ActorKind::Vehicle => put_vehicle(content, frame.dt_secs as f32, actor, known),
                ActorKind::Walker => {
                    let speed = actor.walker.speed_mps * CM_PER_M;
                    content.walker_speeds.push(WalkerSpeed { id, speed });
                }
                ActorKind::Prop | ActorKind::Marker => {}
                ActorKind::TrafficLight | ActorKind::TrafficSign | ActorKind::Sensor => continue,
            }
            let (location, rotation) = in_file(&actor.world_from_actor);
            content.positions.push(Position { id, location, rotation });
        }
    }
}

fn put_vehicle(content: &mut FrameContent, dt_secs: f32, vehicle: &ActorState, known: &mut Known) {
    let (id, control) = (vehicle.id.get(), &vehicle.control);
    content.vehicle_controls.push(VehicleControl {
        id,
        steer: -control.steer,
        throttle: control.throttle,
        brake: control.brake,
        hand_brake: control.hand_brake,
        gear: i32::from(vehicle.gear),
    });
    content.vehicle_lights.push(VehicleLights { id, flags: vehicle.lights });
    let Some(model) = known.model else { return };
    let ahead = vehicle.world_from_actor.rotation * Vec3::x();
    let speed_mps = vehicle.linear_velocity_mps.dot(&ahead);
    known.rolling.advance(model, vehicle, dt_secs);
    let wheel = |index: usize| WheelPose {
        wheel: index as u8,
        steer_deg: -wheel_rad(model, index, vehicle.road_wheel_rad).to_degrees(),
        rotation_deg: known.rolling.rotation_deg(index),
    };
    let wheels = Long((0..model.physics.wheels.len()).map(wheel).collect());
    content.wheels.push(Wheels { id, wheels });
    if model.is_two_wheeler() {
        let engine = control.throttle.abs();
        content.bikers.push(Biker { id, speed: speed_mps * CM_PER_M, engine });
    }
}
