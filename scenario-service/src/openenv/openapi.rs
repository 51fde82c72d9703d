//! The OpenAPI document of the HTTP endpoints.

use serde_json::{Map, Value, json};

use super::{Mode, schema};

/// The document for the endpoints of a mode.
pub(super) fn document(mode: Mode) -> Value {
    let mut paths = Paths::default();
    let free = || json!({ "type": "object", "additionalProperties": true });
    if mode == Mode::Simulation {
        paths.post("/reset", "Begin an episode", reset_body(), step_answer());
        paths.post("/step", "Take one action", step_body(), step_answer());
        paths.get("/state", "State of a session", schema::state());
        paths.post("/snapshots", "Keep the state of a session", fork_body(), free());
        paths.get("/snapshots", "States that are kept", free());
        paths.delete("/snapshots/{id}", "Give one of them up");
        paths.post("/fork", "Sessions that go on from one", fork_body(), free());
    }
    paths.get("/metadata", "What this environment is", free());
    paths.get("/health", "Whether it is up", free());
    paths.get("/schema", "Schemas of actions, observations and states", free());
    paths.post("/mcp", "JSON-RPC", free(), free());
    paths.get("/metrics", "Sessions in use", free());
    let list = json!({ "type": "array" });
    paths.get("/list_environments", "Environments with tasks", list.clone());
    paths.get("/{environment}/splits", "Splits of its tasks", list);
    for (path, summary) in [
        ("/{environment}/tasks", "Tasks of a split"),
        ("/{environment}/num_tasks", "How many tasks a split has"),
        ("/{environment}/task", "One task of a split, by its index"),
        ("/{environment}/task_range", "Tasks of a split, from one index to before another"),
    ] {
        paths.post(path, summary, task_body(), free());
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "OpenEnv Environment HTTP API",
            "description": "Driving scenarios. Episodes usually run over the WebSocket /ws.",
            "version": "1.0.0",
        },
        "paths": paths.0,
    })
}

/// The paths of the document.
#[derive(Default)]
struct Paths(Map<String, Value>);

impl Paths {
    fn get(&mut self, path: &str, summary: &str, answer: Value) {
        self.add(path, "get", json!({ "summary": summary, "responses": answered(answer) }));
    }

    fn post(&mut self, path: &str, summary: &str, body: Value, answer: Value) {
        let body = json!({ "content": { "application/json": { "schema": body } } });
        let operation =
            json!({ "summary": summary, "requestBody": body, "responses": answered(answer) });
        self.add(path, "post", operation);
    }

    /// Answers without content.
    fn delete(&mut self, path: &str, summary: &str) {
        let responses = json!({ "204": { "description": "Done" } });
        self.add(path, "delete", json!({ "summary": summary, "responses": responses }));
    }

    fn add(&mut self, path: &str, method: &str, mut operation: Value) {
        let names = path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
        let parameters: Vec<Value> = names
            .map(|name| {
                json!({ "name": name, "in": "path", "required": true,
                    "schema": { "type": "string" } })
            })
            .collect();
        if !parameters.is_empty() {
            operation["parameters"] = parameters.into();
        }
        let methods = self.0.entry(path).or_insert_with(|| Value::Object(Map::new()));
        methods[method] = operation;
    }
}

fn answered(answer: Value) -> Value {
    json!({ "200": { "description": "Successful Response",
        "content": { "application/json": { "schema": answer } } } })
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

fn task_body() -> Value {
    let index = |what: &str| json!({ "type": "integer", "minimum": 0, "description": what });
    json!({ "type": "object", "additionalProperties": false, "required": ["split"], "properties": {
        "split": { "type": "string" },
        "index": index("Of one task."),
        "start": index("Of the first one of a range."),
        "stop": index("Of the first one behind a range."),
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
