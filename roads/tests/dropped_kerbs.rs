//! Where another road's driving lane leads across a sidewalk, the sidewalk is level with it.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

#[path = "common/towns.rs"]
mod generated;
#[path = "common/maps.rs"]
mod maps;
#[path = "common/surface.rs"]
mod surface;

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::time::{Duration, Instant};

use nalgebra::{Point2, Point3, Vector3};
use roads::mesh::{GroundMesh, Material, ground};
use roads::nav::{Area, NavMesh};
use roads::{LaneTypes, Map, Severity};
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

/// How high the triangles of sidewalks stand over their lanes at their middles, in metres, and
/// where. Patches of paving are no lanes.
fn kerbs(map: &Map) -> Vec<(f64, Point3<f64>)> {
    let ground = ground(map);
    let all = ground.indices.iter().zip(&ground.materials);
    let triangles = all.filter(|(_, material)| **material == Material::Sidewalk);
    let middles = triangles.map(|(triangle, _)| {
        let corners =
            triangle.map(|at| Vector3::from(ground.positions_m[at as usize].map(f64::from)));
        Point3::from((corners[0] + corners[1] + corners[2]) / 3.0)
    });
    let over = |middle: Point3<f64>| {
        map.inside(middle, LaneTypes::SIDEWALK)?;
        let place = map.nearest(middle, LaneTypes::SIDEWALK)?;
        Some((middle.z - map.lane_pose(&place)?.point.z, middle))
    };
    middles.filter_map(over).collect()
}

/// On the way some are made lower: else the test would look at nothing.
#[test]
fn no_sidewalk_stands_on_a_driving_lane_of_a_real_map() {
    let (maps, mut lowered) = (maps::all(), 0);
    for judged in &maps {
        let steps = steps(&judged.map);
        assert!(steps.is_empty(), "{}: {steps:?}", judged.name);
        lowered += kerbs(&judged.map).iter().filter(|(up_m, _)| *up_m < 0.1).count();
    }
    assert!(maps.is_empty() || lowered > 100, "{lowered} triangles are lower than a kerb");
}

#[test]
fn every_sidewalk_of_our_towns_is_a_whole_kerb_high() {
    for map in generated::towns() {
        let kerbs = kerbs(&map);
        assert!(kerbs.len() > 100, "{}: {} triangles", map.name(), kerbs.len());
        for (up_m, middle) in kerbs {
            assert!((up_m - 0.15).abs() < 0.03, "{}: {up_m} at {middle}", map.name());
        }
    }
}

/// A lane of 4 m.
fn lane(id: i32, kind: &str) -> String {
    format!(
        "<lane id=\"{id}\" type=\"{kind}\">\
         <width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
    )
}

/// A straight road with these lanes to its right.
fn road(id: u32, [x, y, z]: [f64; 3], heading_rad: f64, length_m: f64, lanes: &str) -> String {
    format!(
        "<road id=\"{id}\" length=\"{length_m}\" junction=\"-1\"><link/><planView>\
         <geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{heading_rad}\" length=\"{length_m}\"><line/>\
         </geometry></planView>\
         <elevationProfile><elevation s=\"0\" a=\"{z}\" b=\"0\" c=\"0\" d=\"0\"/>\
         </elevationProfile><lanes><laneSection s=\"0\">\
         <center><lane id=\"0\" type=\"none\"/></center><right>{lanes}</right>\
         </laneSection></lanes></road>"
    )
}

fn map(roads: &str) -> Map {
    Map::parse("crossing", &format!("<OpenDRIVE><header/>{roads}</OpenDRIVE>")).unwrap()
}

/// A road to the east with a sidewalk, and one to the north at `x` = 0 that crosses it, so high.
fn crossing(height_m: f64) -> Map {
    let (driving, sidewalk) = (lane(-1, "driving"), lane(-2, "sidewalk"));
    let east = road(1, [-30.0, 0.0, 0.0], 0.0, 60.0, &(driving.clone() + &sidewalk));
    map(&(east + &road(2, [-2.0, -30.0, height_m], FRAC_PI_2, 60.0, &driving)))
}

/// A road to the north with a sidewalk 4 to 8 m east of its middle, crossed so often by lanes of
/// 4 m to the west whose right edge is at multiples of a distance.
fn column(count: u32, apart_m: f64) -> Map {
    let (driving, sidewalk) = (lane(-1, "driving"), lane(-2, "sidewalk"));
    let length_m = f64::from(count) * apart_m;
    let mut roads = road(1, [0.0; 3], FRAC_PI_2, length_m, &(driving.clone() + &sidewalk));
    for k in 0..count {
        let y = f64::from(k) * apart_m + 1.0;
        roads += &road(2 + k, [20.0, y, 0.0], PI, 30.0, &driving);
    }
    map(&roads)
}

/// A road whose sidewalk is the lane of another all along.
fn column_along(length_m: f64) -> Map {
    let (driving, sidewalk) = (lane(-1, "driving"), lane(-2, "sidewalk"));
    let walk = road(1, [0.0; 3], FRAC_PI_2, length_m, &(driving.clone() + &sidewalk));
    map(&(walk + &road(2, [4.0, 0.0, 0.0], FRAC_PI_2, length_m, &driving)))
}

/// Height of the sidewalk of that road, 4 to 8 m to the right of its middle.
fn sidewalk_m(surface: &Surface, x: f64, y: f64) -> f64 {
    surface.heights(x, y).reduce(f64::max).expect("there is a sidewalk")
}

#[test]
fn a_sidewalk_is_level_with_a_road_that_crosses_it_and_climbs_gently_on_both_sides() {
    for height_m in [0.0, -0.1, 0.1] {
        let map = crossing(height_m);
        assert!(steps(&map).is_empty(), "{:?}", steps(&map));
        let surface = sidewalks(&ground(&map));
        let height = |x: f64| surface.heights(x, -6.0).fold(f64::NEG_INFINITY, f64::max);
        // Wheels run on 1.6 m to each side; level for half a metre more and the half metre in
        // which places are looked at, then up by 0.15 m in each.
        let whole_m = 1.6 + 1.0 + (0.15 - height_m) / 0.15 + 0.5;
        for k in -80..=80 {
            let x = f64::from(k) * 0.1;
            if x.abs() <= 1.6 {
                assert!((height(x) - height_m).abs() < 0.01, "{} at {x}, {height_m}", height(x));
            } else if x.abs() >= whole_m {
                assert!((height(x) - 0.15).abs() < 1e-6, "{} at {x}, {height_m}", height(x));
            }
            assert!((height_m - 0.01..0.151).contains(&height(x)), "{} at {x}", height(x));
        }
        for k in -800..800 {
            let x = f64::from(k) * 0.01;
            let climb = (height(x + 0.01) - height(x)).abs() / 0.01;
            assert!(climb < 0.2, "{climb} at {x} beside a road at {height_m}");
        }
    }
}

#[test]
fn a_bridge_and_a_road_far_below_leave_a_sidewalk_as_it_is() {
    for height_m in [-5.0, 0.4, 5.0] {
        let surface = sidewalks(&ground(&crossing(height_m)));
        for x in [0.0, 1.7, 9.0] {
            let found_m = sidewalk_m(&surface, x, -6.0);
            assert!((found_m - 0.15).abs() < 1e-6, "{found_m} at {x}, {height_m}");
        }
    }
}

#[test]
fn people_walk_as_high_as_a_sidewalk_is() {
    let map = crossing(0.0);
    let mesh = NavMesh::new(&map).unwrap();
    let surface = sidewalks(&ground(&map));
    for (x, is_whole) in [(-9.0, true), (-2.9, false), (-2.5, false), (0.0, false), (9.0, true)] {
        let wanted_m = sidewalk_m(&surface, x, -6.0);
        assert_eq!(wanted_m > 0.149, is_whole, "{wanted_m} at {x}");
        let (_, found) = mesh.nearest(Point3::new(x, -6.0, 0.1)).unwrap();
        assert!((found.xy() - Point2::new(x, -6.0)).norm() < 0.01, "{found} at {x}");
        assert!((found.z - wanted_m).abs() < 0.03, "{found} and not {wanted_m} at {x}");
    }
    let walks = mesh.polygons().iter().filter(|polygon| polygon.area == Area::Sidewalk);
    assert!(walks.count() >= 4, "level, up on both sides, and a whole kerb");
}

/// A road to the north that is crossed every 12 m, each time far from all others: as many crossings
/// as the search allows in one column of x. And one whose sidewalk another road runs along.
#[test]
fn many_crossings_below_each_other_are_found_quickly_and_too_many_are_said() {
    let column = column(250, 12.0);
    let started = Instant::now();
    let surface = sidewalks(&ground(&column));
    assert!(started.elapsed() < Duration::from_secs(60), "{:?}", started.elapsed());
    for k in 1..250 {
        let y = f64::from(k) * 12.0;
        assert!(sidewalk_m(&surface, 6.0, y + 3.0).abs() < 0.01, "crossed at {y}");
        assert!(sidewalk_m(&surface, 6.0, y - 3.0) > 0.14, "a kerb before {y}");
    }
    let said = |map: &Map| {
        let faults = map.check().diagnostics;
        faults.into_iter().find(|fault| fault.wanted.contains("roads cross"))
    };
    assert!(said(&column).is_none());
    let too_many = said(&column_along(3_000.0)).unwrap();
    assert_eq!(too_many.severity, Severity::Suspicious, "{too_many}");
}
