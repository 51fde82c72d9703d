//! The Task API: every named scenario with a range of seeds, as a list of tasks.

#![allow(clippy::result_large_err, reason = "a refusal is as large as the answer it stands for")]

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde_json::{Map, Value, json};

use super::coerce::{FieldError, Reader};
use super::{Face, http_errors, json as lenient};
use crate::scenario::registry;

const ENVIRONMENT: &str = "carla_env";
/// The splits, with the seeds of each scenario; no seed is in two of them.
const SPLITS: [(&str, u64, u64); 3] =
    [("train", 0, 100), ("validation", 100, 10), ("test", 200, 10)];

/// The routes of the Task API.
pub(super) fn router() -> Router<Arc<Face>> {
    Router::new()
        .route("/list_environments", get(|| async { Json(json!([ENVIRONMENT])) }))
        .route("/{environment}/splits", get(splits))
        .route("/{environment}/tasks", post(tasks))
        .route("/{environment}/num_tasks", post(num_tasks))
        .route("/{environment}/task", post(task))
        .route("/{environment}/task_range", post(task_range))
}

async fn splits(Path(environment): Path<String>) -> Result<Response, Response> {
    known(&environment)?;
    let splits = SPLITS.map(|(name, ..)| json!({ "name": name, "type": name }));
    Ok(Json(splits).into_response())
}

async fn tasks(
    State(face): State<Arc<Face>>,
    Path(environment): Path<String>,
    body: Bytes,
) -> Result<Response, Response> {
    let asked = Asked::read(&face, &environment, &body)?;
    let tasks: Vec<Value> = (0..asked.count()).filter_map(|index| asked.task(index)).collect();
    Ok(Json(json!({ "tasks": tasks, "env_name": ENVIRONMENT })).into_response())
}

async fn num_tasks(
    State(face): State<Arc<Face>>,
    Path(environment): Path<String>,
    body: Bytes,
) -> Result<Response, Response> {
    let asked = Asked::read(&face, &environment, &body)?;
    Ok(Json(json!({ "num_tasks": asked.count() })).into_response())
}

async fn task(
    State(face): State<Arc<Face>>,
    Path(environment): Path<String>,
    body: Bytes,
) -> Result<Response, Response> {
    let asked = Asked::read(&face, &environment, &body)?;
    let task = asked.index.and_then(|index| asked.task(index));
    let task =
        task.ok_or_else(|| http_errors::detail(StatusCode::BAD_REQUEST, "Invalid task index"))?;
    Ok(Json(json!({ "task": task })).into_response())
}

async fn task_range(
    State(face): State<Arc<Face>>,
    Path(environment): Path<String>,
    body: Bytes,
) -> Result<Response, Response> {
    let asked = Asked::read(&face, &environment, &body)?;
    let stop = asked.stop.unwrap_or(u64::MAX).min(asked.count());
    let tasks: Vec<Value> =
        (asked.start.unwrap_or(0)..stop).filter_map(|index| asked.task(index)).collect();
    Ok(Json(json!({ "tasks": tasks })).into_response())
}

/// What a request asks for.
struct Asked {
    /// Of scenarios: the built-in ones, then those of files.
    names: Vec<String>,
    split: &'static str,
    first_seed: u64,
    seed_count: u64,
    index: Option<u64>,
    start: Option<u64>,
    stop: Option<u64>,
}

impl Asked {
    fn read(face: &Face, environment: &str, body: &Bytes) -> Result<Self, Response> {
        known(environment)?;
        let names = registry::names(&face.sessions.contexts().first().files);
        let text = std::str::from_utf8(body).map_err(|_| http_errors::no_json())?;
        let Ok(Value::Object(object)) = lenient::parse(text) else {
            return Err(http_errors::no_json());
        };
        Self::from_object(&object, names).map_err(|errors| {
            let errors: Vec<FieldError> =
                errors.into_iter().map(|error| error.below("body")).collect();
            http_errors::invalid(&errors)
        })
    }

    fn from_object(
        object: &Map<String, Value>,
        names: Vec<String>,
    ) -> Result<Self, Vec<FieldError>> {
        let mut read = Reader::new(object);
        let name = read.optional_text("split");
        let split = SPLITS.iter().find(|(split, ..)| name.as_deref() == Some(*split));
        let (split, first_seed, seed_count) = split.copied().unwrap_or(("", 0, 0));
        let asked = Self {
            names,
            split,
            first_seed,
            seed_count,
            index: read.optional_integer("index", 0),
            start: read.optional_integer("start", 0),
            stop: read.optional_integer("stop", 0),
        };
        let asked = read.finish_closed(asked)?;
        match name {
            None => Err(vec![FieldError::missing("split", &Value::Object(object.clone()))]),
            Some(_) => Ok(asked),
        }
    }

    fn count(&self) -> u64 {
        self.seed_count * self.names.len() as u64
    }

    fn task(&self, index: u64) -> Option<Value> {
        if index >= self.count() {
            return None;
        }
        let name = self.names.get((index / self.seed_count) as usize)?;
        let seed = self.first_seed + index % self.seed_count;
        Some(json!({
            "id": format!("{}/{name}/{seed}", self.split),
            "index": index,
            "split": self.split,
            "scenario_name": name,
            "seed": seed,
            "scenario_config": {},
        }))
    }
}

fn known(environment: &str) -> Result<(), Response> {
    if environment.eq_ignore_ascii_case(ENVIRONMENT) {
        return Ok(());
    }
    let environment: String = environment.chars().take(64).collect();
    let text = format!("unknown environment '{environment}'");
    Err(http_errors::detail(StatusCode::NOT_FOUND, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_names_a_scenario_and_no_seed_is_in_two_splits() {
        let mut ids = std::collections::BTreeSet::new();
        let mut seeds = std::collections::BTreeMap::new();
        for (split, ..) in SPLITS {
            let asked = json!({ "split": split });
            let names = registry::NAMED.map(str::to_owned).to_vec();
            let asked = Asked::from_object(asked.as_object().unwrap(), names).unwrap();
            for index in 0..asked.count() {
                let task = asked.task(index).unwrap();
                assert!(ids.insert(task["id"].to_string()));
                let seed = task["seed"].as_u64().unwrap();
                assert_eq!(*seeds.entry(seed).or_insert(split), split);
            }
            assert_eq!(asked.task(asked.count()), None);
        }
    }
}
