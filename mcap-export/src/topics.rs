//! The topics of a file and what they hold.
//!
//! | topic | schema |
//! |---|---|
//! | `/tf` | `foxglove.FrameTransforms`: `map` to `ego` |
//! | `/map` | `foxglove.SceneUpdate`: edges of lanes |
//! | `/map/opendrive` | `causeway.OpenDrive` |
//! | `/actors` | `foxglove.SceneUpdate`: a box and a name for each, changes only |
//! | `/actors/poses` | `foxglove.PosesInFrame` |
//! | `/traffic_lights` | `foxglove.SceneUpdate`, on change |
//! | `/ego/odometry`, `/ego/pose`, `/ego/fix` | `foxglove.Odometry`, `PoseInFrame`, `LocationFix` |
//! | `/ego/state` | `causeway.Vehicle` |
//! | `/events` | `foxglove.Log`; of sensors: obstacles and crossed marks |
//! | `/weather` | `causeway.Weather`, on change |
//! | `/NAME/image`, `/NAME/calibration` | `foxglove.CompressedImage` or `RawImage`, `CameraCalibration` |
//! | `/NAME/points` | `foxglove.PointCloud`: of lidars and radars |
//! | `/NAME/inertia`, `/NAME/fix` | `causeway.Imu`, `foxglove.LocationFix` |
//! | `/NAME/awareness`, `/NAME/texts` | `causeway.V2xAwareness`, `causeway.V2xTexts`: as they arrive |
//! | `/causeway/frame` | `causeway.wire.Frame`, as FlatBuffers; of exact recordings only |
//!
//! All but the last one are JSON. NAME is what a camera or sensor is called; it has a frame of its
//! own in `/tf`, and its topics are there if it is.

use std::collections::BTreeMap;
use std::io::{self, Write};

use schemas::{ActorId, ActorKind, ActorState, Pose, Weather};
use serde_json::{Value, json};

use crate::container::{ChannelId, Schema, Writer};
use crate::schema;

/// One topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    Tf,
    Map,
    OpenDrive,
    Actors,
    Poses,
    TrafficLights,
    Odometry,
    Pose,
    Fix,
    State,
    Events,
    Weather,
    Frame,
}

/// The channels of one file.
pub(crate) struct Topics {
    fixed: Vec<(Topic, ChannelId)>,
    /// Of cameras and sensors, by topic.
    named: BTreeMap<String, ChannelId>,
}

impl Topics {
    pub(crate) fn open(file: &mut Writer<impl Write>, is_exact: bool) -> io::Result<Self> {
        let nobody = ActorState::at_rest(ActorId::FIRST, ActorKind::Vehicle, 0, Pose::identity());
        let told = [
            (Topic::Tf, "/tf", "foxglove.FrameTransforms", schema::transforms()),
            (Topic::Map, "/map", "foxglove.SceneUpdate", schema::scene()),
            (Topic::OpenDrive, "/map/opendrive", "causeway.OpenDrive", schema::opendrive()),
            (Topic::Actors, "/actors", "foxglove.SceneUpdate", schema::scene()),
            (Topic::Poses, "/actors/poses", "foxglove.PosesInFrame", schema::poses()),
            (Topic::TrafficLights, "/traffic_lights", "foxglove.SceneUpdate", schema::scene()),
            (Topic::Odometry, "/ego/odometry", "foxglove.Odometry", schema::odometry()),
            (Topic::Pose, "/ego/pose", "foxglove.PoseInFrame", schema::pose_in_frame()),
            (Topic::Fix, "/ego/fix", "foxglove.LocationFix", schema::fix()),
            (Topic::State, "/ego/state", "causeway.Vehicle", schema::numbers(&state(&nobody))),
            (Topic::Events, "/events", "foxglove.Log", schema::log()),
            (
                Topic::Weather,
                "/weather",
                "causeway.Weather",
                schema::numbers(&weather(&Weather::CLEAR_NOON)),
            ),
        ];
        let mut channels = Vec::with_capacity(told.len() + 1);
        for (topic, path, name, schema) in told {
            let text = schema.to_string();
            let schema = Schema { name, encoding: "jsonschema", data: text.as_bytes() };
            channels.push((topic, file.channel(path, "json", &schema)?));
        }
        if is_exact {
            let (encoding, data) = ("flatbuffer", schemas::FRAME_SCHEMA);
            let schema = Schema { name: "causeway.wire.Frame", encoding, data };
            channels.push((Topic::Frame, file.channel("/causeway/frame", encoding, &schema)?));
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

/// What is told of the ego, for plots.
pub(crate) fn state(ego: &ActorState) -> Value {
    json!({
        "speed_mps": ego.linear_velocity_mps.norm(),
        "acceleration_mps2": ego.linear_acceleration_mps2.norm(),
        "throttle": ego.control.throttle,
        "brake": ego.control.brake,
        "steer": ego.control.steer,
        "gear": ego.gear,
        "speed_limit_mps": ego.speed_limit_mps,
        "road_wheel_rad": ego.road_wheel_rad,
    })
}

/// CARLA's parameters, angles in radians.
pub(crate) fn weather(weather: &Weather) -> Value {
    json!(weather)
}
