//! Components, bones, sockets: the parts of actors that CARLA's clients ask for by name.
//!
//! A vehicle is a mesh with a box and blinkers, and its bones are a base with wheels; a walker is a
//! capsule with a mesh, and its bones are a skeleton; any other actor has a root alone. As in
//! CARLA the sockets of a mesh are its bones.

use blueprints::VehicleModel;
use schemas::{ActorId, ActorKind, ActorState, Pose, Translation3, UnitQuaternion, Vec3, skeleton};

use crate::dialect::{ActorRef, Transform};
use crate::endpoint::Endpoint;
use crate::episode::Episode;
use crate::rpc::Refusal;
use crate::wheels::model;

/// Of the vehicle itself, before those of its wheels.
const BASE: &str = "Vehicle_Base";
/// Outer ends of head and tail lamps, in halves of the bounding box from its middle.
///
/// **Source:** CARLA's example for components names `front-blinker-r-1` of `vehicle.audi.tt`; the
/// other names follow it.
const BLINKERS: [(&str, [f32; 3]); 4] = [
    ("front-blinker-l-1", [0.94, 0.84, -0.13]),
    ("front-blinker-r-1", [0.94, -0.84, -0.13]),
    ("rear-blinker-l-1", [-0.94, 0.88, 0.03]),
    ("rear-blinker-r-1", [-0.94, -0.88, 0.03]),
];

/// A named part, in the world and in the frame of what carries it: the mesh for bones, the root for
/// components.
struct Part {
    name: String,
    in_world: Pose,
    in_carrier: Pose,
}

pub(super) fn component_in_world(
    endpoint: &mut Endpoint,
    id: ActorRef,
    name: String,
) -> Result<Transform, Refusal> {
    Ok(Transform::of(&component(endpoint, id, &name)?.in_world))
}

pub(super) fn component_in_carrier(
    endpoint: &mut Endpoint,
    id: ActorRef,
    name: String,
) -> Result<Transform, Refusal> {
    Ok(Transform::of(&component(endpoint, id, &name)?.in_carrier))
}

fn component(endpoint: &mut Endpoint, id: ActorRef, name: &str) -> Result<Part, Refusal> {
    let episode = endpoint.episode()?;
    let mut parts = components(episode, episode.found(id)?).into_iter();
    parts.find(|part| part.name == name).ok_or_else(|| {
        let name: String = name.chars().take(128).collect();
        Refusal(format!("Component not found.  Component Name: {name}"))
    })
}

pub(super) fn component_names(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<Vec<String>, Refusal> {
    let episode = endpoint.episode()?;
    Ok(components(episode, episode.found(id)?).into_iter().map(|part| part.name).collect())
}

pub(super) fn bone_names(endpoint: &mut Endpoint, id: ActorRef) -> Result<Vec<String>, Refusal> {
    let episode = endpoint.episode()?;
    Ok(bones(episode, episode.found(id)?).into_iter().map(|bone| bone.name).collect())
}

pub(super) fn bones_in_world(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<Vec<Transform>, Refusal> {
    told_bones(endpoint, id, |_, bone| bone.in_world)
}

pub(super) fn bones_in_mesh(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<Vec<Transform>, Refusal> {
    told_bones(endpoint, id, |_, bone| bone.in_carrier)
}

pub(super) fn sockets_on_actor(
    endpoint: &mut Endpoint,
    id: ActorRef,
) -> Result<Vec<Transform>, Refusal> {
    told_bones(endpoint, id, |state, bone| state.world_from_actor.inverse() * bone.in_world)
}

fn told_bones(
    endpoint: &mut Endpoint,
    id: ActorRef,
    pose: fn(&ActorState, &Part) -> Pose,
) -> Result<Vec<Transform>, Refusal> {
    let episode = endpoint.episode()?;
    let state = episode.found(id)?;
    Ok(bones(episode, state).iter().map(|bone| Transform::of(&pose(state, bone))).collect())
}

/// What a client describes relative to a socket of an actor, relative to the actor; relative to the
/// actor already where there is no such socket.
pub(super) fn on_socket(episode: &Episode, id: ActorId, socket: &str, on: &Transform) -> Transform {
    let Some(state) = episode.state(id).filter(|_| !socket.is_empty()) else { return *on };
    let mut bones = bones(episode, state).into_iter();
    bones.find(|bone| bone.name == socket).map_or(*on, |bone| {
        Transform::of(&(state.world_from_actor.inverse() * bone.in_world * on.ours()))
    })
}

/// The root, then what it carries. The root of an actor that stands alone is carried by the world.
fn components(episode: &Episode, state: &ActorState) -> Vec<Part> {
    let world_from_parent = episode.carrier(state);
    let part = |name: &str, place_m: Vec3| {
        let in_carrier = Pose::from_parts(Translation3::from(place_m), UnitQuaternion::identity());
        let in_world = state.world_from_actor * in_carrier;
        Part { name: name.to_owned(), in_world, in_carrier }
    };
    let (root, carried) = match state.kind {
        ActorKind::Vehicle => {
            let half_m = state.box_half_extent_m;
            let at =
                |share: [f32; 3]| state.box_centre_m + Vec3::from(share).component_mul(&half_m);
            let bounds = part("VehicleBounds", state.box_centre_m);
            let blinkers = BLINKERS.map(|(name, share)| part(name, at(share)));
            ("VehicleMesh", std::iter::once(bounds).chain(blinkers).collect())
        }
        ActorKind::Walker => {
            let foot_m = state.box_centre_m - Vec3::z() * state.box_half_extent_m.z;
            ("CollisionCylinder", vec![part("CharacterMesh0", foot_m)])
        }
        _ => ("RootComponent", Vec::new()),
    };
    let root = Part {
        name: root.to_owned(),
        in_world: state.world_from_actor,
        in_carrier: world_from_parent.inverse() * state.world_from_actor,
    };
    std::iter::once(root).chain(carried).collect()
}

fn bones(episode: &Episode, state: &ActorState) -> Vec<Part> {
    match state.kind {
        ActorKind::Walker => skeleton::posed(state, episode.walker_pose(state.id))
            .into_iter()
            .map(|bone| Part {
                name: bone.name.to_owned(),
                in_world: bone.in_world,
                in_carrier: bone.in_component,
            })
            .collect(),
        ActorKind::Vehicle => {
            let model = model(episode.frame.type_of(state));
            let turned = |wheel| episode.wheel_deg(state, wheel);
            model.map_or_else(Vec::new, |model| wheels(state, model, turned))
        }
        _ => Vec::new(),
    }
}

/// The base, then the hubs of the wheels as they are steered and turned: how far to the right and
/// backwards, in degrees.
fn wheels(
    state: &ActorState,
    model: &VehicleModel,
    turned_deg: impl Fn(u8) -> (f32, f32),
) -> Vec<Part> {
    let base = Part {
        name: BASE.to_owned(),
        in_world: state.world_from_actor,
        in_carrier: Pose::identity(),
    };
    let hubs = model.physics.wheels.iter().enumerate().map(|(index, wheel)| {
        let (right_deg, back_deg) = turned_deg(index as u8);
        let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), -right_deg.to_radians())
            * UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -back_deg.to_radians());
        let in_carrier = Pose::from_parts(Translation3::from(wheel.position_m), turn);
        let end = if wheel.position_m.x > 0.0 { "Front" } else { "Rear" };
        let side = if wheel.position_m.y < 0.0 { "Right" } else { "Left" };
        let name = match model.physics.wheels.len() {
            2 => format!("Wheel_{end}"),
            4 => format!("Wheel_{end}_{side}"),
            _ => format!("Wheel_{end}_{side}_{index}"),
        };
        Part { name, in_world: state.world_from_actor * in_carrier, in_carrier }
    });
    std::iter::once(base).chain(hubs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_car_has_a_base_and_four_hubs_where_its_wheels_are() {
        let id = ActorId::new(1).unwrap();
        let at = Pose::translation(5.0, 0.0, 0.0);
        let state = ActorState::at_rest(id, ActorKind::Vehicle, 0, at);
        let model = model("vehicle.lincoln.mkz_2020").unwrap();
        let parts = wheels(&state, model, |_| (0.0, 0.0));
        let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names[..2], ["Vehicle_Base", "Wheel_Front_Left"]);
        assert_eq!(parts.len(), 5);
        let front = parts[1].in_world.translation.vector;
        assert!(front.x > 5.5 && front.y > 0.5 && front.z > 0.2, "{front}");
    }
}
