//! The topics of a file and what they hold.
//!
//! | topic | schema |
//! |---|---|
//! | `/tf` | `foxglove.FrameTransforms`: `map` to `ego`, and to others with its role |
//! | `/tf_static` | `foxglove.FrameTransforms`: what the ego carries, told again when it is moved |
//! | `/map` | `foxglove.SceneUpdate`: lanes, marks, crossings, signs, posts of lights |
//! | `/map/opendrive` | `causeway.OpenDrive` |
//! | `/actors` | `foxglove.SceneUpdate`: a box, an arrow and a name for each, changes only |
//! | `/actors/poses` | `foxglove.PosesInFrame` |
//! | `/traffic_lights` | `foxglove.SceneUpdate`, on change |
//! | `/ego/odometry`, `/ego/pose`, `/ego/fix` | `foxglove.Odometry`, `PoseInFrame`, `LocationFix` |
//! | `/ego/state` | `causeway.Vehicle` |
//! | `/ego/path` | `foxglove.PosesInFrame`: the way of a navigation agent, when it changes |
//! | `/events` | `foxglove.Log`; of sensors: obstacles and crossed marks |
//! | `/weather` | `causeway.Weather`, on change |
//! | `/NAME/image`, `/NAME/calibration` | `foxglove.CompressedImage` or `RawImage`, `CameraCalibration` |
//! | `/NAME/annotations` | `foxglove.ImageAnnotations`: the boxes of actors, on demand |
//! | `/NAME/points` | `foxglove.PointCloud`: of lidars and radars |
//! | `/NAME/inertia`, `/NAME/fix` | `causeway.Imu`, `foxglove.LocationFix` |
//! | `/NAME/awareness`, `/NAME/texts` | `causeway.V2xAwareness`, `causeway.V2xTexts`: as they arrive |
//! | `/causeway/frame` | `causeway.wire.Frame`, as FlatBuffers; of exact recordings only |
//! | `/causeway/commands` | `causeway.Commands`: what was done before a tick; of whole journals only |
//!
//! All but the frame are JSON. NAME is what a camera or sensor is called; it has a frame of its
//! own in `/tf_static` or `/tf`, and its topics are there if it is. With [`Names::Nuscenes`] some
//! have other names, and `/map`, `/drivable_area` (`foxglove.Grid`) and `/markers/car` are there.

use std::collections::BTreeMap;
use std::io::{self, Write};

use schemas::{ActorId, ActorKind, ActorState, Pose, TrafficLightColour, Weather};
use serde_json::{Value, json};

use crate::container::{ChannelId, Schema, Writer};
use crate::names::{self, Names, path};
use crate::schema;
use crate::topic::Topic;

/// What is known of the frames of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Has {
    /// They are rebuilt.
    Poses,
    /// They are those of the world.
    Frames,
    /// And all that was done is there.
    FramesAndCommands,
}

/// The channels of one file.
pub(crate) struct Topics {
    fixed: Vec<(Topic, ChannelId)>,
    /// Of cameras and sensors, by topic.
    named: BTreeMap<String, ChannelId>,
}

impl Topics {
    pub(crate) fn open(file: &mut Writer<impl Write>, names: Names, has: Has) -> io::Result<Self> {
        let mut channels: Vec<(Topic, ChannelId)> = Vec::new();
        for (topic, name, schema) in json_topics() {
            let is_there = topic != Topic::Commands || has == Has::FramesAndCommands;
            let Some(path) = path(names, topic).filter(|_| is_there) else { continue };
            let same = channels.iter().find(|(other, _)| names::path(names, *other) == Some(path));
            let channel = match same {
                Some((_, channel)) => *channel,
                None => {
                    let text = schema.to_string();
                    let schema = Schema { name, encoding: "jsonschema", data: text.as_bytes() };
                    file.channel(path, "json", &schema)?
                }
            };
            channels.push((topic, channel));
        }
        if has != Has::Poses {
            let (encoding, data) = ("flatbuffer", schemas::FRAME_SCHEMA);
            let schema = Schema { name: "causeway.wire.Frame", encoding, data };
            channels.push((Topic::Frame, file.channel(crate::FRAMES, encoding, &schema)?));
        }
        Ok(Self { fixed: channels, named: BTreeMap::new() })
    }

    /// `None` for a topic that the file does not have.
    pub(crate) fn channel(&self, topic: Topic) -> Option<ChannelId> {
        self.fixed.iter().find(|(one, _)| *one == topic).map(|(_, channel)| *channel)
    }

    /// The channel of a camera's or sensor's topic, made when it is first needed.
    pub(crate) fn named(
        &mut self,
        file: &mut Writer<impl Write>,
        path: String,
        (name, schema): (&str, impl FnOnce() -> Value),
    ) -> io::Result<ChannelId> {
        if let Some(channel) = self.named.get(&path) {
            return Ok(*channel);
        }
        let text = schema().to_string();
        let schema = Schema { name, encoding: "jsonschema", data: text.as_bytes() };
        let channel = file.channel(&path, "json", &schema)?;
        self.named.insert(path, channel);
        Ok(channel)
    }
}

/// Topics whose messages are JSON, with the names of their schemas.
fn json_topics() -> Vec<(Topic, &'static str, Value)> {
    let nobody = ActorState::at_rest(ActorId::FIRST, ActorKind::Vehicle, 0, Pose::identity());
    let state = schema::numbers(&state(&nobody, None, TrafficLightColour::Unknown));
    vec![
        (Topic::Tf, "foxglove.FrameTransforms", schema::transforms()),
        (Topic::TfStatic, "foxglove.FrameTransforms", schema::transforms()),
        (Topic::Map, "foxglove.SceneUpdate", schema::scene()),
        (Topic::OpenDrive, "causeway.OpenDrive", schema::opendrive()),
        (Topic::Actors, "foxglove.SceneUpdate", schema::scene()),
        (Topic::Poses, "foxglove.PosesInFrame", schema::poses()),
        (Topic::TrafficLights, "foxglove.SceneUpdate", schema::scene()),
        (Topic::Odometry, "foxglove.Odometry", schema::odometry()),
        (Topic::Pose, "foxglove.PoseInFrame", schema::pose_in_frame()),
        (Topic::Fix, "foxglove.LocationFix", schema::fix()),
        (Topic::State, "causeway.Vehicle", state),
        (Topic::Path, "foxglove.PosesInFrame", schema::poses()),
        (Topic::Events, "foxglove.Log", schema::log()),
        (Topic::Weather, "causeway.Weather", schema::numbers(&weather(&Weather::CLEAR_NOON))),
        (Topic::Commands, "causeway.Commands", schema::commands()),
        (Topic::Grid, "foxglove.Grid", schema::grid()),
        (Topic::Drivable, "foxglove.Grid", schema::grid()),
        (Topic::Car, "foxglove.SceneUpdate", schema::scene()),
    ]
}

/// What is told of the ego, for plots: its lane as OpenDRIVE counts them, 0 for none, and what the
/// light shows that it is at: 1 red, 2 yellow, 3 green, 0 none of these.
pub(crate) fn state(ego: &ActorState, lane: Option<i32>, light: TrafficLightColour) -> Value {
    let light = match light {
        TrafficLightColour::Red => 1,
        TrafficLightColour::Yellow => 2,
        TrafficLightColour::Green => 3,
        TrafficLightColour::Off | TrafficLightColour::Unknown => 0,
    };
    json!({
        "speed_mps": ego.linear_velocity_mps.norm(),
        "acceleration_mps2": ego.linear_acceleration_mps2.norm(),
        "throttle": ego.control.throttle,
        "brake": ego.control.brake,
        "steer": ego.control.steer,
        "gear": ego.gear,
        "speed_limit_mps": ego.speed_limit_mps,
        "road_wheel_rad": ego.road_wheel_rad,
        "lane": lane.unwrap_or(0),
        "light": light,
    })
}

/// CARLA's parameters, angles in radians.
pub(crate) fn weather(weather: &Weather) -> Value {
    json!(weather)
}
