//! Meshes and spawn points on every map there is: all generated towns, and real maps.
//!
//! The real ones are skipped with a message where they are absent, as `oracle.rs` says.

#[path = "common/towns.rs"]
mod generated;
#[path = "common/maps.rs"]
mod maps;

use std::collections::HashMap;

use generated::towns;
use nalgebra::{Point3, Vector3};
use roads::mesh::{GroundMesh, above_lane_m, ground, render};
use roads::{LaneType, LaneTypes, Map};

/// Triangles by square of the ground, to find those below a point quickly.
struct Squares<'m> {
    mesh: &'m GroundMesh,
    triangles: HashMap<[i64; 2], Vec<usize>>,
}

const SQUARE_M: f64 = 20.0;
/// How far the ground of an uneven junction may be from the height that its roads have in common,
/// in metres.
const BENT_MAX_M: f64 = 0.1;
/// Most triangles of Town03, the real one and ours: of its ground, and to draw.
const TOWN03_MAX: [usize; 2] = [60_000, 120_000];

#[allow(clippy::cast_possible_truncation, reason = "maps are smaller than a million metres")]
fn square(v: f64) -> i64 {
    (v / SQUARE_M).floor() as i64
}

impl<'m> Squares<'m> {
    fn new(mesh: &'m GroundMesh) -> Self {
        let mut triangles: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        for index in 0..mesh.indices.len() {
            let corners = corners(mesh, index);
            let span = |axis: usize| {
                let values = corners.map(|corner| corner[axis]);
                let low = values.iter().copied().fold(f64::INFINITY, f64::min);
                let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                square(low)..=square(high)
            };
            for x in span(0) {
                for y in span(1) {
                    triangles.entry([x, y]).or_default().push(index);
                }
            }
        }
        Self { mesh, triangles }
    }

    /// Distance of the nearest surface above or below a point.
    fn off_m(&self, at: &Point3<f64>) -> f64 {
        self.triangles
            .get(&[square(at.x), square(at.y)])
            .into_iter()
            .flatten()
            .filter_map(|index| height(corners(self.mesh, *index), at.x, at.y))
            .map(|z| (z - at.z).abs())
            .fold(f64::INFINITY, f64::min)
    }
}

fn corners(mesh: &GroundMesh, triangle: usize) -> [Vector3<f64>; 3] {
    mesh.indices[triangle].map(|i| Vector3::from(mesh.positions_m[i as usize].map(f64::from)))
}

fn height([a, b, c]: [Vector3<f64>; 3], x: f64, y: f64) -> Option<f64> {
    let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if area.abs() < 1e-9 {
        return None;
    }
    let v = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area;
    let w = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area;
    // A millimetre of a triangle of some metres: seams are met by either side.
    let inside = v >= -1e-3 && w >= -1e-3 && v + w <= 1.0 + 1e-3;
    inside.then(|| a.z + v * (b.z - a.z) + w * (c.z - a.z))
}

fn each(mut run: impl FnMut(&str, &Map)) {
    for map in towns() {
        run(map.name(), &map);
    }
    for judged in maps::all() {
        run(&judged.name, &judged.map);
    }
}

#[test]
fn there_is_ground_under_every_driving_lane() {
    each(|name, map| {
        let mesh = ground(map);
        println!("{name}: {} triangles of ground", mesh.indices.len());
        let limit = if name == "Town03" { TOWN03_MAX[0] } else { 400_000 };
        assert!(mesh.indices.len() < limit, "{name}: {}", mesh.indices.len());
        let squares = Squares::new(&mesh);
        for place in map.generate_waypoints(3.7).unwrap() {
            // At the very ends of a road that bends, beside the lane is beyond the road.
            let goes_on = map.waypoint(place.road, place.lane, place.s + 1.0).is_some();
            if place.s < 1.0 || !goes_on {
                continue;
            }
            let width_m = map.lane(&place).width_m;
            for side in [-0.45, 0.0, 0.45] {
                let mut at = map.pose(&place) * Point3::new(0.0, side * width_m, 0.0);
                let above_m = above_lane_m(map, &place, &at);
                at.z += above_m.unwrap_or_default();
                // Between the corners of its faces the common height of a junction is bent.
                let bent_m = above_m.map_or(0.0, |_| BENT_MAX_M);
                let off_m = squares.off_m(&at);
                // Beside a lane that opens or closes on a grade, the road there is at another s.
                let pitch_rad = map.lane_pose(&place).expect("of this map").pitch_rad;
                let off_max_m = 0.02 + (side * width_m * pitch_rad).abs() + bent_m;
                assert!(off_m < off_max_m, "{name}: ground {off_m} m off, {side} beside {place:?}");
            }
        }
    });
}

#[test]
fn pictures_of_all_maps_stay_within_a_budget() {
    each(|name, map| {
        let triangles: usize = render(map).surfaces.iter().map(|part| part.indices.len()).sum();
        println!("{name}: {triangles} triangles to draw");
        let limit = if name == "Town03" { TOWN03_MAX[1] } else { 600_000 };
        assert!(triangles < limit, "{name}: {triangles}");
    });
}

#[test]
fn maps_of_carla_have_its_number_of_spawn_points() {
    each(|name, map| {
        let of_carla = [("Town01", 255), ("Town03", 265), ("Town10HD", 155)];
        let wanted = of_carla.iter().find(|(known, _)| *known == name);
        let found = map.spawn_points().len();
        assert!(wanted.is_none_or(|(_, count)| found >= *count), "{name}: {found}");
    });
}

#[test]
fn spawn_points_stand_in_driving_lanes() {
    each(|name, map| {
        let is_off = |spawn: &&nalgebra::Isometry3<f64>| {
            let below = spawn.translation.vector - Vector3::z() * 0.5;
            let place = map.nearest(below.into(), LaneTypes::DRIVING).expect("it has lanes");
            assert_eq!(map.lane(&place).lane_type, LaneType::Driving);
            (map.pose(&place).translation.vector - below).norm() > 0.5
        };
        // Projection misses lanes that bulge inside a straight section, by the bulge.
        let off = map.spawn_points().iter().filter(is_off).count();
        assert!(off * 50 <= map.spawn_points().len(), "{name}: {off}");
    });
}

#[test]
fn the_nearest_lane_is_the_same_within_every_distance_beyond_it() {
    each(|name, map| {
        for spawn in map.spawn_points() {
            let at = spawn * Point3::new(1.0, 3.0, 0.2);
            let within = |within_m: f64| map.nearest_within(at, LaneTypes::DRIVING, within_m);
            let (place, away_m) = within(f64::INFINITY).expect("it has lanes");
            assert_eq!(map.nearest(at, LaneTypes::DRIVING), Some(place), "{name}");
            for more_m in [1.0e-6, 0.01, 1.0, 100.0] {
                assert_eq!(within(away_m + more_m), Some((place, away_m)), "{name}");
            }
            assert_eq!(within(away_m * 0.999), None, "{name}");
        }
    });
}

#[test]
#[allow(clippy::cast_possible_truncation, reason = "as vehicles are told limits")]
fn a_limit_that_surely_holds_is_that_of_the_nearest_lane_unless_it_is_in_a_junction() {
    let (mut asked, mut sure) = (0, 0);
    each(|name, map| {
        let spawns = map.spawn_points().iter();
        let places = spawns.flat_map(|spawn| {
            let sides = [-3.0, 0.0, 1.7, 5.0].into_iter();
            sides.flat_map(move |left_m| {
                (0..12).map(move |step| spawn * Point3::new(2.3 * f64::from(step), left_m, -0.4))
            })
        });
        let mut limits_mps: Vec<f32> = Vec::new();
        for at in places {
            let (place, _) =
                map.nearest_within(at, LaneTypes::DRIVING, f64::INFINITY).expect("it has lanes");
            let limit_mps = map.speed_limit_mps(&place).unwrap_or(0.0) as f32;
            if !limits_mps.contains(&limit_mps) {
                limits_mps.push(limit_mps);
            }
            for told_mps in limits_mps.iter().copied().filter(|told_mps| *told_mps != 0.0) {
                let holds = map.surely_holds(told_mps, &at);
                let may = told_mps == limit_mps || map.is_in_junction(&place);
                assert!(may || !holds, "{name}: {told_mps} m/s at {at}, {place:?}");
            }
            asked += 1;
            sure += u32::from(map.surely_holds(limit_mps, &at));
        }
    });
    assert!(sure * 2 > asked, "{sure} of {asked}");
}
