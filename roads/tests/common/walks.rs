//! Generated towns with their navigation meshes, and what is asked about both.
#![allow(dead_code, reason = "not every test asks everything")]

#[path = "towns.rs"]
mod towns;

use nalgebra::Point3;
use roads::nav::{NavMesh, Polygon};
use roads::{LaneTypes, Map};
pub(crate) use towns::names;

/// How far a walker's middle keeps from the borders of a sidewalk, in metres.
pub(crate) const WALKER_RADIUS_M: f64 = 0.3;
/// Height of sidewalks above the road, in metres.
pub(crate) const KERB_M: f64 = 0.15;

pub(crate) fn town(name: &str) -> (Map, NavMesh) {
    let map = towns::town(name);
    let mesh = NavMesh::new(&map).unwrap_or_else(|error| panic!("{name}: {error}"));
    (map, mesh)
}

/// Area of a polygon seen from above, positive when counter-clockwise.
pub(crate) fn area_m2(outline: &[Point3<f64>]) -> f64 {
    let nexts = outline.iter().cycle().skip(1);
    outline.iter().zip(nexts).map(|(a, b)| (a.x * b.y - a.y * b.x) / 2.0).sum()
}

/// The polygons that can be reached from each other over polygons that pass `walkable`: for each,
/// the lowest number among them.
pub(crate) fn islands(mesh: &NavMesh, walkable: impl Fn(&Polygon) -> bool) -> Vec<Option<u32>> {
    let polygons = mesh.polygons();
    let mut island: Vec<Option<u32>> = vec![None; polygons.len()];
    for (start, polygon) in (0..).zip(polygons) {
        if !walkable(polygon) || island[start as usize].is_some() {
            continue;
        }
        let mut pending = vec![start];
        while let Some(at) = pending.pop() {
            if island[at as usize].replace(start).is_none() {
                let beyond = polygons[at as usize].neighbours.iter().flatten();
                pending.extend(beyond.filter(|next| {
                    walkable(&polygons[**next as usize]) && island[**next as usize].is_none()
                }));
            }
        }
    }
    island
}

/// How far a place lies inside a sidewalk: from the nearer border, in metres; `None` beside all.
pub(crate) fn depth_m(map: &Map, place: Point3<f64>) -> Option<f64> {
    let lane = map.nearest(place, LaneTypes::SIDEWALK)?;
    let half_m = map.lane(&lane).width_m / 2.0;
    let pose = map.lane_pose(&lane)?;
    // Across the lane only: on bends the lane is found some decimetres further on.
    let aside = place.xy() - pose.point.xy();
    let across_m = aside.y * pose.heading_rad.cos() - aside.x * pose.heading_rad.sin();
    let along_m = aside.x * pose.heading_rad.cos() + aside.y * pose.heading_rad.sin();
    (along_m.abs() < 1.0).then_some(half_m - across_m.abs())
}
