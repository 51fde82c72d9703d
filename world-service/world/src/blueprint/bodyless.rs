//! What is in a world without a body: sensors, signals of the map, markers.

use schemas::ActorKind;

use super::{Blueprint, BodySpec};

const SENSORS: [&str; 18] = [
    "sensor.camera.depth",
    "sensor.camera.dvs",
    "sensor.camera.instance_segmentation",
    "sensor.camera.normals",
    "sensor.camera.optical_flow",
    "sensor.camera.rgb",
    "sensor.camera.semantic_segmentation",
    "sensor.lidar.ray_cast",
    "sensor.lidar.ray_cast_semantic",
    "sensor.other.collision",
    "sensor.other.gnss",
    "sensor.other.imu",
    "sensor.other.lane_invasion",
    "sensor.other.obstacle",
    "sensor.other.radar",
    "sensor.other.rss",
    "sensor.other.v2x",
    "sensor.other.v2x_custom",
];
const SIGNS: [&str; 3] = ["traffic.speed_limit", "traffic.stop", "traffic.yield"];
const MARKERS: [&str; 3] = ["controller.ai.walker", "spectator", "static.trigger.friction"];

pub(super) fn all() -> impl Iterator<Item = Blueprint> {
    let of_kind = |ids: &'static [&str], kind| {
        ids.iter().map(move |&id| Blueprint { id: id.to_owned(), body: BodySpec::None(kind) })
    };
    of_kind(&SENSORS, ActorKind::Sensor)
        .chain(of_kind(&SIGNS, ActorKind::TrafficSign))
        .chain(of_kind(&["traffic.traffic_light"], ActorKind::TrafficLight))
        .chain(of_kind(&MARKERS, ActorKind::Marker))
}
