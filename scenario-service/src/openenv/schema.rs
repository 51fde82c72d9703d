//! What the service says of itself and of its messages, as JSON Schema.

use serde_json::{Map, Value, json};

use crate::action::ActionKind;

/// The answer of `/metadata`.
pub(super) fn metadata() -> Value {
    json!({
        "name": "CarlaEnvironment",
        "description": "CarlaEnvironment environment",
        "readme_content": null,
        "version": "1.0.0",
        "author": null,
        "documentation_url": null,
    })
}

/// The answer of `/web/metadata`.
pub(super) fn web_metadata() -> Value {
    let mut metadata = metadata();
    metadata["name"] = "carla_env".into();
    metadata
}

/// The answer of `/schema`.
pub(super) fn all() -> Value {
    json!({
        "action": action(),
        "observation": observation(),
        "state": state(),
        "reset_observation": observation(),
    })
}

/// One member of an object.
struct Field(&'static str, Value, Value, &'static str);

fn object(title: &str, description: &str, closed: bool, fields: Vec<Field>) -> Value {
    let mut properties = Map::new();
    for Field(name, mut schema, default, description) in fields {
        if let Value::Object(schema) = &mut schema {
            schema.insert("default".to_owned(), default);
            schema.insert("description".to_owned(), description.into());
            schema.insert("title".to_owned(), title_of(name).into());
        }
        properties.insert(name.to_owned(), schema);
    }
    json!({
        "additionalProperties": !closed,
        "description": description,
        "properties": properties,
        "title": title,
        "type": "object",
    })
}

/// `goal_distance` reads `Goal Distance`.
fn title_of(name: &str) -> String {
    let word = |word: &str| {
        let mut letters = word.chars();
        letters.next().map_or_else(String::new, |first| {
            first.to_uppercase().collect::<String>() + letters.as_str()
        })
    };
    name.split('_').map(word).collect::<Vec<_>>().join(" ")
}

fn plain(kind: &str) -> Value {
    json!({ "type": kind })
}

fn nullable(schema: &Value) -> Value {
    json!({ "anyOf": [schema, { "type": "null" }] })
}

fn number_in(min: f64, max: f64) -> Value {
    json!({ "type": "number", "minimum": min, "maximum": max })
}

fn triple() -> Value {
    let number = plain("number");
    json!({ "type": "array", "prefixItems": [number, number, number], "minItems": 3, "maxItems": 3 })
}

fn reward() -> Value {
    json!({ "anyOf": [
        { "type": "boolean" }, { "type": "integer" }, { "type": "number" }, { "type": "null" }
    ] })
}

/// An action; no other members are allowed.
pub(super) fn action() -> Value {
    let free = json!({ "type": "object", "additionalProperties": true });
    let kinds: Vec<&str> = ActionKind::ALL.iter().map(|kind| kind.as_str()).collect();
    let kind = json!({ "type": "string", "enum": kinds });
    let number = nullable(&plain("number"));
    let text = nullable(&plain("string"));
    let unit = number_in(0.0, 1.0);
    let steps = nullable(&json!({ "type": "integer", "minimum": 1 }));
    let null = Value::Null;
    let fields = vec![
        Field("metadata", free, json!({}), "Per-step options of this server."),
        Field("action_type", kind, json!("observe"), "What to do."),
        Field("throttle", unit.clone(), json!(0.0), "For control: 0 to 1."),
        Field("steer", number_in(-1.0, 1.0), json!(0.0), "For control: -1 (left) to 1 (right)."),
        Field("brake", unit.clone(), json!(0.0), "For control: 0 to 1."),
        Field("lane_direction", text.clone(), null.clone(), "For lane_change: 'left' or 'right'."),
        Field(
            "target_speed_kmh",
            nullable(&number_in(0.0, 200.0)),
            null.clone(),
            "For maintain_speed; 30 if absent.",
        ),
        Field("brake_intensity", nullable(&unit), null.clone(), "For brake_vehicle; 1 if absent."),
        Field(
            "target_lane_id",
            text.clone(),
            null.clone(),
            "For lane_change: 'lane_<n>', counted from the left.",
        ),
        Field(
            "navigation_behavior",
            text,
            json!("normal"),
            "For init_navigation_agent: 'cautious', 'normal' or 'aggressive'.",
        ),
        Field("destination_x", number.clone(), null.clone(), "For set_destination: metres."),
        Field("destination_y", number.clone(), null.clone(), "For set_destination: metres."),
        Field("destination_z", number, null, "For set_destination: metres; 0 if absent."),
        Field("route_steps", steps, json!(1), "For follow_route: how many steps of the agent."),
    ];
    object("CarlaAction", "What the driver does in one step.", true, fields)
}

/// An observation; no other members are allowed.
pub(super) fn observation() -> Value {
    let number = plain("number");
    let free = json!({ "type": "object", "additionalProperties": true });
    let actors = json!({ "type": "array", "items": free.clone() });
    let origin = json!([0.0, 0.0, 0.0]);
    let (null, zero, empty) = (Value::Null, json!(0.0), json!(""));
    let (text, flag) = (plain("string"), plain("boolean"));
    let (number_or_null, text_or_null) = (nullable(&number), nullable(&text));
    let fields = vec![
        Field("done", flag.clone(), json!(false), "Whether the episode is over."),
        Field("reward", reward(), null.clone(), "Of this step; null at reset."),
        Field("metadata", free, json!({}), "Outcome, events, simulation, goal."),
        Field("scene_description", text.clone(), empty.clone(), "The scene in words."),
        Field("speed_kmh", number.clone(), zero.clone(), "Of the ego, km/h."),
        Field("location", triple(), origin.clone(), "CARLA frame: x, y (right), z (up), metres."),
        Field("rotation", triple(), origin, "Pitch, yaw (clockwise), roll, degrees."),
        Field("goal_distance", number_or_null.clone(), null.clone(), "In the plane, metres."),
        Field(
            "goal_direction",
            text_or_null.clone(),
            null.clone(),
            "'east', 'north', 'west' or 'south'; 'north' is +y of the CARLA frame.",
        ),
        Field("current_lane", text.clone(), json!("unknown"), "'lane_<n>', counted from the left."),
        Field("nearby_actors", actors, json!([]), "Vehicles and pedestrians, nearest first."),
        Field("collision_detected", flag, json!(false), "Whether anything was hit so far."),
        Field("collision_intensity", number.clone(), zero.clone(), "Of the worst hit, km/h."),
        Field("collided_with", text_or_null.clone(), null.clone(), "Type of the first thing hit."),
        Field("scenario_name", text.clone(), empty.clone(), "Of the episode."),
        Field("simulation_time", number, zero, "Seconds since the beginning."),
        Field("step_number", plain("integer"), json!(0), "Steps so far, pictures not counted."),
        Field("done_reason", text, empty, "Why the episode is over."),
        Field("rubric_reward", number_or_null, null.clone(), "What to train on."),
        Field("camera_image", text_or_null, null, "Base64 of a JPEG, for capture_image."),
    ];
    object("CarlaObservation", "What the driver sees after one step.", true, fields)
}

/// The state; more members may come.
pub(super) fn state() -> Value {
    let (number, integer, text) = (plain("number"), plain("integer"), plain("string"));
    let free = json!({ "type": "object", "additionalProperties": true });
    let (zero, none) = (json!(0.0), json!(0));
    let fields = vec![
        Field("episode_id", nullable(&text), Value::Null, "Null before the first reset."),
        Field("step_count", integer.clone(), none.clone(), "Every step message."),
        Field("scenario_name", text.clone(), json!("default"), "Of the episode."),
        Field("town", text.clone(), json!("Town10HD_Opt"), "The map."),
        Field("weather", text, json!("ClearNoon"), "The weather preset."),
        Field("total_distance", number.clone(), zero.clone(), "Metres driven."),
        Field("total_reward", number.clone(), zero.clone(), "Until the episode was over."),
        Field("simulation_time", number.clone(), zero.clone(), "Seconds since the beginning."),
        Field("num_turns", integer.clone(), none.clone(), "Steps, pictures not counted."),
        Field("total_tool_calls", integer.clone(), none.clone(), "The same."),
        Field("tool_call_counts", free.clone(), json!({}), "Per action_type."),
        Field("is_truncated", plain("boolean"), json!(false), "Ended by the step limit."),
        Field("average_speed", number.clone(), zero.clone(), "km/h at the ends of steps."),
        Field("max_speed", number.clone(), zero.clone(), "km/h at the ends of steps."),
        Field(
            "collisions",
            json!({ "type": "array", "items": free.clone() }),
            json!([]),
            "First contact with each thing.",
        ),
        Field("collisions_count", integer, none, "How many."),
        Field("collision_intensity_total", number, zero, "Sum of closing speeds, km/h."),
        Field("scenario_data", free, json!({}), "Goal, info and outcome of the scenario."),
    ];
    object("CarlaState", "What can be asked about an episode at any time.", false, fields)
}
