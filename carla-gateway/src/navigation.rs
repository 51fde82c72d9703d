//! The file by which clients steer walkers, made once per map.

use std::sync::Arc;

use roads::nav::{NavMesh, detour};
use tokio::sync::OnceCell;

/// How far away a client looks for ground on which to put a walker: east, north and up, in metres.
const REACH_M: [f64; 3] = [12.0, 12.0, 9.0];

/// A file that clients fetch.
#[derive(Debug)]
pub(crate) struct NavFile {
    /// Changes with the content: clients never fetch a path twice.
    pub(crate) path: String,
    pub(crate) bytes: Vec<u8>,
    /// The lowest and highest corners of all polygons, in metres.
    boxes: Vec<[[f64; 3]; 2]>,
}

impl NavFile {
    /// Whether a client finds ground to walk on at a place.
    pub(crate) fn has_ground_at(&self, place: [f64; 3]) -> bool {
        let reaches = |[low, high]: &[[f64; 3]; 2]| {
            let bounds = low.iter().zip(high).zip(place.iter().zip(REACH_M));
            bounds.into_iter().all(|((low, high), (place, reach))| {
                low - reach <= *place && *place <= high + reach
            })
        };
        self.boxes.iter().any(reaches)
    }
}

/// The navigation file of a map, made when it is first wanted.
#[derive(Debug)]
pub(crate) struct Navigation {
    map: Arc<roads::Map>,
    made: OnceCell<Option<NavFile>>,
}

impl Navigation {
    /// Of a map, not made yet.
    pub(crate) fn new(map: Arc<roads::Map>) -> Self {
        Self { map, made: OnceCell::new() }
    }

    /// The file; `None` for a map where nobody can walk.
    pub(crate) async fn file(&self) -> Option<&NavFile> {
        let make = || async {
            let map = Arc::clone(&self.map);
            let made = tokio::task::spawn_blocking(move || make(&map)).await;
            made.unwrap_or_else(|panic| {
                tracing::error!(%panic, "the navigation mesh could not be made");
                None
            })
        };
        self.made.get_or_init(make).await.as_ref()
    }
}

fn make(map: &roads::Map) -> Option<NavFile> {
    let unusable = |why: &dyn std::fmt::Display| {
        tracing::warn!(map = map.name(), %why, "walkers cannot find their way on this map");
    };
    let mesh = NavMesh::new(map).map_err(|error| unusable(&error)).ok()?;
    let bytes = detour::file(&mesh).map_err(|error| unusable(&error)).ok()?;
    let corners_of = |polygon| mesh.outline(polygon).into_iter().map(|corner| corner.into());
    let polygons = (0..).take(mesh.polygons().len());
    let boxes = polygons.map(|polygon| box_of(&corners_of(polygon).collect::<Vec<_>>())).collect();
    let path = detour::file_name(map.name(), &bytes);
    (!bytes.is_empty()).then_some(NavFile { path, bytes, boxes })
}

fn box_of(corners: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let each = |start: f64, choose: fn(f64, f64) -> f64| {
        let choose_all = |a: [f64; 3], b: &[f64; 3]| std::array::from_fn(|k| choose(a[k], b[k]));
        corners.iter().fold([start; 3], choose_all)
    };
    [each(f64::INFINITY, f64::min), each(f64::NEG_INFINITY, f64::max)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ground_is_found_as_far_as_clients_look_for_it() {
        let corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 4.0)];
        let corners = corners.map(|(x, y)| [x, y, 1.0]);
        let boxes = vec![box_of(&corners)];
        let file = NavFile { path: String::new(), bytes: Vec::new(), boxes };
        for near in [[5.0, 2.0, 1.0], [-11.9, 15.9, 9.9], [21.9, -11.9, -7.9]] {
            assert!(file.has_ground_at(near), "{near:?}");
        }
        for far in [[-12.1, 2.0, 1.0], [5.0, 16.1, 1.0], [5.0, 2.0, 10.1]] {
            assert!(!file.has_ground_at(far), "{far:?}");
        }
    }
}
