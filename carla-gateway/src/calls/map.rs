//! The map, its files, and what rays meet.

use std::sync::Arc;

use serde_bytes::ByteBuf;

use crate::dialect::{LabelledPoint, Location, MapInfo, Transform, Vector3D};
use crate::endpoint::Endpoint;
use crate::maps;
use crate::rpc::Refusal;

/// Shorter directions are none, as in CARLA.
const LENGTH_MIN: f32 = 1.0e-4;
/// The folder of what clients steer walkers by.
const NAVIGATION_FOLDER: &str = "Nav";

pub(super) fn info(endpoint: &mut Endpoint) -> Result<MapInfo, Refusal> {
    let episode = endpoint.known_episode()?;
    let points = episode.map.spawn_points().iter();
    Ok(MapInfo {
        name: maps::told_name(&episode.map_name),
        recommended_spawn_points: points.map(|pose| Transform::of(&pose.cast::<f32>())).collect(),
    })
}

/// OpenDRIVE.
pub(super) fn text(endpoint: &mut Endpoint) -> Result<&str, Refusal> {
    Ok(endpoint.known_episode()?.map.text())
}

/// Paths of the files in a folder of the map's, or in all: the one by which clients steer walkers.
pub(super) async fn required_files(
    endpoint: &mut Endpoint,
    folder: String,
) -> Result<Vec<String>, Refusal> {
    let navigation = Arc::clone(&endpoint.known_episode()?.navigation);
    if !matches!(folder.trim_matches('/'), "" | NAVIGATION_FOLDER) {
        return Ok(Vec::new());
    }
    Ok(navigation.file().await.map(|file| file.path.clone()).into_iter().collect())
}

pub(super) async fn file(endpoint: &mut Endpoint, path: String) -> Result<ByteBuf, Refusal> {
    let navigation = Arc::clone(&endpoint.known_episode()?.navigation);
    match navigation.file().await.filter(|file| file.path == path) {
        Some(file) => Ok(ByteBuf::from(file.bytes.clone())),
        None => {
            let path: String = path.chars().take(256).collect();
            Err(Refusal(format!("there is no file {path:?}")))
        }
    }
}

pub(super) async fn navigation_mesh(endpoint: &mut Endpoint) -> Result<ByteBuf, Refusal> {
    let navigation = Arc::clone(&endpoint.known_episode()?.navigation);
    let file = navigation.file().await;
    Ok(file.map(|file| ByteBuf::from(file.bytes.clone())).unwrap_or_default())
}

/// What a ray of a length meets first, and whether it does.
pub(super) async fn project_point(
    endpoint: &mut Endpoint,
    start: Location,
    direction: Vector3D,
    distance_m: f32,
) -> Result<(bool, LabelledPoint), Refusal> {
    let end = end_of(start, direction, distance_m);
    let nearest = cast_ray(endpoint, start, end).await?.into_iter().next();
    Ok((nearest.is_some(), nearest.unwrap_or_default()))
}

/// As far from `start` as `distance_m`, whatever the length of `direction`; `start` itself where it
/// has none.
fn end_of(start: Location, direction: Vector3D, distance_m: f32) -> Location {
    let Vector3D { x, y, z } = direction;
    let length = x.hypot(y).hypot(z);
    let share = if length > LENGTH_MIN { distance_m / length } else { 0.0 };
    Location { x: start.x + x * share, y: start.y + y * share, z: start.z + z * share }
}

/// What a ray meets, nearest first.
pub(super) async fn cast_ray(
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
