//! Boxes of actors over the picture of a pinhole camera.

use nalgebra::{Point2, Point3};
use schemas::{ActorId, ActorKind, ActorState, Camera, Frame, Pose};
use serde_json::{Value, json};

use crate::convert::{opaque, paint, time};

/// Nearer than this nothing is drawn, farther away boxes are a few pixels.
const NEAR_M: f32 = 0.2;
const FAR_M: f32 = 100.0;
/// Segments of two points each, as Foxglove counts them.
const LINE_LIST: u8 = 4;
const LINE_PX: f32 = 1.5;
const TEXT_PX: f32 = 12.0;
const WALKER: [f32; 3] = [0.95, 0.75, 0.3];
const PROP: [f32; 3] = [0.6, 0.6, 0.6];
/// Corners of a box, by the bits of their numbers: where they differ in one bit there is an edge.
const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// The outlines of all vehicles, walkers and props before a camera, also of those that something
/// hides, but not of who carries the camera inside.
pub(crate) fn of(frame: &Frame, camera: &Camera, world_from_optical: &Pose, now: u64) -> Value {
    let pinhole = Pinhole::of(camera);
    let optical_from_world = world_from_optical.inverse();
    let (mut points, mut texts) = (Vec::new(), Vec::new());
    for actor in frame.actors.iter().filter(|actor| is_seen(actor, camera.carrier)) {
        let optical_from_actor = optical_from_world * actor.world_from_actor;
        let Some(lines) = pinhole.outline(actor, &optical_from_actor) else { continue };
        let top = lines.iter().min_by(|a, b| a.y.total_cmp(&b.y));
        let colour = match actor.kind {
            ActorKind::Vehicle => paint(actor.colour_rgb),
            ActorKind::Walker => opaque(WALKER),
            _ => opaque(PROP),
        };
        let name = frame.type_of(actor).rsplit('.').next().unwrap_or_default();
        if let Some(top) = top {
            texts.push(json!({
                "timestamp": time(now),
                "position": flat(top),
                "text": format!("{} {name}", actor.id.get()),
                "font_size": TEXT_PX,
                "text_color": opaque([1.0; 3]),
                "background_color": {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.4},
            }));
        }
        let none: [Value; 0] = [];
        points.push(json!({
            "timestamp": time(now),
            "type": LINE_LIST,
            "points": lines.iter().map(flat).collect::<Vec<_>>(),
            "outline_color": colour,
            "outline_colors": none,
            "fill_color": {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0},
            "thickness": LINE_PX,
        }));
    }
    let none: [Value; 0] = [];
    json!({"circles": none, "points": points, "texts": texts})
}

fn is_seen(actor: &ActorState, carrier: Option<ActorId>) -> bool {
    let has_box = matches!(actor.kind, ActorKind::Vehicle | ActorKind::Walker | ActorKind::Prop);
    has_box && Some(actor.id) != carrier
}

fn flat(point: &Point2<f32>) -> Value {
    // Tenths of a pixel.
    let [x, y] = [point.x, point.y].map(|px| (f64::from(px) * 10.0).round() / 10.0);
    json!({"x": x, "y": y})
}

/// How a camera sees: x right, y down, z along the view.
struct Pinhole {
    focal_px: f32,
    middle_px: [f32; 2],
    size_px: [f32; 2],
}

impl Pinhole {
    fn of(camera: &Camera) -> Self {
        let size_px = [camera.width_px, camera.height_px].map(|px| px as f32);
        let middle_px = size_px.map(|px| px / 2.0);
        let focal_px = middle_px[0] / (camera.horizontal_fov_rad / 2.0).tan();
        Self { focal_px, middle_px, size_px }
    }

    /// The edges of a box, cut where they come too near, two ends each; `None` out of sight.
    fn outline(&self, actor: &ActorState, optical_from_actor: &Pose) -> Option<Vec<Point2<f32>>> {
        let (centre, half) = (actor.box_centre_m, actor.box_half_extent_m);
        let sign = |corner: usize, bit: usize| if corner & (1 << bit) == 0 { -1.0 } else { 1.0 };
        let corners: [Point3<f32>; 8] = std::array::from_fn(|corner| {
            let signs = schemas::Vec3::new(sign(corner, 0), sign(corner, 1), sign(corner, 2));
            optical_from_actor * Point3::from(centre + half.component_mul(&signs))
        });
        let middle = optical_from_actor * Point3::from(centre);
        if !(NEAR_M..FAR_M).contains(&middle.z) {
            return None;
        }
        let mut ends = Vec::with_capacity(2 * EDGES.len());
        for [one, other] in EDGES {
            ends.extend(
                cut(corners[one], corners[other]).into_iter().flatten().map(|end| self.at(&end)),
            );
        }
        let [width_px, height_px] = self.size_px;
        let overlaps = |of: fn(&Point2<f32>) -> f32, size_px: f32| {
            ends.iter().any(|end| of(end) > 0.0) && ends.iter().any(|end| of(end) < size_px)
        };
        (overlaps(|end| end.x, width_px) && overlaps(|end| end.y, height_px)).then_some(ends)
    }

    fn at(&self, point: &Point3<f32>) -> Point2<f32> {
        let [across, down] = self.middle_px;
        let scale = self.focal_px / point.z;
        Point2::new(across + point.x * scale, down + point.y * scale)
    }
}

/// The part of an edge that is far enough away.
fn cut(one: Point3<f32>, other: Point3<f32>) -> Option<[Point3<f32>; 2]> {
    let at_near = |near: Point3<f32>, far: Point3<f32>| {
        near + (far - near) * ((NEAR_M - near.z) / (far.z - near.z))
    };
    match (one.z >= NEAR_M, other.z >= NEAR_M) {
        (true, true) => Some([one, other]),
        (false, true) => Some([at_near(one, other), other]),
        (true, false) => Some([one, at_near(other, one)]),
        (false, false) => None,
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ImageEncoding, ImageKind, MapRef, Vec3, WorldId};

    use super::*;

    fn camera() -> Camera {
        Camera {
            id: 0,
            carrier: ActorId::new(9),
            carrier_from_camera: Pose::identity(),
            width_px: 200,
            height_px: 100,
            horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
            kind: ImageKind::Rgb,
            encoding: ImageEncoding::Jpeg,
            jpeg_quality: 90,
            ignored: Vec::new(),
            quality: None,
            exposure: schemas::Exposure::PLAIN,
        }
    }

    /// Boxes of 2 m around places before a camera that looks along z.
    fn told(places: &[(u32, [f32; 3])]) -> Value {
        let state = |&(id, [x, y, z]): &(u32, [f32; 3])| {
            let id = ActorId::new(id).unwrap();
            let place = Pose::translation(x, y, z);
            let mut actor = ActorState::at_rest(id, ActorKind::Vehicle, 0, place);
            actor.box_half_extent_m = Vec3::repeat(1.0);
            actor
        };
        let map = MapRef { name: "Town01".to_owned(), digest: String::new() };
        let frame = Frame {
            types: vec!["vehicle.audi.tt".to_owned()],
            actors: places.iter().map(state).collect(),
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        };
        of(&frame, &camera(), &Pose::identity(), 0)
    }

    #[test]
    fn a_box_before_the_camera_is_drawn_as_a_pinhole_shows_it() {
        let told = told(&[(1, [0.0, 0.0, 11.0])]);
        let points = told["points"][0]["points"].as_array().unwrap();
        assert_eq!(points.len(), 24);
        // Focal length 100 pixels; the near face is 10 m away and the far one 12 m.
        let mut xs: Vec<f64> = points.iter().map(|point| point["x"].as_f64().unwrap()).collect();
        xs.sort_by(f64::total_cmp);
        xs.dedup();
        assert_eq!(xs, [90.0, 91.7, 108.3, 110.0]);
        assert_eq!(told["texts"][0]["text"], "1 tt");
    }

    #[test]
    fn who_is_behind_beside_far_away_or_around_the_camera_is_not_drawn() {
        let around = [(9, [0.0, 0.0, 1.0])];
        let away = [(1, [0.0, 0.0, -5.0]), (2, [50.0, 0.0, 10.0]), (3, [0.0, 0.0, 200.0])];
        for places in [&around[..], &away[..]] {
            assert_eq!(told(places)["points"], json!([]));
        }
        // One that reaches beside the camera is cut.
        let cut = told(&[(1, [1.5, 0.0, 0.5])]);
        assert!(cut["points"][0]["points"].as_array().unwrap().len() < 24);
    }
}
