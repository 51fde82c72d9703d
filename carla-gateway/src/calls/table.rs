//! Every call of CARLA's clients, and what it does.

mod actors;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::method::{Method, by_lobby, full, partly, refused};
use super::method::{arguments, no_effect, of_argument, value, value_of_all, void};
use super::{actor, batch, content, debug, lamps, map, paint, recorder, scenery, sensor, session};
use crate::stream::StreamId;

const SURFACES: &str =
    "`Diffuse` and `Emissive` of buildings, walls, props, plants and poles: [how](#textures)";
const NO_TEXTURES: &str = "actors cannot be repainted; CARLA's Python package makes no such call";
const NO_EFFECT: &str = "accepted, without effect";
const FIVE_LAYERS: &str =
    "buildings, foliage, props, street lights, walls; nothing of other layers goes";
const NO_MATERIALS: &str =
    "colour, depths, stencils, normals (GBufferA) and velocity; others are black";

/// The call with a name.
pub(super) fn find(name: &str) -> Option<&'static Method> {
    static BY_NAME: LazyLock<BTreeMap<&str, &Method>> =
        LazyLock::new(|| all().map(|method| (method.name, method)).collect());
    BY_NAME.get(name).copied()
}

/// All calls, in the order of CARLA's areas.
pub(super) fn all() -> impl Iterator<Item = &'static Method> {
    WORLD.iter().chain(actors::ACTORS).chain(FURTHER)
}

static WORLD: &[Method] = &[
    by_lobby("version"),
    full("get_episode_info", value!(session::episode_info())),
    full("get_sensor_token", value!(session::sensor_token(stream))).early(),
    by_lobby("get_episode_settings"),
    full("set_episode_settings", value!(session::set_settings(settings).await)),
    full("tick_cue", value!(session::next_frame())),
    partly(
        "load_new_episode",
        FIVE_LAYERS,
        void!(session::load(name, resets_settings, layers).await),
    )
    .early(),
    partly(
        "copy_opendrive_to_file",
        "the parameters are ignored; what would end the client is refused",
        void!(session::upload(text, parameters).await),
    )
    .early(),
    full("get_available_maps", value!(session::maps().await)).early(),
    partly("load_map_layer", FIVE_LAYERS, void!(scenery::load_layers(layers).await)),
    partly("unload_map_layer", FIVE_LAYERS, void!(scenery::unload_layers(layers).await)),
    by_lobby("is_traffic_manager_running"),
    by_lobby("get_traffic_manager_running"),
    by_lobby("add_traffic_manager_running"),
    by_lobby("destroy_traffic_manager"),
    full("get_map_info", value!(map::info())),
    full("get_map_data", value!(map::text())),
    partly(
        "get_required_files",
        "the navigation file, in `Nav` and in the folder of all; clients make others from the map",
        value!(map::required_files(folder).await),
    ),
    full("request_file", value!(map::file(path).await)),
    full("get_navigation_mesh", value!(map::navigation_mesh().await)),
    full("get_actor_definitions", value!(content::definitions())),
    full("get_spectator", value!(content::spectator())),
    full("get_actors_by_id", value!(content::actors(ids).await)),
    full("get_weather_parameters", value!(content::weather())),
    partly(
        "set_weather_parameters",
        "wind and the three scattering parameters are kept and told, and change no picture",
        void!(content::set_weather(weather).await),
    ),
    full("is_weather_enabled", value!(content::has_weather())),
    full("get_imui_gravity", value!(content::inertial_gravity())),
    full("set_imui_gravity", void!(content::set_inertial_gravity(gravity_mps2))),
    full("get_all_level_BBs", value!(scenery::boxes(tag))),
    full("get_environment_objects", value!(scenery::objects(tag))),
    partly(
        "enable_environment_objects",
        "roads and what lies on them always stay",
        void!(scenery::enable(ids, enabled).await),
    ),
    partly("set_annotations_traverse_translucency", NO_EFFECT, no_effect!(bool)),
    full("get_names_of_all_objects", value!(scenery::names())),
    partly(
        "apply_color_texture_to_objects",
        SURFACES,
        void!(paint::put(names, parameter, texture).await),
    ),
    partly(
        "apply_float_color_texture_to_objects",
        SURFACES,
        void!(paint::put_float(names, parameter, texture).await),
    ),
    refused("apply_texture_to_actor", NO_TEXTURES),
    refused("apply_texture_to_actor_float", NO_TEXTURES),
    full("project_point", value!(map::project_point(start, direction, distance_m).await)),
    full("cast_ray", value!(map::cast_ray(start, end).await)),
    partly(
        "draw_debug_shape",
        "in colour pictures, text too; the screen of the server is left out",
        void!(debug::draw(shape)),
    ),
    full("clear_debug_shape", void!(debug::clear())),
    full("clear_debug_string", void!(debug::clear_text())),
    full("query_lights_state", value!(lamps::all(client))),
    full("update_lights_state", void!(lamps::set(client, lights, leaves_client_out))),
    full("update_day_night_cycle", void!(lamps::follow_the_sun(client, on))),
    full("spawn_actor", value!(actor::spawn(description, transform).await)),
    partly(
        "spawn_actor_with_parent",
        "no vehicles or walkers; the bone of a socket does not move what hangs on it",
        value_of_all!(actor::spawn_on),
    ),
    full("destroy_actor", value!(actor::destroy(id).await)),
];

static FURTHER: &[Method] = &[
    full("enable_gbuffers", void!(sensor::enable_textures(camera, on))),
    full("are_gbuffers_enabled", value!(sensor::are_textures_enabled(camera))),
    partly("get_gbuffer_token", NO_MATERIALS, value!(sensor::texture_token(camera, texture))),
    full("set_ignored_vehicles", void!(sensor::ignore_vehicles(id, vehicles).await)),
    partly("enable_sensor_for_ros", NO_EFFECT, no_effect!(StreamId)),
    partly("disable_sensor_for_ros", NO_EFFECT, no_effect!(StreamId)),
    partly("is_sensor_enabled_for_ros", "always false", value!(sensor::is_for_ros(stream))),
    full("send", void!(sensor::send(id, text).await)),
    full("start_recorder", value!(recorder::start(name, additional).await)),
    full("stop_recorder", void!(recorder::stop().await)),
    full("show_recorder_file_info", void!(recorder::info(name, all))).early(),
    full("show_recorder_collisions", void!(recorder::collisions(name, first, second))).early(),
    full("show_recorder_actors_blocked", void!(recorder::blocked(name, secs, cm))).early(),
    full("replay_file", value_of_all!(recorder::replay)),
    full("stop_replayer", void!(recorder::stop_replay(keeps_actors).await)),
    full("set_replayer_time_factor", void!(recorder::set_factor(factor))).early(),
    full("set_replayer_ignore_hero", void!(recorder::set_ignores_hero(ignores))).early(),
    full("set_replayer_ignore_spectator", void!(recorder::set_ignores_spectator(ignores))).early(),
    full("apply_batch", |endpoint, request| Box::pin(batch::answer(endpoint, request)))
        .or(batch::refused),
];
