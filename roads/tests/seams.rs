//! Where lanes meet, at the borders of lane sections and of junctions, the ground has no cracks.
//!
//! Method: at every joint of lanes, rows of places across the seam are looked at, four millimetres
//! apart, from near one edge of the lane to near the other. Each must have paved ground within a
//! centimetre of the lane's height; as many misses in a row as make a centimetre are a crack.

#[path = "common/towns.rs"]
mod generated;
#[path = "common/maps.rs"]
mod maps;
#[path = "common/surface.rs"]
mod surface;

use generated::towns;
use nalgebra::{Point3, Vector3};
use roads::mesh::above_lane_m;
use roads::{LaneType, Map, Waypoint};
use surface::Surface;

/// Distance between the places of a row, and how far rows reach to both sides of the seam.
const STEP_M: f64 = 0.004;
const REACH_M: f64 = 0.05;
/// Widest crack.
const CRACK_MAX_M: f64 = 0.01;
/// Roads of Town03 that are a centimetre long or less: rows of places across the end of one leave
/// it at its other end, where not all of its lanes lead on.
const SHORT_IN_TOWN03: [u32; 4] = [13, 29, 62, 84];
/// Height of sidewalks.
const KERB_M: f64 = 0.15;

/// Rows, and those with a crack, of which the map itself is at fault in so many.
#[derive(Default)]
struct Seams {
    rows: usize,
    /// Each with the road that ends there.
    cracks: Vec<(u32, String)>,
    torn_by_the_map: usize,
}

fn seams(map: &Map) -> Seams {
    let ground = roads::mesh::ground(map);
    let surface = Surface::new(&ground);
    let mut seams = Seams::default();
    for (from, to) in map.lane_joints() {
        let (Some(end), Some(start)) = (map.lane_pose(&from), map.lane_pose(&to)) else { continue };
        let widths_m = [&from, &to].map(|place| map.lane(place).width_m);
        if widths_m.iter().any(|width_m| *width_m < 0.5) {
            continue;
        }
        // The joints of lanes that do not meet are the map's own, as is a kink of lanes at an edge.
        // In the middle of an uneven junction the ground is bent between the corners of its faces.
        let torn = (end.point - start.point).norm() > CRACK_MAX_M
            || (end.heading_rad - start.heading_rad).sin().abs() > 0.002
            || (widths_m[0] - widths_m[1]).abs() > CRACK_MAX_M
            || is_raised(map, &from) != is_raised(map, &to)
            || above_lane_m(map, &from, &end.point).is_some_and(|above| above.abs() > CRACK_MAX_M);
        if torn {
            seams.torn_by_the_map += 1;
            continue;
        }
        let lift_m = if is_raised(map, &from) { KERB_M } else { 0.0 };
        let (sin, cos) = end.heading_rad.sin_cos();
        let (ahead, left) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        for share in [-0.45, -0.37, -0.2, 0.0, 0.21, 0.38, 0.45] {
            let middle = end.point + left * (share * widths_m[0]);
            let above_m = above_lane_m(map, &from, &middle).unwrap_or_default();
            let middle = middle + Vector3::z() * (lift_m + above_m);
            seams.rows += 1;
            let crack_m = widest_miss_m(&surface, &middle, &ahead, end.pitch_rad.tan());
            if crack_m > CRACK_MAX_M {
                let place = format!("{crack_m:.3} m at {share} of {from:?} to {to:?}");
                seams.cracks.push((from.road, place));
            }
        }
    }
    seams
}

fn is_raised(map: &Map, place: &Waypoint) -> bool {
    map.lane(place).lane_type == LaneType::Sidewalk
}

fn widest_miss_m(surface: &Surface, middle: &Point3<f64>, ahead: &Vector3<f64>, slope: f64) -> f64 {
    let (mut run_m, mut widest_m) = (0.0_f64, 0.0_f64);
    let mut along_m = -REACH_M;
    while along_m <= REACH_M {
        let at = middle + ahead * along_m;
        let wanted_m = at.z + slope * along_m;
        let hit = surface.heights(at.x, at.y).any(|z| (z - wanted_m).abs() <= CRACK_MAX_M);
        run_m = if hit { 0.0 } else { run_m + STEP_M };
        widest_m = widest_m.max(run_m);
        along_m += STEP_M;
    }
    widest_m
}

/// Cracks but those where one of the `short` roads ends.
fn judge(map: &Map, short: &[u32]) -> Vec<String> {
    let mut seams = seams(map);
    seams.cracks.retain(|(road, _)| !short.contains(road));
    println!(
        "{}: {} rows, {} cracks; {} joints torn by the map",
        map.name(),
        seams.rows,
        seams.cracks.len(),
        seams.torn_by_the_map
    );
    seams.cracks.into_iter().take(5).map(|(_, crack)| format!("{}: {crack}", map.name())).collect()
}

#[test]
fn no_town_of_ours_has_cracks_wider_than_a_centimetre() {
    let mut cracks = Vec::new();
    for map in towns() {
        assert!(!map.lane_joints().is_empty(), "{}", map.name());
        cracks.extend(judge(&map, &[]));
    }
    assert!(cracks.is_empty(), "{cracks:#?}");
}

#[test]
fn no_real_map_has_cracks_wider_than_a_centimetre_but_where_its_own_lanes_are_torn() {
    for judged in maps::all() {
        let short = if judged.name == "Town03" { &SHORT_IN_TOWN03[..] } else { &[] };
        let cracks = judge(&judged.map, short);
        assert!(cracks.is_empty(), "{cracks:#?}");
    }
}
