//! The OpenAPI document of the HTTP endpoints.

use serde_json::{Map, Value, json};

use super::{Mode, schema};

/// The document for the endpoints of a mode.
pub(super) fn document(mode: Mode) -> Value {
    let mut paths = Map::new();
    let mut add = |path: &str, method: &str, summary: &str, body: Option<Value>, answer: Value| {
        let mut operation = json!({
            "summary": summary,
            "responses": { "200": { "description": "Successful Response",
                "content": { "application/json": { "schema": answer } } } },
        });
        if let Some(body) = body {
            operation["requestBody"] =
                json!({ "content": { "application/json": { "schema": body } } });
        }
        let methods = paths.entry(path).or_insert_with(|| Value::Object(Map::new()));
        if let Value::Object(methods) = methods {
            methods.insert(method.to_owned(), operation);
        }
    };
    let free = || json!({ "type": "object", "additionalProperties": true });
    if mode == Mode::Simulation {
        add("/reset", "post", "Begin an episode", Some(reset_body()), step_answer());
        add("/step", "post", "Take one action", Some(step_body()), step_answer());
        add("/state", "get", "State of a session", None, schema::state());
        add("/snapshots", "post", "Keep the state of a session", Some(fork_body()), free());
        add("/snapshots", "get", "States that are kept", None, free());
        add("/snapshots/{id}", "delete", "Give one of them up", None, free());
        add("/fork", "post", "Sessions that go on from one", Some(fork_body()), free());
    }
    add("/metadata", "get", "What this environment is", None, free());
    add("/health", "get", "Whether it is up", None, free());
    add("/schema", "get", "Schemas of actions, observations and states", None, free());
    add("/mcp", "post", "JSON-RPC", Some(free()), free());
    add("/metrics", "get", "Sessions in use", None, free());
    add("/list_environments", "get", "Environments with tasks", None, json!({ "type": "array" }));
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "OpenEnv Environment HTTP API",
            "description": "Driving scenarios. Episodes usually run over the WebSocket /ws.",
            "version": "1.0.0",
        },
        "paths": paths,
    })
}

fn reset_body() -> Value {
    json!({ "type": "object", "additionalProperties": true, "properties": {
        "seed": { "anyOf": [
            { "type": "integer", "minimum": 0, "maximum": u64::MAX },
            { "type": "null" },
        ] },
        "episode_id": { "anyOf": [{ "type": "string", "maxLength": 255 }, { "type": "null" }] },
        "scenario_name": { "anyOf": [{ "type": "string" }, { "type": "null" }] },
        "scenario_config": { "anyOf": [{ "type": "object" }, { "type": "null" }] },
        "session_id": { "type": "string", "description": "Of a session to go on; empty for a new one." },
    } })
}

fn fork_body() -> Value {
    json!({ "type": "object", "required": ["session_id"], "properties": {
        "session_id": { "type": "string", "description": "Of the session that is kept." },
        "count": { "type": "integer", "minimum": 1, "description": "Sessions of a fork." },
    } })
}

fn step_body() -> Value {
    json!({ "type": "object", "additionalProperties": true, "required": ["action"], "properties": {
        "action": schema::action(),
        "timeout_s": { "anyOf": [{ "type": "number", "exclusiveMinimum": 0 }, { "type": "null" }] },
        "request_id": { "anyOf": [{ "type": "string", "maxLength": 255 }, { "type": "null" }] },
        "session_id": { "type": "string", "description": "Of a session to go on." },
    } })
}

fn step_answer() -> Value {
    json!({ "type": "object", "required": ["observation", "done"], "properties": {
        "observation": schema::observation(),
        "reward": { "anyOf": [{ "type": "number" }, { "type": "null" }] },
        "done": { "type": "boolean" },
        "metadata": { "anyOf": [{ "type": "object" }, { "type": "null" }] },
    } })
}
