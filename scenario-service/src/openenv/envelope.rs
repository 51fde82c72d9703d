//! Messages of a WebSocket client, checked.

use serde_json::{Map, Value};

use super::coerce::{self, FieldError, Reader};
use super::json;
use crate::action::Action;
use crate::limits::{ECHO_CHARS_MAX, ID_CHARS_MAX};
use crate::session::ResetRequest;

/// What a client wants.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Message {
    /// Begin an episode.
    Reset(ResetRequest),
    /// Do something.
    Step(Box<Action>),
    /// Tell the state.
    State,
    /// End the session.
    Close,
    /// A JSON-RPC request.
    Mcp(Value),
}

/// Why a message is none; the session goes on.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Refusal {
    /// No JSON, or no object.
    InvalidJson(String),
    /// A type nobody knows.
    UnknownType(String),
    /// Known members with wrong values.
    Invalid(Vec<FieldError>),
}

/// A message from the text of a frame.
pub(super) fn parse(text: &str) -> Result<Message, Refusal> {
    let value = json::parse(text).map_err(Refusal::InvalidJson)?;
    let Value::Object(message) = value else {
        return Err(Refusal::InvalidJson(
            "Expecting an object: line 1 column 1 (char 0)".to_owned(),
        ));
    };
    let kind = match message.get("type") {
        None => "",
        Some(Value::Null) => "None",
        Some(Value::String(kind)) => kind,
        Some(other) => return Err(unknown_type(&other.to_string())),
    };
    match kind {
        "reset" => {
            let data = data_of(&message, Some(&Map::new()))?;
            reset_request(&data).map(Message::Reset).map_err(Refusal::Invalid)
        }
        "step" => {
            let data = data_of(&message, None)?;
            coerce::action(&data).map(Box::new).map(Message::Step).map_err(Refusal::Invalid)
        }
        "mcp" => Ok(Message::Mcp(Value::Object(data_of(&message, None)?))),
        "state" => without_data(&message).map(|()| Message::State),
        "close" => without_data(&message).map(|()| Message::Close),
        other => Err(unknown_type(other)),
    }
}

fn unknown_type(kind: &str) -> Refusal {
    Refusal::UnknownType(kind.chars().take(ECHO_CHARS_MAX).collect())
}

/// The member `data`, which must be an object, and nothing else beside it and the type.
fn data_of(
    message: &Map<String, Value>,
    default: Option<&Map<String, Value>>,
) -> Result<Map<String, Value>, Refusal> {
    let mut read = Reader::new(message);
    read.optional_text("type");
    let data = match (message.contains_key("data"), default) {
        (false, None) => {
            let whole = Value::Object(message.clone());
            return Err(Refusal::Invalid(vec![FieldError::missing("data", &whole)]));
        }
        (false, Some(default)) => default.clone(),
        (true, _) => read.object("data").cloned().unwrap_or_default(),
    };
    read.finish_closed(data).map_err(Refusal::Invalid)
}

fn without_data(message: &Map<String, Value>) -> Result<(), Refusal> {
    let mut read = Reader::new(message);
    read.optional_text("type");
    read.finish_closed(()).map_err(Refusal::Invalid)
}

/// The arguments of a reset; unknown ones are ignored.
pub(super) fn reset_request(data: &Map<String, Value>) -> Result<ResetRequest, Vec<FieldError>> {
    let mut read = Reader::new(data);
    let request = ResetRequest {
        seed: read.optional_seed("seed"),
        episode_id: read.optional_short_text("episode_id", ID_CHARS_MAX),
        scenario_name: read.optional_text("scenario_name"),
        scenario_config: read.optional_object("scenario_config").cloned().unwrap_or_default(),
        snapshot_id: read.optional_short_text("snapshot_id", ID_CHARS_MAX),
        join: read.optional_short_text("join", ID_CHARS_MAX),
        ego: read.optional_short_text("ego", ID_CHARS_MAX),
    };
    read.finish_open(request)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    fn locs(text: &str) -> Vec<(&'static str, Value)> {
        match parse(text) {
            Err(Refusal::Invalid(errors)) => {
                errors.into_iter().map(|error| (error.kind, Value::Array(error.loc))).collect()
            }
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn a_reset_takes_what_it_knows_and_ignores_the_rest() {
        let text = r#"{"type":"reset","data":{"scenario_name":"trolley_equal","seed":7,"other":1,
            "episode_id":null,"scenario_config":{"max_steps":3}}}"#;
        let Ok(Message::Reset(request)) = parse(text) else { panic!("{:?}", parse(text)) };
        assert_eq!(request.scenario_name.as_deref(), Some("trolley_equal"));
        assert_eq!((request.seed, request.episode_id), (Some(7), None));
        assert_eq!(request.scenario_config["max_steps"], json!(3));
        assert_eq!(parse(r#"{"type":"reset"}"#), Ok(Message::Reset(ResetRequest::default())));
    }

    #[test]
    fn wrong_envelopes_name_the_member() {
        assert_eq!(locs(r#"{"type":"step"}"#), [("missing", json!(["data"]))]);
        assert_eq!(locs(r#"{"type":"step","data":null}"#), [("dict_type", json!(["data"]))]);
        assert_eq!(locs(r#"{"type":"reset","data":[]}"#), [("dict_type", json!(["data"]))]);
        assert_eq!(
            locs(r#"{"type":"step","data":{},"extra":1}"#),
            [("extra_forbidden", json!(["extra"]))]
        );
        assert_eq!(locs(r#"{"type":"state","data":{}}"#), [("extra_forbidden", json!(["data"]))]);
        assert_eq!(
            locs(r#"{"type":"step","data":{"throttle":NaN}}"#),
            [("less_than_equal", json!(["throttle"]))]
        );
        assert_eq!(
            locs(r#"{"type":"reset","data":{"seed":-1,"episode_id":5}}"#),
            [("greater_than_equal", json!(["seed"])), ("string_type", json!(["episode_id"]))]
        );
    }

    #[test]
    fn unknown_types_and_no_json_say_so() {
        for (text, kind) in [
            (r#"{"type":"fly"}"#, "fly"),
            (r#"{}"#, ""),
            (r#"{"type":null}"#, "None"),
            (r#"{"type":5}"#, "5"),
        ] {
            assert_eq!(parse(text), Err(Refusal::UnknownType(kind.to_owned())));
        }
        for text in ["", "nope", "[]", "5", "null", "{", "\u{0}"] {
            assert!(matches!(parse(text), Err(Refusal::InvalidJson(_))), "{text}");
        }
        // Deep nesting is refused by the parser, not met on the stack.
        assert!(matches!(parse(&"[".repeat(100_000)), Err(Refusal::InvalidJson(_))));
    }

    proptest! {
        #[test]
        fn no_text_panics(text in ".{0,60}") {
            let _ = parse(&text);
        }
    }
}
