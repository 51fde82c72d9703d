//! JSON-RPC as OpenEnv's tools expect it: sessions can be made and closed; there are no tools yet.

use serde_json::{Map, Value, json};

use crate::limits::ECHO_CHARS_MAX;
use crate::session::table::{Closed, Life, OpenError, TenantSessions};

const PARSE_ERROR: i32 = -32_700;
const INVALID_REQUEST: i32 = -32_600;
const METHOD_NOT_FOUND: i32 = -32_601;
const INVALID_PARAMS: i32 = -32_602;
const INTERNAL_ERROR: i32 = -32_603;
const CAPACITY: i32 = -32_000;

struct Request<'a> {
    id: &'a Value,
    method: &'a str,
    params: Option<&'a Map<String, Value>>,
}

/// The response to one request; `own_session` is that of the connection, if it has one.
pub(super) fn answer(
    sessions: &TenantSessions,
    own_session: Option<&str>,
    request: &Value,
) -> Value {
    let Value::Object(object) = request else { return parse_error(None) };
    let request = match read(object) {
        Ok(request) => request,
        Err(why) => {
            let id = object.get("id").filter(|id| is_id(id)).unwrap_or(&Value::Null);
            return error(id, INVALID_REQUEST, &format!("Invalid request: {why}"), Value::Null);
        }
    };
    let id = request.id;
    match request.method {
        "openenv/session/create" => create(sessions, own_session, id),
        "openenv/session/close" => close(sessions, own_session, &request),
        method => {
            let session_id = request.params.and_then(|params| params.get("session_id"));
            if let Some(unknown) = session_id.filter(|id| !is_known(sessions, id)) {
                return error(id, INVALID_PARAMS, &unknown_session(unknown), Value::Null);
            }
            if matches!(method, "tools/list" | "tools/call") {
                return error(id, INTERNAL_ERROR, "Environment does not support MCP", Value::Null);
            }
            let method: String = method.chars().take(ECHO_CHARS_MAX).collect();
            error(id, METHOD_NOT_FOUND, &format!("Method not found: {method}"), Value::Null)
        }
    }
}

/// The response to what is no JSON, or no object.
pub(super) fn parse_error(detail: Option<&str>) -> Value {
    let text = match detail {
        Some(detail) => format!("Parse error: {detail}"),
        None => "Parse error".to_owned(),
    };
    error(&Value::Null, PARSE_ERROR, &text, Value::Null)
}

/// The response when no session can be opened.
pub(super) fn refused(why: &OpenError) -> Value {
    refused_for(&Value::Null, why)
}

fn refused_for(id: &Value, why: &OpenError) -> Value {
    match why {
        OpenError::Capacity { active, max } | OpenError::Quota { active, max, .. } => {
            let data = json!({ "active_sessions": active, "max_sessions": max });
            error(id, CAPACITY, &why.to_string(), data)
        }
        OpenError::Draining => error(id, CAPACITY, &why.to_string(), Value::Null),
        OpenError::Scenario(_) => error(id, INTERNAL_ERROR, &why.to_string(), Value::Null),
    }
}

fn create(sessions: &TenantSessions, own_session: Option<&str>, id: &Value) -> Value {
    if let Some(own) = own_session {
        return result(id, json!({ "session_id": own }));
    }
    match sessions.open(Life::Detached) {
        Ok(in_use) => result(id, json!({ "session_id": in_use.id })),
        Err(why) => refused_for(id, &why),
    }
}

fn close(sessions: &TenantSessions, own_session: Option<&str>, request: &Request<'_>) -> Value {
    let id = request.id;
    let given = request.params.and_then(|params| params.get("session_id"));
    let Some(given) = given.filter(|given| !given.is_null()) else {
        let text = "Invalid params - 'session_id' is required";
        return error(id, INVALID_PARAMS, text, Value::Null);
    };
    let session_id = given.as_str().unwrap_or_default();
    if own_session == Some(session_id) {
        let text = "Invalid request: a connection cannot close its own session";
        return error(id, INVALID_REQUEST, text, Value::Null);
    }
    match sessions.close(session_id) {
        Closed::Now => result(id, json!({ "session_id": session_id, "closed": true })),
        Closed::WithItsConnection => {
            result(id, json!({ "session_id": session_id, "closed": false, "closing": true }))
        }
        Closed::Unknown => error(id, INVALID_PARAMS, &unknown_session(given), Value::Null),
    }
}

fn is_known(sessions: &TenantSessions, id: &Value) -> bool {
    id.is_null() || id.as_str().is_some_and(|id| sessions.find(id).is_ok())
}

fn unknown_session(id: &Value) -> String {
    let id = id.as_str().map_or_else(|| id.to_string(), str::to_owned);
    format!("Unknown session_id: {}", id.chars().take(64).collect::<String>())
}

fn read(object: &Map<String, Value>) -> Result<Request<'_>, String> {
    for key in object.keys() {
        if !["jsonrpc", "method", "params", "id"].contains(&key.as_str()) {
            return Err(format!("unknown member {:?}", key.chars().take(64).collect::<String>()));
        }
    }
    if object.get("jsonrpc") != Some(&json!("2.0")) {
        return Err("'jsonrpc' must be \"2.0\"".to_owned());
    }
    let method = object.get("method").and_then(Value::as_str).ok_or("'method' must be a string")?;
    let params = match object.get("params") {
        None => None,
        Some(Value::Object(params)) => Some(params),
        Some(_) => return Err("'params' must be an object".to_owned()),
    };
    let id = object.get("id").unwrap_or(&Value::Null);
    if is_id(id) {
        Ok(Request { id, method, params })
    } else {
        Err("'id' must be a string, an integer or null".to_owned())
    }
}

fn is_id(id: &Value) -> bool {
    id.is_null() || id.is_string() || id.is_i64() || id.is_u64()
}

fn result(id: &Value, result: Value) -> Value {
    json!({ "jsonrpc": "2.0", "id": id, "result": result })
}

fn error(id: &Value, code: i32, message: &str, data: Value) -> Value {
    let error = json!({ "code": code, "message": message, "data": data });
    json!({ "jsonrpc": "2.0", "id": id, "error": error })
}
