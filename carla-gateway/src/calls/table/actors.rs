//! Calls about one actor that is there. Their refusals name the function, as CARLA's do.

use crate::calls::method::{self, Method, Run, refused};
use crate::calls::method::{arguments, command, no_effect, of_argument, value, void};
use crate::calls::{actor, lights, parts, vehicle, walker};

use super::NO_EFFECT;
use crate::dialect::ActorRef;

const COMPONENTS: &str =
    "mesh, box and blinkers of vehicles; capsule and mesh of walkers; a root of others";
const BASE_AND_WHEELS: &str = "bones of walkers; a base and wheels of vehicles";
const OUR_NAMES: &str = "the blueprint, and behind it the id";
const OPEN_DOORS: &str = "drawn, and met by rays; bodies pass through open doors";
const HELD_WHEELS: &str = "told back and seen in bones, not drawn";
const ROLLED_WHEELS: &str = "by how far wheels have come, not by how they slip or lock";
const NO_SENDER: &str = "no client sends it";

const fn full(name: &'static str, run: Run) -> Method {
    method::full(name, run).naming_function()
}

const fn partly(name: &'static str, what: &'static str, run: Run) -> Method {
    method::partly(name, what, run).naming_function()
}

pub(super) static ACTORS: &[Method] = &[
    full("set_actor_location", command!(Location(id, location))),
    full("set_actor_transform", command!(Transform(id, transform))),
    full("set_actor_target_velocity", command!(TargetVelocity(id, velocity))),
    full("set_actor_target_angular_velocity", command!(TargetAngularVelocity(id, velocity))),
    full("enable_actor_constant_velocity", void!(actor::hold_velocity(id, velocity).await)),
    full("disable_actor_constant_velocity", void!(actor::let_go(id).await)),
    full("add_actor_impulse", command!(Impulse(id, impulse))),
    full("add_actor_force", command!(Force(id, force))),
    full("add_actor_angular_impulse", command!(AngularImpulse(id, impulse))),
    full("add_actor_torque", command!(Torque(id, torque))),
    refused("add_actor_impulse_at_location", NO_SENDER),
    refused("add_actor_force_at_location", NO_SENDER),
    full("set_actor_simulate_physics", void!(actor::switch_physics(id, on).await))
        .or(actor::physics_refused),
    full("set_actor_collisions", void!(actor::switch_collisions(id, on).await)),
    full("set_actor_dead", void!(walker::fell(id).await)),
    full("set_actor_enable_gravity", command!(EnableGravity(id, on))),
    full("get_actor_bounding_box", value!(actor::bounding_box(id))).or(actor::no_box),
    partly(
        "get_actor_component_world_transform",
        COMPONENTS,
        value!(parts::component_in_world(id, name)),
    ),
    partly(
        "get_actor_component_relative_transform",
        COMPONENTS,
        value!(parts::component_in_carrier(id, name)),
    ),
    partly("get_actor_bone_world_transforms", BASE_AND_WHEELS, value!(parts::bones_in_world(id))),
    partly("get_actor_bone_relative_transforms", BASE_AND_WHEELS, value!(parts::bones_in_mesh(id))),
    partly("get_actor_socket_world_transforms", BASE_AND_WHEELS, value!(parts::bones_in_world(id))),
    partly(
        "get_actor_socket_relative_transforms",
        BASE_AND_WHEELS,
        value!(parts::sockets_on_actor(id)),
    ),
    partly("get_actor_component_names", COMPONENTS, value!(parts::component_names(id))),
    partly("get_actor_name", OUR_NAMES, value!(actor::name(id))),
    partly("get_actor_class_name", "the blueprint", value!(actor::class_name(id))),
    partly("get_actor_bone_names", BASE_AND_WHEELS, value!(parts::bone_names(id))),
    partly("get_actor_socket_names", BASE_AND_WHEELS, value!(parts::bone_names(id))),
    full("apply_control_to_vehicle", command!(Control(id, control))),
    full("apply_ackermann_control_to_vehicle", command!(Ackermann(id, control))),
    full("get_ackermann_controller_settings", value!(vehicle::ackermann_settings(id).await)),
    full(
        "apply_ackermann_controller_settings",
        void!(vehicle::set_ackermann_settings(id, settings).await),
    ),
    full("get_physics_control", value!(vehicle::physics(id).await)),
    full("apply_physics_control", void!(vehicle::set_physics(id, control).await)),
    full("get_vehicle_light_state", value!(vehicle::lights(id))),
    full("set_vehicle_light_state", void!(vehicle::set_lights(id, lights).await)),
    full("get_vehicle_light_states", value!(vehicle::lights_of_all())).or(vehicle::no_lights),
    full("get_telemetry_data", value!(vehicle::telemetry(id).await)),
    partly("show_vehicle_debug_telemetry", NO_EFFECT, no_effect!(ActorRef, bool)),
    partly("open_vehicle_door", OPEN_DOORS, void!(vehicle::open_door(id, door).await)),
    partly("close_vehicle_door", OPEN_DOORS, void!(vehicle::close_door(id, door).await)),
    partly(
        "set_wheel_steer_direction",
        HELD_WHEELS,
        void!(vehicle::steer_wheel(id, wheel, degrees)),
    ),
    partly("set_wheel_pitch_angle", HELD_WHEELS, void!(vehicle::pitch_wheel(id, wheel, degrees))),
    full("get_wheel_steer_angle", value!(vehicle::wheel_steer_deg(id, wheel))),
    partly("get_wheel_pitch_angle", ROLLED_WHEELS, value!(vehicle::wheel_pitch_deg(id, wheel))),
    partly(
        "get_vehicle_bone_world_transforms",
        BASE_AND_WHEELS,
        value!(vehicle::bones_in_world(id)),
    ),
    partly(
        "set_actor_autopilot",
        "accepted; the autopilot is the client's own",
        no_effect!(ActorRef, bool),
    ),
    partly("enable_carsim", NO_EFFECT, no_effect!(ActorRef, String)),
    partly("use_carsim_road", NO_EFFECT, no_effect!(ActorRef, bool)),
    partly(
        "enable_chrono_physics",
        NO_EFFECT,
        no_effect!(ActorRef, u64, f32, String, String, String, String),
    ),
    partly("restore_physx_physics", NO_EFFECT, no_effect!(ActorRef)),
    full("apply_control_to_walker", command!(WalkerControl(id, control))),
    full("get_bones_transform", value!(walker::bones(id))),
    full("set_bones_transform", void!(walker::set_bones(id, wanted).await)),
    full("blend_pose", void!(walker::blend_pose(id, share).await)),
    full("get_pose_from_animation", void!(walker::take_pose(id).await)),
    full("set_traffic_light_state", command!(TrafficLight(id, colour))),
    full("set_traffic_light_green_time", void!(lights::set_green_secs(id, secs).await)),
    full("set_traffic_light_yellow_time", void!(lights::set_yellow_secs(id, secs).await)),
    full("set_traffic_light_red_time", void!(lights::set_red_secs(id, secs).await)),
    full("freeze_all_traffic_lights", void!(lights::freeze_all(frozen).await)),
    partly(
        "freeze_traffic_light",
        "stops all lights, as Python's freeze does",
        void!(lights::freeze(id, frozen).await),
    ),
    full("reset_traffic_light_group", void!(lights::reset_group(id).await)),
    full("reset_all_traffic_lights", void!(lights::reset_all().await)),
    full("get_group_traffic_lights", value!(lights::group(id))),
    full("get_light_boxes", value!(lights::boxes(id))),
];
