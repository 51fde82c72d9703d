//! The map, its files, and what stands in it.

use std::sync::Arc;

use schemas::{Pose, Translation3, Vec3};
use serde_bytes::Bytes;

use super::astray;
use crate::dialect::{
    BoundingBox, EnvironmentObject, LabelledPoint, Location, MapInfo, Transform, Vector3D,
};
use crate::endpoint::Endpoint;
use crate::maps;
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

/// Everything, whatever its tag.
const ANY_TAG: u8 = 255;

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
        "get_all_level_BBs" => {
            let (_, tag): (Meta, u8) = request.args()?;
            let objects = objects(endpoint, tag)?;
            let boxes: Vec<BoundingBox> =
                objects.into_iter().map(|object| object.bounding_box).collect();
            Payload::value(&boxes)
        }
        "get_environment_objects" => {
            let (_, tag): (Meta, u8) = request.args()?;
            Payload::value(&objects(endpoint, tag)?)
        }
        "get_names_of_all_objects" => {
            let objects = objects(endpoint, ANY_TAG)?;
            let names: Vec<String> = objects.into_iter().map(|object| object.name).collect();
            Payload::value(&names)
        }
        "cast_ray" => {
            let (_, start, end): (Meta, Location, Location) = request.args()?;
            Payload::value(&ray(endpoint, start, end).await?)
        }
        "project_point" => {
            let (_, start, direction, distance): (Meta, Location, Vector3D, f32) =
                request.args()?;
            let end = Location {
                x: start.x + direction.x * distance,
                y: start.y + direction.y * distance,
                z: start.z + direction.z * distance,
            };
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

/// What belongs to the map, with a semantic tag.
fn objects(endpoint: &mut Endpoint, tag: u8) -> Result<Vec<EnvironmentObject>, Refusal> {
    let objects = endpoint.known_episode()?.map.environment_objects().iter();
    let wanted = objects.filter(|object| tag == ANY_TAG || object.label as u8 == tag);
    Ok(wanted.map(told).collect())
}

fn told(object: &roads::EnvironmentObject) -> EnvironmentObject {
    let pose: Pose = object.pose.cast();
    let half_m: Vec3 = object.half_extent_m.cast();
    let placed = Transform::of(&pose);
    let foot = pose * Translation3::new(0.0, 0.0, -half_m.z);
    EnvironmentObject {
        transform: Transform::of(&foot),
        bounding_box: BoundingBox {
            location: placed.location,
            extent: Vector3D::size(half_m),
            rotation: placed.rotation,
            actor_id: 0,
        },
        id: object.id,
        name: object.name.clone(),
        tag: object.label as u8,
    }
}
