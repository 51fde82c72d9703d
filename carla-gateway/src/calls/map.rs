//! The map, its files, and what rays meet.

use std::sync::Arc;

use serde_bytes::Bytes;

use super::astray;
use crate::dialect::{LabelledPoint, Location, MapInfo, Transform, Vector3D};
use crate::endpoint::Endpoint;
use crate::maps;
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

/// Shorter directions are none, as in CARLA.
const LENGTH_MIN: f32 = 1.0e-4;

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "get_map_info" => {
            let episode = endpoint.known_episode()?;
            let points = episode.map.spawn_points().iter();
            Payload::value(&MapInfo {
                name: maps::told_name(&episode.map_name),
                recommended_spawn_points: points
                    .map(|pose| Transform::of(&pose.cast::<f32>()))
                    .collect(),
            })
        }
        "get_map_data" => Payload::value(endpoint.known_episode()?.map.text()),
        "get_required_files" | "request_file" | "get_navigation_mesh" => {
            navigation(endpoint, request).await
        }
        "cast_ray" => {
            let (_, start, end): (Meta, Location, Location) = request.args()?;
            Payload::value(&ray(endpoint, start, end).await?)
        }
        "project_point" => {
            let (_, start, direction, distance): (Meta, Location, Vector3D, f32) =
                request.args()?;
            let end = end_of(start, direction, distance);
            let nearest = ray(endpoint, start, end).await?.into_iter().next();
            Payload::value(&(nearest.is_some(), nearest.unwrap_or_default()))
        }
        _ => astray(request),
    }
}

/// The file by which clients steer walkers.
async fn navigation(endpoint: &mut Endpoint, request: &Request) -> Answer {
    let navigation = Arc::clone(&endpoint.known_episode()?.navigation);
    match request.method.as_str() {
        "get_required_files" => {
            let (_, folder): (Meta, String) = request.args()?;
            if folder != "Nav" {
                return Payload::value(&[""; 0]);
            }
            let path = navigation.file().await.map(|file| &file.path);
            Payload::value(&path.as_slice())
        }
        "request_file" => {
            let (_, path): (Meta, String) = request.args()?;
            match navigation.file().await.filter(|file| file.path == path) {
                Some(file) => Payload::value(Bytes::new(&file.bytes)),
                None => {
                    let path: String = path.chars().take(256).collect();
                    Err(Refusal(format!("there is no file {path:?}")))
                }
            }
        }
        _ => {
            let bytes = navigation.file().await.map_or(&[][..], |file| &file.bytes);
            Payload::value(Bytes::new(bytes))
        }
    }
}

/// As far from `start` as `distance_m`, whatever the length of `direction`; `start` itself where it
/// has none.
fn end_of(start: Location, direction: Vector3D, distance_m: f32) -> Location {
    let Vector3D { x, y, z } = direction;
    let length = x.hypot(y).hypot(z);
    let share = if length > LENGTH_MIN { distance_m / length } else { 0.0 };
    Location { x: start.x + x * share, y: start.y + y * share, z: start.z + z * share }
}

async fn ray(
    endpoint: &mut Endpoint,
    start: Location,
    end: Location,
) -> Result<Vec<LabelledPoint>, Refusal> {
    let points = [start.ours(), end.ours()];
    if !points.iter().all(|point| point.iter().all(|number| number.is_finite())) {
        return Err(Refusal("a ray needs finite ends".to_owned()));
    }
    let hits = endpoint.cast_ray(points[0], points[1]).await?;
    let point = |hit: &schemas::RayHit| LabelledPoint {
        location: Location::of(hit.position_m),
        label: hit.tag,
    };
    Ok(hits.iter().map(point).collect())
}
