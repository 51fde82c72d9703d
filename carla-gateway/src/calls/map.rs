//! The map, its files, and what rays meet.

use std::sync::Arc;

use schemas::{Pose, Vec3, level_pose};
use serde_bytes::ByteBuf;

use crate::dialect::{LabelledPoint, Location, MapInfo, Transform, Vector3D};
use crate::endpoint::Endpoint;
use crate::maps;
use crate::rpc::Refusal;

/// Shorter directions are none, as in CARLA.
const LENGTH_MIN: f32 = 1.0e-4;
/// How far a spawn point that clients are told lies beside the middle of its lane, in metres, and
/// by how much it is turned, in radians.
const ASIDE_M_MAX: f32 = 0.004;
const TURN_RAD_MAX: f32 = 5.0e-5;
/// The folder of what clients steer walkers by.
const NAVIGATION_FOLDER: &str = "Nav";

pub(super) fn info(endpoint: &mut Endpoint) -> Result<MapInfo, Refusal> {
    let episode = endpoint.known_episode()?;
    let points = episode.map.spawn_points().iter().enumerate();
    let points = points.map(|(number, pose)| as_put_by_hand(number, &pose.cast()));
    Ok(MapInfo {
        name: maps::told_name(&episode.map_name),
        recommended_spawn_points: points.map(|pose| Transform::of(&pose)).collect(),
    })
}

/// A spawn point some millimetres beside the middle of its lane, turned by some thousandths of a
/// degree: CARLA's were put by hand, and programs divide by differences of their coordinates.
fn as_put_by_hand(number: usize, pose: &Pose) -> Pose {
    // Spread evenly over 0.5 to 1, to both sides in turn.
    let size = 0.5 + (number as f32 * 0.618_034).fract() / 2.0;
    let share = if number.is_multiple_of(2) { size } else { -size };
    pose * level_pose(Vec3::new(0.0, ASIDE_M_MAX * share, 0.0), TURN_RAD_MAX * share)
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
