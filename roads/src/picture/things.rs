//! Scenery, paved land, crosswalks and spawn points.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3};

use super::canvas::{Canvas, Paint, Shapes};
use super::{Pixel, lettering};
use crate::Map;
use crate::labels::SceneryKind;
use crate::lanes::lateral_point;
use crate::scenery::SceneryBox;

/// Names and colours for the key.
pub(super) const KEY: &[(&str, &str)] = &[
    ("crosswalk", CROSSWALK),
    ("building", BUILDING),
    ("tree", TREE),
    ("post", POLE),
    ("barrier", BARRIER),
    ("prop", PROP),
    ("spawn point", SPAWN),
];

const CROSSWALK: &str = "#ffffff";
const BUILDING: &str = "#b56b57";
const TREE: &str = "#5f9150";
const POLE: &str = "#3d4147";
const BARRIER: &str = "#7b5a2c";
const PROP: &str = "#d18a1c";
const SPAWN: &str = "#1b4fd6";
const PAVING: &str = "#d9d2c4";
const LAWN: &str = "#c3d6ab";
/// Arrow heads of spawn points reach no further, in metres, so that they stay in their lanes.
const HEAD_MAX_M: f64 = 2.2;

fn xy(point: Point3<f64>) -> [f64; 2] {
    [point.x, point.y]
}

fn rectangle(pose: &Isometry3<f64>, [x, y]: [f64; 2]) -> [[f64; 2]; 4] {
    [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| xy(pose * Point3::new(x, y, 0.0)))
}

/// Paved and planted land.
pub(super) fn on_the_ground(map: &Map, canvas: &mut Canvas) {
    let (mut paving, mut lawn) = (Shapes::default(), Shapes::default());
    for road in &map.model.roads {
        for object in road.objects.iter().filter(|object| object.object_type == "patch") {
            let foot = lateral_point(road, object.s, object.t, 0.0);
            let heading_rad = road.reference(object.s).heading_rad + object.heading_rad;
            let pose = Isometry3::new(foot.coords, nalgebra::Vector3::z() * heading_rad);
            let shapes = if object.name.contains("Lawn") { &mut lawn } else { &mut paving };
            let corners = rectangle(&pose, [object.length_m / 2.0, object.width_m / 2.0]);
            shapes.polygon(&corners);
        }
    }
    canvas.paint(&paving, Paint::fill(PAVING));
    canvas.paint(&lawn, Paint::fill(LAWN));
}

/// Everything above the roads.
pub(super) fn standing(map: &Map, canvas: &mut Canvas, pixel: Pixel) {
    let mut crosswalks = Shapes::default();
    for corners in map.crosswalks() {
        crosswalks.polygon(&corners.into_iter().map(xy).collect::<Vec<_>>());
    }
    let outline = Paint { stroke: "#5e6064", width_m: pixel.metres(0.4), ..Paint::fill(CROSSWALK) };
    canvas.paint(&crosswalks, Paint { opacity: Some(0.75), ..outline });
    let of_kind = |kind: SceneryKind| map.scenery().iter().filter(move |thing| thing.kind == kind);
    for (kind, colour, edge) in [
        (SceneryKind::Building, BUILDING, "#7d4537"),
        (SceneryKind::Barrier, BARRIER, BARRIER),
        (SceneryKind::Prop, PROP, PROP),
    ] {
        let mut shapes = Shapes::default();
        for thing in of_kind(kind) {
            shapes.polygon(&rectangle(&thing.pose, [thing.half_extent_m.x, thing.half_extent_m.y]));
        }
        let paint = Paint { stroke: edge, width_m: pixel.metres(0.6), ..Paint::fill(colour) };
        canvas.paint(&shapes, paint);
    }
    let mut trees = Shapes::default();
    for tree in of_kind(SceneryKind::Tree) {
        trees.ring(place(tree), tree.crown_radius_m.max(0.5), 10, 0.0);
    }
    canvas.paint(&trees, Paint { opacity: Some(0.8), ..Paint::fill(TREE) });
    let mut poles = Shapes::default();
    for pole in of_kind(SceneryKind::Pole) {
        poles.ring(place(pole), pixel.metres(0.9), 6, 0.0);
    }
    canvas.paint(&poles, Paint::fill(POLE));
    spawn_points(map, canvas, pixel);
}

/// Squares as high as the letters that a text takes up.
fn cells([x, y]: [f64; 2], width_m: f64, letters_m: f64) -> Vec<[i64; 2]> {
    #[allow(clippy::cast_possible_truncation, reason = "places are some kilometres away")]
    let cell = |m: f64| (m / letters_m).floor() as i64;
    let rows = cell(y)..=cell(y + letters_m);
    rows.flat_map(|row| (cell(x)..=cell(x + width_m)).map(move |column| [column, row])).collect()
}

fn place(thing: &SceneryBox) -> [f64; 2] {
    [thing.pose.translation.x, thing.pose.translation.y]
}

/// An arrow head at every spawn point, with its index beside it where no other stands.
fn spawn_points(map: &Map, canvas: &mut Canvas, pixel: Pixel) {
    let reach_m = pixel.metres(3.0).min(HEAD_MAX_M).max(pixel.metres(1.5));
    let half_m = 0.6 * reach_m;
    let letters_m = pixel.metres(4.5);
    let (mut heads, mut numbers) = (Shapes::default(), Shapes::default());
    let mut taken: BTreeSet<[i64; 2]> = BTreeSet::new();
    for (index, spawn) in map.spawn_points().iter().enumerate() {
        let at = |x: f64, y: f64| xy(spawn * Point3::new(x, y, 0.0));
        heads.polygon(&[at(reach_m, 0.0), at(-reach_m, half_m), at(-reach_m, -half_m)]);
        let [x, y] = at(0.0, 0.0);
        let text = index.to_string();
        let cells = cells([x, y], lettering::width(&text, letters_m), letters_m);
        if cells.iter().all(|cell| !taken.contains(cell)) {
            taken.extend(cells);
            numbers.text(&text, [x + half_m, y + half_m], letters_m);
        }
    }
    canvas.paint(&heads, Paint::fill(SPAWN));
    canvas.paint(&numbers, Paint::line("#0d2a78", pixel.metres(0.6)));
}
