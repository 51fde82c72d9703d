//! Where another road's driving lane leads across a sidewalk, the sidewalk is level with it.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

#[path = "common/towns.rs"]
mod generated;
#[path = "common/maps.rs"]
mod maps;
#[path = "common/surface.rs"]
mod surface;

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use roads::mesh::{GroundMesh, Material, ground};
use roads::nav::{Area, NavMesh};
use roads::{LaneTypes, Map};
use surface::Surface;

/// Distance of the places along a lane, in metres.
const STEP_M: f64 = 0.25;
/// Places across a lane, as shares of its width from its middle: where wheels may run.
const ACROSS: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];
/// What is higher over a lane than the one is a step, and than the other a bridge; in metres.
const STEP_UP_M: f64 = 0.03;
const BRIDGE_M: f64 = 1.5;

/// A ground of nothing but sidewalks.
fn sidewalks(ground: &GroundMesh) -> Surface {
    let mut only = GroundMesh { positions_m: ground.positions_m.clone(), ..GroundMesh::default() };
    for (triangle, material) in ground.indices.iter().zip(&ground.materials) {
        if *material == Material::Sidewalk {
            only.indices.push(*triangle);
            only.materials.push(*material);
        }
    }
    Surface::new(&only)
}

/// Driving lanes over which sidewalks stand, by road and lane: at how many places, and how high.
fn steps(map: &Map) -> BTreeMap<(u32, i32), (usize, f64)> {
    let surface = sidewalks(&ground(map));
    let mut found = BTreeMap::new();
    for place in map.generate_waypoints(STEP_M).expect("few enough") {
        let Some(pose) = map.lane_pose(&place) else { continue };
        let (sin, cos) = pose.heading_rad.sin_cos();
        let left = Vector3::new(-sin, cos, 0.0) * map.lane(&place).width_m;
        for at in ACROSS.map(|share| pose.point + left * share) {
            let ups = surface.heights(at.x, at.y).map(|z| z - at.z);
            let steps = ups.filter(|up_m| (STEP_UP_M..BRIDGE_M).contains(up_m));
            if let Some(up_m) = steps.reduce(f64::max) {
                let known = found.entry((place.road, place.lane)).or_insert((0, 0.0));
                *known = (known.0 + 1, up_m.max(known.1));
            }
        }
    }
    found
}

#[test]
fn no_sidewalk_stands_on_a_driving_lane_of_a_real_map() {
    for judged in maps::all() {
        let steps = steps(&judged.map);
        assert!(steps.is_empty(), "{}: {steps:?}", judged.name);
    }
}

#[test]
fn every_sidewalk_of_our_towns_is_a_whole_kerb_high() {
    for map in generated::towns() {
        let ground = ground(&map);
        for (triangle, _) in
            ground.indices.iter().zip(&ground.materials).filter(|(_, m)| **m == Material::Sidewalk)
        {
            let corners =
                triangle.map(|at| Vector3::from(ground.positions_m[at as usize].map(f64::from)));
            let middle = Point3::from((corners[0] + corners[1] + corners[2]) / 3.0);
            let Some(place) = map.nearest(middle, LaneTypes::SIDEWALK) else { continue };
            let up_m = middle.z - map.lane_pose(&place).unwrap().point.z;
            // Patches of paving are no lanes.
            let is_lane = map.inside(middle, LaneTypes::SIDEWALK).is_some();
            assert!(!is_lane || (up_m - 0.15).abs() < 0.03, "{}: {up_m} at {middle}", map.name());
        }
    }
}

/// A road to the east with a sidewalk, and one to the north at `x` that crosses it, so high.
fn crossing(height_m: f64) -> Map {
    let lane = |id: i32, kind: &str| {
        format!(
            "<lane id=\"{id}\" type=\"{kind}\">\
             <width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
        )
    };
    let road = |id: i32, z: f64, pose: &str, lanes: &str| {
        format!(
            "<road id=\"{id}\" length=\"60\" junction=\"-1\"><link/><planView>\
             <geometry s=\"0\" {pose} length=\"60\"><line/></geometry></planView>\
             <elevationProfile><elevation s=\"0\" a=\"{z}\" b=\"0\" c=\"0\" d=\"0\"/>\
             </elevationProfile><lanes><laneSection s=\"0\">\
             <center><lane id=\"0\" type=\"none\"/></center><right>{lanes}</right>\
             </laneSection></lanes></road>"
        )
    };
    let (driving, sidewalk) = (lane(-1, "driving"), lane(-2, "sidewalk"));
    let text = format!(
        "<OpenDRIVE><header/>{}{}</OpenDRIVE>",
        road(1, 0.0, "x=\"-30\" y=\"0\" hdg=\"0\"", &(driving.clone() + &sidewalk)),
        road(2, height_m, "x=\"-2\" y=\"-30\" hdg=\"1.5707963267948966\"", &driving),
    );
    Map::parse("crossing", &text).unwrap()
}

/// Height of the sidewalk of that road, 4 to 8 m to the right of its middle.
fn sidewalk_m(map: &Map, x: f64, y: f64) -> f64 {
    let heights = sidewalks(&ground(map));
    heights.heights(x, y).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_sidewalk_is_level_with_a_road_that_crosses_it_and_climbs_gently_on_both_sides() {
    for height_m in [0.0, -0.1, 0.1] {
        let map = crossing(height_m);
        assert!(steps(&map).is_empty(), "{:?}", steps(&map));
        let surface = sidewalks(&ground(&map));
        let height = |x: f64| surface.heights(x, -6.0).fold(f64::NEG_INFINITY, f64::max);
        for x in [-8.0, 8.0] {
            assert!((height(x) - 0.15).abs() < 1e-6, "{} at {x}", height(x));
        }
        for k in -800..800 {
            let x = f64::from(k) * 0.01;
            let climb = (height(x + 0.01) - height(x)).abs() / 0.01;
            assert!(climb < 0.2, "{climb} at {x} beside a road at {height_m}");
        }
        assert!((height(0.0) - height_m).abs() < 0.01, "{} beside {height_m}", height(0.0));
    }
}

#[test]
fn a_bridge_and_a_road_far_below_leave_a_sidewalk_as_it_is() {
    for height_m in [-5.0, 0.4, 5.0] {
        let map = crossing(height_m);
        for x in [0.0, 1.7, 9.0] {
            let found_m = sidewalk_m(&map, x, -6.0);
            assert!((found_m - 0.15).abs() < 1e-6, "{found_m} at {x}, {height_m}");
        }
    }
}

#[test]
fn people_walk_as_high_as_a_sidewalk_is() {
    let map = crossing(0.0);
    let mesh = NavMesh::new(&map).unwrap();
    for x in [-9.0, -2.9, -2.5, 0.0, 2.3, 2.8, 9.0] {
        let wanted_m = sidewalk_m(&map, x, -6.0).max(if x.abs() < 1.9 { 0.0 } else { -1.0 });
        let (_, found) = mesh.nearest(Point3::new(x, -6.0, 0.1)).unwrap();
        assert!((found.z - wanted_m).abs() < 0.03, "{found} and not {wanted_m} at {x}");
    }
    assert!(mesh.polygons().iter().any(|polygon| polygon.area == Area::Sidewalk));
}
