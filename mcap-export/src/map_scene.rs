//! The map as things to be drawn: surfaces of lanes, marks, crossings, signs, and posts of lights.

use nalgebra::{Isometry3, Point3};
use roads::{LaneMark, Map, MarkColor, MarkType, SignKind, Waypoint};
use serde_json::{Value, json};

use crate::convert::{Entity, opaque, pose};

/// From one point of an edge to the next, and farther on maps with more points than are told.
const STEP_M: f64 = 2.0;
/// How wide a line is drawn that does not say it.
const LINE_M: f64 = 0.12;
/// Of paint above the road.
const PAINT_M: f64 = 0.02;
/// Line segments of two points each.
const LINE_LIST: u8 = 2;
/// Points at most, so that the largest maps stay one message that viewers take.
const POINTS_MAX: f64 = 400_000.0;
/// Points told of a step of a lane: two of its surface, two of each mark.
const POINTS_PER_STEP: f64 = 6.0;
const ROAD: [f32; 3] = [0.25, 0.25, 0.27];
const WHITE: [f32; 3] = [0.9, 0.9, 0.9];
const YELLOW: [f32; 3] = [0.95, 0.75, 0.1];
/// Edges of the road that nobody has painted.
const GREY: [f32; 3] = [0.5, 0.5, 0.5];
const CROSSING: [f32; 3] = [0.75, 0.75, 0.8];
const SIGN: [f32; 3] = [0.8, 0.1, 0.1];
const HOUSING: [f32; 3] = [0.1, 0.1, 0.1];
/// Half the size of a sign's plate, and how high its middle is above its foot.
const PLATE_HALF_M: [f64; 3] = [0.05, 0.35, 0.35];
const PLATE_UP_M: f64 = 2.2;
const TEXT_M: f32 = 0.6;

/// The scene of a map, which does not change.
pub(crate) fn of(map: &Map, now: u64) -> Value {
    let mut strips = Strips::default();
    let step_m = step_m(map);
    for (from, to) in map.driving_lanes() {
        strips.lane(map, from, to, step_m);
    }
    let Strips { surface, white, yellow, bare } = strips;
    let mut lanes = Entity::new("lanes");
    lanes.triangles.push(surface.message(ROAD));
    let mut marks = Entity::new("marks");
    for (points, colour) in [(white, WHITE), (yellow, YELLOW), (bare, GREY)] {
        if !points.is_empty() {
            marks.lines.push(lines(points, colour));
        }
    }
    let mut entities = vec![lanes, marks, crossings(map)];
    entities.extend(signs(map));
    entities.push(lights(map));
    let entities = entities.into_iter().filter(|entity| !entity.is_empty());
    let none: [Value; 0] = [];
    let told: Vec<Value> = entities.map(|entity| entity.message(now)).collect();
    json!({"deletions": none, "entities": told})
}

/// How far apart points are, so that there are not too many.
fn step_m(map: &Map) -> f64 {
    let lengths = map.driving_lanes().into_iter().map(|(from, to)| (to.s - from.s).abs());
    STEP_M.max(lengths.sum::<f64>() * POINTS_PER_STEP / POINTS_MAX)
}

/// Triangles over points that some of them share.
#[derive(Default)]
struct Surface {
    points: Vec<Value>,
    indices: Vec<u32>,
}

impl Surface {
    /// A polygon without dents.
    fn polygon(&mut self, corners: &[Point3<f64>]) {
        let first = self.points.len() as u32;
        self.points.extend(corners.iter().map(point));
        for next in 1..(corners.len() as u32).saturating_sub(1) {
            self.indices.extend([first, first + next, first + next + 1]);
        }
    }

    fn message(self, colour: [f32; 3]) -> Value {
        let none: [Value; 0] = [];
        json!({
            "pose": pose(&schemas::Pose::identity()),
            "points": self.points,
            "color": opaque(colour),
            "colors": none,
            "indices": self.indices,
        })
    }
}

/// What lanes are drawn as.
#[derive(Default)]
struct Strips {
    surface: Surface,
    white: Vec<Value>,
    yellow: Vec<Value>,
    /// Edges without a mark.
    bare: Vec<Value>,
}

impl Strips {
    fn lane(&mut self, map: &Map, from: Waypoint, to: Waypoint, step_m: f64) {
        let length_m = (to.s - from.s).abs();
        let steps = (length_m / step_m).ceil().max(1.0) as u32;
        let at = |step: u32| {
            let share = f64::from(step) / f64::from(steps);
            Waypoint { s: from.s + (to.s - from.s) * share, ..from }
        };
        let mut before: Option<[Point3<f64>; 2]> = None;
        for step in 0..=steps {
            let here = at(step);
            let lane = map.lane(&here);
            let edges = edges(&map.pose(&here), lane.width_m);
            let first = self.surface.points.len() as u32;
            self.surface.points.extend(edges.iter().map(point));
            if let Some(before) = before {
                let [a, b, c, d] = [first - 2, first - 1, first, first + 1];
                self.surface.indices.extend([a, b, c, b, d, c]);
                for (side, mark) in [lane.left_mark, lane.right_mark].into_iter().enumerate() {
                    self.mark([before[side], edges[side]], mark, step);
                }
            }
            before = Some(edges);
        }
    }

    /// A piece of the line between a lane and what is beside it.
    fn mark(&mut self, ends: [Point3<f64>; 2], mark: Option<LaneMark>, step: u32) {
        let mark = mark.filter(|mark| mark.mark_type != MarkType::None);
        let is_broken = mark
            .is_some_and(|mark| matches!(mark.mark_type, MarkType::Broken | MarkType::BottsDots));
        if is_broken && step.is_multiple_of(2) {
            return;
        }
        let points = match mark.map(|mark| mark.color) {
            None => &mut self.bare,
            Some(MarkColor::Yellow) => &mut self.yellow,
            Some(_) => &mut self.white,
        };
        points.extend(ends.iter().map(|end| point(&raised(end))));
    }
}

/// The left and the right edge of a lane.
fn edges(at: &Isometry3<f64>, width_m: f64) -> [Point3<f64>; 2] {
    [width_m / 2.0, -width_m / 2.0].map(|side_m| at * Point3::new(0.0, side_m, 0.0))
}

fn crossings(map: &Map) -> Entity {
    let mut surface = Surface::default();
    for corners in map.crosswalks() {
        let raised: Vec<Point3<f64>> = corners.iter().map(raised).collect();
        // The last corner is the first one again.
        surface.polygon(raised.split_last().map_or(&[], |(_, open)| open));
    }
    let mut entity = Entity::new("crossings");
    if !surface.points.is_empty() {
        entity.triangles.push(surface.message(CROSSING));
    }
    entity
}

/// Signs, each with what it says.
fn signs(map: &Map) -> impl Iterator<Item = Entity> {
    map.traffic_signs().into_iter().map(|sign| {
        let text = match sign.kind {
            SignKind::Stop => "STOP".to_owned(),
            SignKind::Yield => "YIELD".to_owned(),
            SignKind::SpeedLimit { limit_mps } => format!("{:.0} km/h", limit_mps * 3.6),
        };
        let place = sign.pose.point + nalgebra::Vector3::z() * PLATE_UP_M;
        let turn = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, sign.pose.heading_rad);
        let plate = Isometry3::from_parts(place.into(), turn);
        let mut entity = Entity::new(format!("sign/{}", sign.id));
        entity.cubes.push(cube(&plate, PLATE_HALF_M, SIGN));
        entity.texts.push(json!({
            "pose": pose(&plate.cast()),
            "billboard": true,
            "font_size": TEXT_M,
            "scale_invariant": false,
            "color": opaque(WHITE),
            "text": text,
        }));
        entity
    })
}

/// The housings of traffic lights; what they show is told elsewhere.
fn lights(map: &Map) -> Entity {
    let mut entity = Entity::new("lights");
    let posts = map.posts().iter().filter(|post| post.light.is_some());
    let heads =
        posts.map(|post| cube(&post.world_from_carried(), post.carried_half_m.into(), HOUSING));
    entity.cubes.extend(heads);
    entity
}

fn cube(at: &Isometry3<f64>, half_m: [f64; 3], colour: [f32; 3]) -> Value {
    let [x, y, z] = half_m.map(|half_m| 2.0 * half_m);
    let size = json!({"x": x, "y": y, "z": z});
    json!({"pose": pose(&at.cast()), "size": size, "color": opaque(colour)})
}

fn raised(point: &Point3<f64>) -> Point3<f64> {
    Point3::new(point.x, point.y, point.z + PAINT_M)
}

fn point(at: &Point3<f64>) -> Value {
    // Millimetres: a map has many of them.
    let [x, y, z] = [at.x, at.y, at.z].map(|metres| (metres * 1e3).round() / 1e3);
    json!({"x": x, "y": y, "z": z})
}

fn lines(points: Vec<Value>, colour: [f32; 3]) -> Value {
    let none: [Value; 0] = [];
    json!({
        "type": LINE_LIST,
        "pose": pose(&schemas::Pose::identity()),
        "thickness": LINE_M,
        "scale_invariant": false,
        "points": points,
        "color": opaque(colour),
        "colors": none,
        "indices": none,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn town(name: &str) -> Map {
        Map::parse(name, &roads::town::build(name).unwrap()).unwrap()
    }

    #[test]
    fn all_that_a_map_has_is_drawn_where_it_is() {
        let map = town("Town03_Opt");
        let scene = of(&map, 0);
        let entity = |id: &str| {
            let all = scene["entities"].as_array().unwrap();
            all.iter().find(|one| one["id"] == id).unwrap_or_else(|| panic!("no {id}")).clone()
        };
        let surface = &entity("lanes")["triangles"][0];
        let points = surface["points"].as_array().unwrap();
        let indices = surface["indices"].as_array().unwrap();
        assert!(indices.len() > 3_000 && indices.len().is_multiple_of(3));
        assert!(indices.iter().all(|index| (index.as_u64().unwrap() as usize) < points.len()));
        // A lane's area is its length times its width, whatever it is cut into.
        let (mut wanted_m2, mut found_m2) = (0.0, 0.0);
        for (from, to) in map.driving_lanes() {
            wanted_m2 += (to.s - from.s).abs() * map.lane(&from).width_m;
        }
        let at = |index: &Value| {
            let point = &points[index.as_u64().unwrap() as usize];
            let [x, y, z] = ["x", "y", "z"].map(|axis| point[axis].as_f64().unwrap());
            Point3::new(x, y, z)
        };
        for corners in indices.as_chunks::<3>().0 {
            let [a, b, c] = [&corners[0], &corners[1], &corners[2]].map(at);
            found_m2 += (b - a).cross(&(c - a)).norm() / 2.0;
        }
        assert!((found_m2 / wanted_m2 - 1.0).abs() < 0.1, "{found_m2} {wanted_m2}");
        assert_eq!(entity("marks")["lines"].as_array().unwrap().len(), 3);
        let crossings = entity("crossings")["triangles"][0]["points"].as_array().unwrap().len();
        let corners: usize = map.crosswalks().iter().map(|corners| corners.len() - 1).sum();
        assert_eq!(crossings, corners);
        let lights = map.traffic_lights().lights.len();
        assert_eq!(entity("lights")["cubes"].as_array().unwrap().len(), 2 * lights);
        for sign in map.traffic_signs() {
            let plate = &entity(&format!("sign/{}", sign.id))["cubes"][0]["pose"]["position"];
            assert!((plate["x"].as_f64().unwrap() - sign.pose.point.x).abs() < 1e-3);
        }
    }

    #[test]
    fn triangles_of_lanes_are_seen_from_above() {
        let mut strips = Strips::default();
        let map = town("Town02_Opt");
        let (from, to) = map.driving_lanes()[0];
        strips.lane(&map, from, to, STEP_M);
        let points = &strips.surface.points;
        let at = |index: u32| {
            let point = &points[index as usize];
            Point3::new(point["x"].as_f64().unwrap(), point["y"].as_f64().unwrap(), 0.0)
        };
        for corners in strips.surface.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(at);
            assert!((b - a).cross(&(c - a)).z >= -1e-6);
        }
    }
}
