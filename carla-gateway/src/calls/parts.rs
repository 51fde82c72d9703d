//! Components, bones, sockets: the parts of actors that CARLA's clients ask for by name.
//!
//! A vehicle is a base with wheels, a walker a skeleton; every actor has a root.

use blueprints::{Class, VehicleModel};
use schemas::{ActorKind, ActorState, Pose, Translation3, UnitQuaternion, Vec3};

use crate::dialect::Transform;
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};
use crate::skeleton;

const ROOT: &str = "RootComponent";
/// Of the vehicle itself, before those of its wheels.
const BASE: &str = "Vehicle_Base";

/// A named part, in the world and in its parent's frame.
struct Part {
    name: String,
    in_world: Pose,
    in_parent: Pose,
}

pub(super) fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    let method = request.method.as_str();
    if method.starts_with("get_actor_component_") && method.ends_with("_transform") {
        let (_, id, name): (Meta, u32, String) = request.args()?;
        let state = endpoint.episode()?.state(id).ok_or_else(|| unknown_actor(id))?;
        if name != ROOT {
            return Err(Refusal(format!("Component not found. Component Name: {name}")));
        }
        let in_world = Transform::of(&state.world_from_actor);
        let is_world = method == "get_actor_component_world_transform";
        return Payload::value(&if is_world { in_world } else { Transform::default() });
    }
    let (_, id): (Meta, u32) = request.args()?;
    let episode = endpoint.episode()?;
    let state = episode.state(id).ok_or_else(|| unknown_actor(id))?;
    let bones = || bones(state, episode.frame.type_of(state), episode.custom_pose(id));
    let transforms = |pose: fn(&Part) -> &Pose| {
        let bones = bones();
        bones.iter().map(|part| Transform::of(pose(part))).collect::<Vec<Transform>>()
    };
    match method {
        "get_actor_component_names" => Payload::value(&[ROOT]),
        "get_actor_bone_names" => {
            let names: Vec<String> = bones().into_iter().map(|part| part.name).collect();
            Payload::value(&names)
        }
        "get_actor_bone_world_transforms" | "get_vehicle_bone_world_transforms" => {
            Payload::value(&transforms(|part| &part.in_world))
        }
        "get_actor_bone_relative_transforms" => Payload::value(&transforms(|part| &part.in_parent)),
        "get_actor_socket_names" => Payload::value(&[""; 0]),
        _ => Payload::value(&super::NO_TRANSFORMS),
    }
}

fn bones(state: &ActorState, type_id: &str, custom: Option<&skeleton::Custom>) -> Vec<Part> {
    match state.kind {
        ActorKind::Walker => skeleton::posed(state, custom)
            .into_iter()
            .map(|bone| Part {
                name: bone.name.to_owned(),
                in_world: bone.in_world,
                in_parent: bone.in_parent,
            })
            .collect(),
        ActorKind::Vehicle => model(type_id).map_or_else(Vec::new, |model| wheels(state, model)),
        _ => Vec::new(),
    }
}

/// The data of a vehicle's blueprint.
pub(super) fn model(type_id: &str) -> Option<&'static VehicleModel> {
    match blueprints::find(type_id)?.class {
        Class::Vehicle(model) => Some(model),
        _ => None,
    }
}

/// The base, then the hubs of the wheels as they are steered.
fn wheels(state: &ActorState, model: &VehicleModel) -> Vec<Part> {
    let base = Part {
        name: BASE.to_owned(),
        in_world: state.world_from_actor,
        in_parent: Pose::identity(),
    };
    let hubs = model.physics.wheels.iter().enumerate().map(|(index, wheel)| {
        let turn_rad = wheel_rad(model, index, state.road_wheel_rad);
        let turn = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), turn_rad);
        let in_parent = Pose::from_parts(Translation3::from(wheel.position_m), turn);
        let end = if wheel.position_m.x > 0.0 { "Front" } else { "Rear" };
        let side = if wheel.position_m.y < 0.0 { "Right" } else { "Left" };
        let name = match model.physics.wheels.len() {
            2 => format!("Wheel_{end}"),
            4 => format!("Wheel_{end}_{side}"),
            _ => format!("Wheel_{end}_{side}_{index}"),
        };
        Part { name, in_world: state.world_from_actor * in_parent, in_parent }
    });
    std::iter::once(base).chain(hubs).collect()
}

/// The angle of one wheel: all front wheels roll around one point (Ackermann).
pub(super) fn wheel_rad(model: &VehicleModel, index: usize, mean_rad: f32) -> f32 {
    let wheels = &model.physics.wheels;
    let Some(wheel) = wheels.get(index).filter(|wheel| wheel.steer_rad_max > 0.0) else {
        return 0.0;
    };
    if mean_rad == 0.0 || wheel.position_m.x <= 0.0 {
        return mean_rad;
    }
    let (sine, cosine) = mean_rad.sin_cos();
    (sine * model.wheelbase_m).atan2(cosine * model.wheelbase_m - sine * wheel.position_m.y)
}

#[cfg(test)]
mod tests {
    use schemas::ActorId;

    use super::*;

    #[test]
    fn the_inner_wheel_is_steered_further() {
        let model = model("vehicle.lincoln.mkz_2020").unwrap();
        let [left, right] = [0, 1].map(|index| wheel_rad(model, index, 0.4));
        assert!(left > 0.4 && right < 0.4 && right > 0.3, "{left} {right}");
        assert_eq!(wheel_rad(model, 2, 0.4), 0.0);
        assert_eq!(wheel_rad(model, 9, 0.4), 0.0);
    }

    #[test]
    fn a_car_has_a_base_and_four_hubs_where_its_wheels_are() {
        let id = ActorId::new(1).unwrap();
        let at = Pose::translation(5.0, 0.0, 0.0);
        let state = ActorState::at_rest(id, ActorKind::Vehicle, 0, at);
        let parts = bones(&state, "vehicle.lincoln.mkz_2020", None);
        let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
        assert_eq!(names[..2], ["Vehicle_Base", "Wheel_Front_Left"]);
        assert_eq!(parts.len(), 5);
        let front = parts[1].in_world.translation.vector;
        assert!(front.x > 5.5 && front.y > 0.5 && front.z > 0.2, "{front}");
    }
}
