//! Answers as JSON text.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::coerce::FieldError;
use super::envelope::Refusal;
use crate::episode::{Observation, State};

/// Room for most replies without a picture.
const REPLY_BYTES: usize = 4 * 1024;

/// Reply to reset and step. What an observation says of its end and reward is there twice: clients
/// of either habit find it.
#[derive(Serialize)]
struct Outer<'a> {
    observation: &'a Observation<'a>,
    reward: Option<f64>,
    done: bool,
    metadata: &'a crate::episode::Metadata<'a>,
}

#[derive(Serialize)]
struct Envelope<T> {
    #[serde(rename = "type")]
    kind: &'static str,
    data: T,
}

fn outer<'a>(observation: &'a Observation<'a>) -> Outer<'a> {
    Outer {
        observation,
        reward: observation.reward,
        done: observation.done,
        metadata: &observation.metadata,
    }
}

/// The reply over a WebSocket.
pub(super) fn observation(observation: &Observation<'_>) -> String {
    text(&Envelope { kind: "observation", data: outer(observation) })
}

/// The reply over HTTP, with the session that can go on.
pub(super) fn http_observation(observation: &Observation<'_>, session_id: Option<&str>) -> Value {
    let mut reply = value(&outer(observation));
    if let (Some(id), Some(Value::Object(metadata))) = (session_id, reply.get_mut("metadata")) {
        metadata.insert("session_id".to_owned(), id.into());
    }
    reply
}

/// The reply to a state message.
pub(super) fn state(state: &State<'_>, session_id: &str) -> String {
    let mut data = http_state(state);
    if let Value::Object(data) = &mut data {
        data.insert("session_id".to_owned(), session_id.into());
    }
    text(&Envelope { kind: "state", data })
}

/// The state object alone.
pub(super) fn http_state(state: &State<'_>) -> Value {
    value(state)
}

/// A JSON-RPC response in its envelope.
pub(super) fn mcp(response: &Value) -> String {
    text(&Envelope { kind: "mcp", data: response })
}

/// An error message with further members.
pub(super) fn error(code: &str, message: &str, more: Map<String, Value>) -> String {
    let mut data = Map::new();
    data.insert("message".to_owned(), message.into());
    data.insert("code".to_owned(), code.into());
    data.extend(more);
    text(&Envelope { kind: "error", data })
}

/// The error for a message that is none.
pub(super) fn refusal(refusal: &Refusal) -> String {
    match refusal {
        Refusal::InvalidJson(why) => {
            error("INVALID_JSON", &format!("Invalid JSON: {why}"), Map::new())
        }
        Refusal::UnknownType(kind) => {
            error("UNKNOWN_TYPE", &format!("Unknown message type: {kind}"), Map::new())
        }
        Refusal::Invalid(errors) => {
            let mut more = Map::new();
            more.insert("errors".to_owned(), field_errors(errors));
            error("VALIDATION_ERROR", "Invalid message", more)
        }
    }
}

/// The list of what is wrong.
pub(super) fn field_errors(errors: &[FieldError]) -> Value {
    value(errors)
}

fn value<T: Serialize + ?Sized>(of: &T) -> Value {
    // Maps with text keys and numbers only: the serialiser has nothing to refuse.
    serde_json::to_value(of).unwrap_or_else(|error| json!({ "detail": error.to_string() }))
}

fn text<T: Serialize>(of: &T) -> String {
    let mut text = Vec::with_capacity(REPLY_BYTES);
    match serde_json::to_writer(&mut text, of).map(|()| String::from_utf8(text)) {
        Ok(Ok(text)) => text,
        Ok(Err(error)) => json!({ "detail": error.to_string() }).to_string(),
        Err(error) => json!({ "detail": error.to_string() }).to_string(),
    }
}
