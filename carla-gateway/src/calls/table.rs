//! Every call of CARLA 0.9.16's client, and how well it is served.

/// Which module answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    Session,
    Map,
    Scenery,
    Content,
    Actor,
    Vehicle,
    Walker,
    Lights,
    Sensor,
    Batch,
    Refused,
}

/// How well a call is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    /// As CARLA does.
    Full,
    /// What differs.
    Partial(&'static str),
    /// Why it fails.
    Refused(&'static str),
}

/// One call.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) name: &'static str,
    pub(crate) group: Group,
    pub(crate) needs_world: bool,
    pub(crate) state: State,
}

const NO_RECORDER: &str = "the recorder is not yet available";
const NO_TEXTURES: &str = "surfaces cannot be repainted";
const NO_EFFECT: &str = "accepted, without effect";
const FIVE_LAYERS: &str =
    "buildings, foliage, props, street lights, walls; nothing of other layers goes";
const NO_MATERIALS: &str =
    "colour, depths, stencils, normals (GBufferA) and velocity; others are black";
const COMPONENTS: &str =
    "mesh, box and blinkers of vehicles; capsule and mesh of walkers; a root of others";
const BASE_AND_WHEELS: &str = "bones of walkers; a base and wheels of vehicles";
const NOT_DRAWN: &str = "bones tell the pose, pictures show the walk";

const fn full(group: Group, name: &'static str) -> Method {
    Method { name, group, needs_world: true, state: State::Full }
}

const fn partly(group: Group, name: &'static str, what: &'static str) -> Method {
    Method { name, group, needs_world: true, state: State::Partial(what) }
}

const fn refused(name: &'static str, why: &'static str) -> Method {
    Method { name, group: Group::Refused, needs_world: false, state: State::Refused(why) }
}

/// Answered even when there is no world.
const fn early(name: &'static str) -> Method {
    Method { name, group: Group::Session, needs_world: false, state: State::Full }
}

/// All calls, in the order of CARLA's areas.
pub(crate) static METHODS: &[Method] = {
    use Group::{Actor, Batch, Content, Lights, Map, Scenery, Sensor, Session, Vehicle, Walker};
    &[
        early("version"),
        full(Session, "get_episode_info"),
        early("get_sensor_token"),
        early("get_episode_settings"),
        full(Session, "set_episode_settings"),
        full(Session, "tick_cue"),
        Method { state: State::Partial(FIVE_LAYERS), ..early("load_new_episode") },
        Method {
            state: State::Partial(
                "the parameters are ignored; what would end the client is refused",
            ),
            ..early("copy_opendrive_to_file")
        },
        early("get_available_maps"),
        partly(Scenery, "load_map_layer", FIVE_LAYERS),
        partly(Scenery, "unload_map_layer", FIVE_LAYERS),
        early("is_traffic_manager_running"),
        early("get_traffic_manager_running"),
        early("add_traffic_manager_running"),
        early("destroy_traffic_manager"),
        full(Map, "get_map_info"),
        full(Map, "get_map_data"),
        partly(Map, "get_required_files", "the navigation file; clients make others from the map"),
        full(Map, "request_file"),
        full(Map, "get_navigation_mesh"),
        full(Content, "get_actor_definitions"),
        full(Content, "get_spectator"),
        full(Content, "get_actors_by_id"),
        full(Content, "get_weather_parameters"),
        full(Content, "set_weather_parameters"),
        full(Content, "get_imui_gravity"),
        full(Content, "set_imui_gravity"),
        full(Scenery, "get_all_level_BBs"),
        full(Scenery, "get_environment_objects"),
        partly(
            Scenery,
            "enable_environment_objects",
            "roads and what lies on them, lights and signs always stay",
        ),
        partly(Content, "set_annotations_traverse_translucency", NO_EFFECT),
        full(Scenery, "get_names_of_all_objects"),
        refused("apply_color_texture_to_objects", NO_TEXTURES),
        refused("apply_float_color_texture_to_objects", NO_TEXTURES),
        full(Map, "project_point"),
        full(Map, "cast_ray"),
        partly(
            Content,
            "draw_debug_shape",
            "in colour pictures; text and the screen of the server are left out",
        ),
        full(Content, "clear_debug_shape"),
        partly(Content, "clear_debug_string", NO_EFFECT),
        full(Content, "query_lights_state"),
        partly(
            Content,
            "update_lights_state",
            "told to all clients; pictures show lamps lit by night",
        ),
        full(Content, "update_day_night_cycle"),
        full(Actor, "spawn_actor"),
        partly(
            Actor,
            "spawn_actor_with_parent",
            "no vehicles or walkers; the bone of a socket does not move what hangs on it",
        ),
        full(Actor, "destroy_actor"),
        full(Actor, "set_actor_location"),
        full(Actor, "set_actor_transform"),
        full(Actor, "set_actor_target_velocity"),
        full(Actor, "set_actor_target_angular_velocity"),
        full(Actor, "enable_actor_constant_velocity"),
        full(Actor, "disable_actor_constant_velocity"),
        full(Actor, "add_actor_impulse"),
        full(Actor, "add_actor_force"),
        full(Actor, "add_actor_angular_impulse"),
        full(Actor, "add_actor_torque"),
        refused("add_actor_impulse_at_location", "no client of 0.9.16 sends it"),
        refused("add_actor_force_at_location", "no client of 0.9.16 sends it"),
        full(Actor, "set_actor_simulate_physics"),
        full(Actor, "set_actor_collisions"),
        full(Walker, "set_actor_dead"),
        full(Actor, "set_actor_enable_gravity"),
        full(Actor, "get_actor_bounding_box"),
        partly(Actor, "get_actor_component_world_transform", COMPONENTS),
        partly(Actor, "get_actor_component_relative_transform", COMPONENTS),
        partly(Actor, "get_actor_bone_world_transforms", BASE_AND_WHEELS),
        partly(Actor, "get_actor_bone_relative_transforms", BASE_AND_WHEELS),
        partly(Actor, "get_actor_socket_world_transforms", BASE_AND_WHEELS),
        partly(Actor, "get_actor_socket_relative_transforms", BASE_AND_WHEELS),
        partly(Actor, "get_actor_component_names", COMPONENTS),
        partly(Actor, "get_actor_bone_names", BASE_AND_WHEELS),
        partly(Actor, "get_actor_socket_names", BASE_AND_WHEELS),
        full(Vehicle, "apply_control_to_vehicle"),
        full(Vehicle, "apply_ackermann_control_to_vehicle"),
        full(Vehicle, "get_ackermann_controller_settings"),
        full(Vehicle, "apply_ackermann_controller_settings"),
        full(Vehicle, "get_physics_control"),
        full(Vehicle, "apply_physics_control"),
        full(Vehicle, "get_vehicle_light_state"),
        full(Vehicle, "set_vehicle_light_state"),
        full(Vehicle, "get_vehicle_light_states"),
        full(Vehicle, "get_telemetry_data"),
        partly(Vehicle, "show_vehicle_debug_telemetry", NO_EFFECT),
        full(Vehicle, "open_vehicle_door"),
        full(Vehicle, "close_vehicle_door"),
        partly(Vehicle, "set_wheel_steer_direction", "told back, not drawn"),
        partly(Vehicle, "set_wheel_pitch_angle", "told back, not drawn"),
        full(Vehicle, "get_wheel_steer_angle"),
        partly(Vehicle, "get_wheel_pitch_angle", "as it was set, or 0"),
        partly(Vehicle, "get_vehicle_bone_world_transforms", BASE_AND_WHEELS),
        partly(Vehicle, "set_actor_autopilot", "accepted; the autopilot is the client's own"),
        partly(Vehicle, "enable_carsim", NO_EFFECT),
        partly(Vehicle, "use_carsim_road", NO_EFFECT),
        partly(Vehicle, "enable_chrono_physics", NO_EFFECT),
        partly(Vehicle, "restore_physx_physics", NO_EFFECT),
        full(Walker, "apply_control_to_walker"),
        full(Walker, "get_bones_transform"),
        partly(Walker, "set_bones_transform", NOT_DRAWN),
        partly(Walker, "blend_pose", NOT_DRAWN),
        partly(Walker, "get_pose_from_animation", NOT_DRAWN),
        full(Lights, "set_traffic_light_state"),
        full(Lights, "set_traffic_light_green_time"),
        full(Lights, "set_traffic_light_yellow_time"),
        full(Lights, "set_traffic_light_red_time"),
        full(Lights, "freeze_all_traffic_lights"),
        partly(Lights, "freeze_traffic_light", "stops all lights, as Python's freeze does"),
        full(Lights, "reset_traffic_light_group"),
        full(Lights, "reset_all_traffic_lights"),
        full(Lights, "get_group_traffic_lights"),
        full(Lights, "get_light_boxes"),
        full(Sensor, "enable_gbuffers"),
        full(Sensor, "are_gbuffers_enabled"),
        partly(Sensor, "get_gbuffer_token", NO_MATERIALS),
        full(Sensor, "set_ignored_vehicles"),
        partly(Sensor, "enable_sensor_for_ros", NO_EFFECT),
        partly(Sensor, "disable_sensor_for_ros", NO_EFFECT),
        partly(Sensor, "is_sensor_enabled_for_ros", "always false"),
        full(Sensor, "send"),
        refused("start_recorder", NO_RECORDER),
        refused("stop_recorder", NO_RECORDER),
        refused("show_recorder_file_info", NO_RECORDER),
        refused("show_recorder_collisions", NO_RECORDER),
        refused("show_recorder_actors_blocked", NO_RECORDER),
        refused("replay_file", NO_RECORDER),
        refused("stop_replayer", NO_RECORDER),
        refused("set_replayer_time_factor", NO_RECORDER),
        refused("set_replayer_ignore_hero", NO_RECORDER),
        refused("set_replayer_ignore_spectator", NO_RECORDER),
        full(Batch, "apply_batch"),
    ]
};
