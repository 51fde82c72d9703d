//! One function per kind of answer.

use nalgebra::Point3;
use roads::{LaneTypes, Waypoint};
use serde_json::Value;

use super::maps::Judged;

/// How many answers were compared and how many differ, with the first of these.
#[derive(Default)]
pub(crate) struct Outcome {
    pub(crate) asked: usize,
    pub(crate) wrong: usize,
    pub(crate) examples: Vec<String>,
}

impl Outcome {
    pub(crate) fn compare(&mut self, right: bool, example: impl FnOnce() -> String) {
        self.asked += 1;
        if !right {
            self.wrong += 1;
            if self.examples.len() < 6 {
                self.examples.push(example());
            }
        }
    }
}

/// Columns of a row of `waypoints`.
pub(crate) mod column {
    pub(crate) const X: usize = 4;
    pub(crate) const PITCH: usize = 7;
    pub(crate) const YAW: usize = 8;
    pub(crate) const WIDTH: usize = 10;
    pub(crate) const TYPE: usize = 11;
    pub(crate) const CHANGE: usize = 12;
    pub(crate) const JUNCTION: usize = 13;
    pub(crate) const LEFT: usize = 15;
    pub(crate) const RIGHT: usize = 16;
    pub(crate) const LEFT_MARK: usize = 17;
    pub(crate) const RIGHT_MARK: usize = 18;
    pub(crate) const NEXT: usize = 19;
    pub(crate) const PREVIOUS: usize = 20;
}

pub(crate) fn rows<'a>(judged: &'a Judged, key: &str) -> &'a [Value] {
    judged.answers[key].as_array().map_or(&[], Vec::as_slice)
}

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[allow(clippy::cast_possible_truncation, reason = "ids in the answers are small whole numbers")]
pub(crate) fn place(ident: &[Value]) -> Waypoint {
    Waypoint {
        road: number(&ident[0]) as u32,
        section: number(&ident[1]) as u32,
        lane: number(&ident[2]) as i32,
        s: number(&ident[3]),
    }
}

pub(crate) fn place_of(value: &Value) -> Option<Waypoint> {
    value.as_array().map(|ident| place(ident))
}

fn same_lane(a: &Waypoint, b: &Waypoint) -> bool {
    (a.road, a.section, a.lane) == (b.road, b.section, b.lane)
}

pub(crate) fn degrees_apart(a: f64, b: f64) -> f64 {
    let apart = (a - b).rem_euclid(360.0);
    apart.min(360.0 - apart)
}

/// The client's frame mirrors y and counts yaw the other way.
pub(crate) fn client_point(point: &Point3<f64>) -> [f64; 3] {
    [point.x, -point.y, point.z]
}

/// How far a coordinate of the client may be off: a tenth of a millimetre in either direction from
/// writing it down, and one last place of its single precision (0.24 mm at 3 km).
fn coordinate_off_max_m(coordinate_m: f64) -> f64 {
    2e-4 + coordinate_m.abs() * f64::from(f32::EPSILON)
}

fn our_point(at: &Value) -> Point3<f64> {
    Point3::new(number(&at[0]), -number(&at[1]), number(&at[2]))
}

pub(crate) fn poses(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "waypoints") {
        let at = place(row.as_array().expect("a row"));
        let pose = judged.map.lane_pose(&at).expect("of this map");
        let found = client_point(&pose.point);
        let off_m = |axis: usize| (found[axis] - number(&row[column::X + axis])).abs();
        let near = (0..3).all(|axis| off_m(axis) <= coordinate_off_max_m(found[axis]));
        let yaw_off_deg = degrees_apart(-pose.heading_rad.to_degrees(), number(&row[column::YAW]));
        let pitch_off_deg = degrees_apart(pose.pitch_rad.to_degrees(), number(&row[column::PITCH]));
        let right = near && yaw_off_deg <= 1e-3 && pitch_off_deg <= 1e-3;
        outcome.compare(right, || format!("{found:?} {yaw_off_deg} {pitch_off_deg} deg {row}"));
    }
    outcome
}

pub(crate) fn lanes(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "waypoints") {
        let info = judged.map.lane(&place(row.as_array().expect("a row")));
        let junction = row[column::JUNCTION].as_u64();
        let right = (info.width_m - number(&row[column::WIDTH])).abs() <= 1e-5
            && Some(info.lane_type as u64) == row[column::TYPE].as_u64()
            && info.is_junction == junction.is_some()
            && info.junction_id.map(u64::from) == junction;
        outcome.compare(right, || format!("{info:?} {row}"));
    }
    outcome
}

fn mark_is(found: Option<roads::LaneMark>, wanted: &Value) -> bool {
    match (found, wanted.as_array()) {
        (None, None) => true,
        (Some(mark), Some(wanted)) => {
            wanted[0].as_u64() == Some(mark.mark_type as u64)
                && wanted[1].as_u64() == Some(mark.color as u64)
                && wanted[2].as_u64() == Some(mark.lane_change as u64)
                && (number(&wanted[3]) - mark.width_m).abs() < 1e-4
        }
        _ => false,
    }
}

pub(crate) fn neighbours(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "waypoints") {
        let at = place(row.as_array().expect("a row"));
        let info = judged.map.lane(&at);
        let key = |w: Option<Waypoint>| {
            w.map_or(Value::Null, |w| serde_json::json!([w.road, w.section, w.lane]))
        };
        let right = key(judged.map.left(&at)) == row[column::LEFT]
            && key(judged.map.right(&at)) == row[column::RIGHT]
            && mark_is(info.left_mark, &row[column::LEFT_MARK])
            && mark_is(info.right_mark, &row[column::RIGHT_MARK])
            && Some(info.lane_change as u64) == row[column::CHANGE].as_u64();
        outcome.compare(right, || format!("{info:?} {row}"));
    }
    outcome
}

fn same_places(mut found: Vec<Waypoint>, wanted: &Value) -> bool {
    let Some(wanted) = wanted.as_array() else { return true };
    let order = |a: &Waypoint, b: &Waypoint| {
        (a.road, a.section, a.lane).cmp(&(b.road, b.section, b.lane)).then(a.s.total_cmp(&b.s))
    };
    found.sort_by(order);
    let mut wanted: Vec<Waypoint> = wanted.iter().filter_map(place_of).collect();
    wanted.sort_by(order);
    // Two connections of a junction to one connecting road make the client list a place twice.
    wanted.dedup();
    found.len() == wanted.len()
        && found.iter().zip(&wanted).all(|(a, b)| same_lane(a, b) && (a.s - b.s).abs() <= 1e-5)
}

pub(crate) fn moving(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "waypoints") {
        let at = place(row.as_array().expect("a row"));
        let (next, previous) = (judged.map.next(&at, 2.0), judged.map.previous(&at, 2.0));
        let right = same_places(next.clone(), &row[column::NEXT])
            && same_places(previous.clone(), &row[column::PREVIOUS]);
        outcome.compare(right, || format!("{next:?} {previous:?} {row}"));
    }
    outcome
}

pub(crate) fn lookups(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "xodr_lookups") {
        let (Some(road), Some(lane)) = (row[0].as_u64(), row[1].as_i64()) else { continue };
        let (Ok(road), Ok(lane)) = (u32::try_from(road), i32::try_from(lane)) else { continue };
        let agrees = |s: f64| match (judged.map.waypoint(road, lane, s), place_of(&row[3])) {
            (None, None) => true,
            (Some(found), Some(wanted)) => {
                same_lane(&found, &wanted) && (found.s - wanted.s).abs() < 1e-4
            }
            _ => false,
        };
        // The question is written with six digits; at a lane's end the digits cut off decide.
        let s = number(&row[2]);
        outcome.compare([s, s - 1e-6, s + 1e-6].into_iter().any(agrees), || row.to_string());
    }
    outcome
}

pub(crate) fn generated(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    let wanted = &judged.answers["generate_waypoints"];
    for (key, step_m) in [("5.0", 5.0), ("2.0", 2.0)] {
        let found = judged.map.generate_waypoints(step_m).expect("a step above 0").len() as u64;
        outcome.compare(Some(found) == wanted[key].as_u64(), || format!("{found} {wanted}"));
    }
    let places = judged.map.generate_waypoints(2.0).expect("a step above 0");
    let inside = places.iter().filter(|w| judged.map.lane(w).is_junction).count() as u64;
    let right = Some(inside) == wanted["in_junction_2.0"].as_u64();
    outcome.compare(right, || format!("{inside} in junctions {wanted}"));
    outcome
}

/// Pairs of different lanes; a lane paired with itself is how the client shows a dead end, and
/// depends on rounding.
pub(crate) fn topology(judged: &Judged) -> Outcome {
    type Key = (u32, u32, i32);
    let key = |w: &Waypoint| (w.road, w.section, w.lane);
    let mut found: Vec<(Key, Key)> =
        judged.map.topology().iter().map(|(a, b)| (key(a), key(b))).collect();
    let mut wanted: Vec<(Key, Key)> = rows(judged, "topology")
        .iter()
        .filter_map(|row| row.as_array())
        .map(|row| (key(&place(&row[..4])), key(&place(&row[4..]))))
        .collect();
    for pairs in [&mut found, &mut wanted] {
        pairs.retain(|(a, b)| a != b);
        pairs.sort_unstable();
    }
    let mut outcome = Outcome::default();
    for pair in &wanted {
        outcome.compare(found.contains(pair), || format!("missing {pair:?}"));
    }
    for pair in found.iter().filter(|pair| !wanted.contains(pair)) {
        outcome.compare(false, || format!("additional {pair:?}"));
    }
    outcome
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the client sends masks as signed 32-bit numbers"
)]
pub(crate) fn projections(judged: &Judged) -> Outcome {
    // How far the client's chords lie from its lanes; more where a curve climbs steeply.
    let s_off_max_m =
        if judged.name.contains("superelevation_elevation_curve") { 1.5 } else { 0.6 };
    let mut outcome = Outcome::default();
    for row in rows(judged, "projections") {
        let at = our_point(&row["at"]);
        let types = LaneTypes::from_bits(number(&row["mask"]) as i32 as u32);
        let found = judged.map.nearest(at, types);
        let wanted = place_of(&row["projected"]);
        let right = match (&found, &wanted) {
            (None, None) => true,
            (Some(found), Some(wanted)) => {
                let off_m = |w: &Waypoint| {
                    (judged.map.lane_pose(w).expect("of this map").point - at).norm()
                };
                let tie = (off_m(found) - off_m(wanted)).abs() <= 5e-3;
                tie || same_lane(found, wanted) && (found.s - wanted.s).abs() <= s_off_max_m
            }
            _ => false,
        };
        outcome.compare(right, || format!("{found:?} {row}"));
        let inside = judged.map.inside(at, types);
        let agrees = match (&inside, place_of(&row["inside"])) {
            (None, None) => true,
            (Some(inside), Some(wanted)) => same_lane(inside, &wanted),
            _ => false,
        };
        // With another lane as near as this one, the answer about the inside is that lane's.
        let same = found.zip(wanted).is_some_and(|(found, wanted)| same_lane(&found, &wanted));
        if right && same {
            outcome.compare(agrees, || format!("inside {inside:?} {row}"));
        }
    }
    outcome
}

pub(crate) fn crosswalks(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    let crosswalks = judged.map.crosswalks();
    let mut found: Vec<[f64; 3]> = crosswalks.iter().flatten().map(client_point).collect();
    let wanted = rows(judged, "crosswalk_points_sorted");
    let counts = || format!("{} corners, wanted {}", found.len(), wanted.len());
    outcome.compare(found.len() == wanted.len(), counts);
    for row in wanted {
        let off_m = |at: &[f64; 3]| {
            (0..3).map(|axis| (at[axis] - number(&row[axis])).abs()).fold(0.0, f64::max)
        };
        let nearest =
            (0..found.len()).min_by(|a, b| off_m(&found[*a]).total_cmp(&off_m(&found[*b])));
        let right = nearest.is_some_and(|index| off_m(&found[index]) < 5e-3);
        outcome.compare(right, || format!("{row} {:?}", nearest.map(|index| found[index])));
        // Each corner answers for one only.
        if let Some(index) = nearest.filter(|_| right) {
            found.swap_remove(index);
        }
    }
    outcome
}

pub(crate) fn geo(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "geo") {
        let at = our_point(&row["at"]);
        let place = judged.map.geo_place(&at);
        let back = judged.map.point_at(&place);
        let right = (place.latitude_deg - number(&row["lat"])).abs() < 1e-11
            && (place.longitude_deg - number(&row["lon"])).abs() < 1e-11
            && (place.altitude_m - number(&row["alt"])).abs() < 1e-3
            && (back - at).norm() < 1e-6;
        outcome.compare(right, || format!("{place:?} {back} {row}"));
    }
    outcome
}
