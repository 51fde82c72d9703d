//! JSON schemas of messages: of Foxglove's kinds the fields that are written here.

use serde_json::{Map, Value, json};

fn object(fields: &[(&str, Value)]) -> Value {
    let properties: Map<String, Value> =
        fields.iter().map(|(name, kind)| ((*name).to_owned(), kind.clone())).collect();
    json!({"type": "object", "properties": properties})
}

fn array(of: &Value) -> Value {
    json!({"type": "array", "items": of})
}

fn number() -> Value {
    json!({"type": "number"})
}

fn integer() -> Value {
    json!({"type": "integer"})
}

fn text() -> Value {
    json!({"type": "string"})
}

fn time() -> Value {
    object(&[("sec", integer()), ("nsec", integer())])
}

fn vector() -> Value {
    object(&[("x", number()), ("y", number()), ("z", number())])
}

fn quaternion() -> Value {
    object(&[("x", number()), ("y", number()), ("z", number()), ("w", number())])
}

fn colour() -> Value {
    object(&[("r", number()), ("g", number()), ("b", number()), ("a", number())])
}

fn pose() -> Value {
    object(&[("position", vector()), ("orientation", quaternion())])
}

/// An object of numbers, like this one.
pub(crate) fn numbers(example: &Value) -> Value {
    let names = example.as_object().into_iter().flat_map(Map::keys);
    let fields: Vec<(&str, Value)> = names.map(|name| (name.as_str(), number())).collect();
    object(&fields)
}

pub(crate) fn opendrive() -> Value {
    object(&[("name", text()), ("digest", text()), ("text", text())])
}

pub(crate) fn transforms() -> Value {
    let transform = object(&[
        ("timestamp", time()),
        ("parent_frame_id", text()),
        ("child_frame_id", text()),
        ("translation", vector()),
        ("rotation", quaternion()),
    ]);
    object(&[("transforms", array(&transform))])
}

/// What was done before a tick, as requests of the bus.
pub(crate) fn commands() -> Value {
    object(&[("tick", integer()), ("wanted_secs", text()), ("requests", array(&data()))])
}

/// Ground in squares.
pub(crate) fn grid() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("pose", pose()),
        ("column_count", integer()),
        ("cell_size", flat()),
        ("row_stride", integer()),
        ("cell_stride", integer()),
        ("fields", array(&field())),
        ("data", data()),
    ])
}

/// Outlines and texts over a picture, in pixels.
pub(crate) fn annotations() -> Value {
    let lines = object(&[
        ("timestamp", time()),
        ("type", integer()),
        ("points", array(&flat())),
        ("outline_color", colour()),
        ("outline_colors", array(&colour())),
        ("fill_color", colour()),
        ("thickness", number()),
    ]);
    let label = object(&[
        ("timestamp", time()),
        ("position", flat()),
        ("text", text()),
        ("font_size", number()),
        ("text_color", colour()),
        ("background_color", colour()),
    ]);
    let circles = array(&json!({"type": "object"}));
    object(&[("circles", circles), ("points", array(&lines)), ("texts", array(&label))])
}

fn flat() -> Value {
    object(&[("x", number()), ("y", number())])
}

/// A part of each point or cell.
fn field() -> Value {
    object(&[("name", text()), ("offset", integer()), ("type", integer())])
}

pub(crate) fn poses() -> Value {
    object(&[("timestamp", time()), ("frame_id", text()), ("poses", array(&pose()))])
}

pub(crate) fn pose_in_frame() -> Value {
    object(&[("timestamp", time()), ("frame_id", text()), ("pose", pose())])
}

pub(crate) fn odometry() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("body_frame_id", text()),
        ("pose", pose()),
        ("linear_velocity", vector()),
        ("angular_velocity", vector()),
    ])
}

pub(crate) fn fix() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("latitude", number()),
        ("longitude", number()),
        ("altitude", number()),
        ("position_covariance", array(&number())),
        ("position_covariance_type", integer()),
    ])
}

pub(crate) fn log() -> Value {
    object(&[
        ("timestamp", time()),
        ("level", integer()),
        ("message", text()),
        ("name", text()),
        ("file", text()),
        ("line", integer()),
    ])
}

/// Bytes, as JSON has them.
fn data() -> Value {
    json!({"type": "string", "contentEncoding": "base64"})
}

pub(crate) fn compressed_image() -> Value {
    object(&[("timestamp", time()), ("frame_id", text()), ("data", data()), ("format", text())])
}

pub(crate) fn raw_image() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("width", integer()),
        ("height", integer()),
        ("encoding", text()),
        ("step", integer()),
        ("data", data()),
    ])
}

pub(crate) fn calibration() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("width", integer()),
        ("height", integer()),
        ("distortion_model", text()),
        ("D", array(&number())),
        ("K", array(&number())),
        ("R", array(&number())),
        ("P", array(&number())),
    ])
}

pub(crate) fn points() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("pose", pose()),
        ("point_stride", integer()),
        ("fields", array(&field())),
        ("data", data()),
    ])
}

pub(crate) fn inertia() -> Value {
    object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("acceleration_mps2", vector()),
        ("angular_velocity_radps", vector()),
        ("compass_rad", number()),
    ])
}

/// What stations say of themselves, as it arrives at a sensor.
pub(crate) fn awareness() -> Value {
    received(&[
        ("kind", integer()),
        ("made_secs", number()),
        ("latitude_deg", number()),
        ("longitude_deg", number()),
        ("altitude_m", number()),
        ("heading_deg", number()),
        ("speed_mps", number()),
        ("lights", integer()),
    ])
}

/// Texts, as they arrive at a sensor.
pub(crate) fn texts() -> Value {
    received(&[("text", text())])
}

fn received(says: &[(&str, Value)]) -> Value {
    let from = [("station", integer()), ("power_dbm", number())];
    let message = object(&[&from, says].concat());
    object(&[("timestamp", time()), ("frame_id", text()), ("messages", array(&message))])
}

pub(crate) fn scene() -> Value {
    let deletion = object(&[("timestamp", time()), ("type", integer()), ("id", text())]);
    let solid = object(&[("pose", pose()), ("size", vector()), ("color", colour())]);
    let line = object(&[
        ("type", integer()),
        ("pose", pose()),
        ("thickness", number()),
        ("scale_invariant", json!({"type": "boolean"})),
        ("points", array(&vector())),
        ("color", colour()),
        ("colors", array(&colour())),
        ("indices", array(&integer())),
    ]);
    let label = object(&[
        ("pose", pose()),
        ("billboard", json!({"type": "boolean"})),
        ("font_size", number()),
        ("scale_invariant", json!({"type": "boolean"})),
        ("color", colour()),
        ("text", text()),
    ]);
    let triangles = object(&[
        ("pose", pose()),
        ("points", array(&vector())),
        ("color", colour()),
        ("colors", array(&colour())),
        ("indices", array(&integer())),
    ]);
    let arrow = object(&[
        ("pose", pose()),
        ("shaft_length", number()),
        ("shaft_diameter", number()),
        ("head_length", number()),
        ("head_diameter", number()),
        ("color", colour()),
    ]);
    let nothing = array(&json!({"type": "object"}));
    let entity = object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("id", text()),
        ("lifetime", time()),
        ("frame_locked", json!({"type": "boolean"})),
        ("metadata", array(&object(&[("key", text()), ("value", text())]))),
        ("arrows", array(&arrow)),
        ("cubes", array(&solid)),
        ("spheres", array(&solid)),
        ("cylinders", nothing.clone()),
        ("lines", array(&line)),
        ("triangles", array(&triangles)),
        ("texts", array(&label)),
        ("models", nothing),
    ]);
    object(&[("deletions", array(&deletion)), ("entities", array(&entity))])
}
