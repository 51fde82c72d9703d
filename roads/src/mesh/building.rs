//! Houses with windows, and other boxes.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::render::Tiles;
use super::{Material, Sink};
use crate::labels::{self, SceneryKind};
use crate::model::Object;
use crate::scenery::SceneryBox;

/// Height of a storey, in metres.
const STOREY_M: f64 = 3.3;
/// Distance from window to window, in metres.
const BAY_M: f64 = 3.4;
/// Width and height of a window, in metres.
const WINDOW_M: [f64; 2] = [1.5, 1.7];
/// Width and height of a window on the ground floor, in metres.
const SHOP_M: [f64; 2] = [2.6, 2.2];
/// How far windows stand out of their wall, in metres.
const PANE_M: f64 = 0.04;
/// A wall nearer than this to the next house has no windows, in metres.
const NEIGHBOUR_M: f64 = 0.5;

/// Houses are looked for in squares no smaller than this, in metres.
const SQUARE_MIN_M: f64 = 16.0;

/// Raises everything that is a box.
pub(super) fn raise(scenery: &[SceneryBox], tiles: &mut Tiles) {
    let places = || (0u32..).zip(scenery);
    let houses: Vec<(u32, &SceneryBox)> =
        places().filter(|(_, thing)| thing.kind == SceneryKind::Building).collect();
    let near = Near::new(houses.iter().map(|(_, house)| *house));
    for (index, (place, house)) in houses.iter().enumerate() {
        tiles.thing = Some(*place);
        let material = [Material::Wall, Material::Brick, Material::Concrete]
            .get(index % 3)
            .copied()
            .unwrap_or(Material::Wall);
        cuboid(house, house.half_extent_m, [material, Material::Roof], tiles);
        windows(house, &near, tiles);
    }
    for (place, thing) in places() {
        tiles.thing = Some(place);
        match thing.kind {
            SceneryKind::Pole => lamp(thing, tiles),
            SceneryKind::Barrier | SceneryKind::Prop => {
                cuboid(thing, thing.half_extent_m, [Material::Concrete; 2], tiles);
            }
            SceneryKind::Building | SceneryKind::Tree => {}
        }
    }
}

/// Four sides and the top of a box around the middle of a scenery box.
pub(super) fn cuboid(
    thing: &SceneryBox,
    half: Vector3<f64>,
    [side, top]: [Material; 2],
    sink: &mut impl Sink,
) {
    block(thing, Vector3::zeros(), half, [side, top], sink);
}

fn block(
    thing: &SceneryBox,
    middle: Vector3<f64>,
    half: Vector3<f64>,
    [side, top]: [Material; 2],
    sink: &mut impl Sink,
) {
    let corner = |x: f64, y: f64, z: f64| {
        thing.pose * Point3::from(middle + Vector3::new(x * half.x, y * half.y, z * half.z))
    };
    let ring =
        |z: f64| [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| corner(x, y, z));
    let (foot, head) = (ring(-1.0), ring(1.0));
    for (k, next) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
        sink.quad(side, [foot[k], foot[next], head[next], head[k]]);
    }
    sink.quad(top, head);
}

/// Windows of an object that is a house; 0 for any other.
pub(crate) fn panes(object: &Object) -> f64 {
    if labels::kind(object) != Some(SceneryKind::Building) {
        return 0.0;
    }
    let round_m = 2.0 * (object.length_m.abs() + object.width_m.abs());
    let round_m = round_m.max(8.0 * object.radius_m.abs());
    round_m / BAY_M * (object.height_m.abs() / STOREY_M)
}

/// Houses by place: those a point may lie in, without asking all.
struct Near<'s> {
    /// By the squares their circles touch.
    squares: BTreeMap<[i64; 2], Vec<&'s SceneryBox>>,
    /// Side of a square: no circle touches more than nine.
    side_m: f64,
}

impl<'s> Near<'s> {
    fn new(houses: impl Iterator<Item = &'s SceneryBox> + Clone) -> Self {
        let radius_m = |house: &SceneryBox| house.half_extent_m.xy().norm();
        let side_m = houses.clone().map(radius_m).fold(SQUARE_MIN_M, f64::max);
        let mut near = Self { squares: BTreeMap::new(), side_m };
        for house in houses {
            let (middle, reach_m) = (house.pose.translation.vector.xy(), radius_m(house));
            let [low, high] = [-reach_m, reach_m]
                .map(|reach_m| near.square(middle.x + reach_m, middle.y + reach_m));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    near.squares.entry([x, y]).or_default().push(house);
                }
            }
        }
        near
    }

    #[allow(clippy::cast_possible_truncation, reason = "places of a map are of moderate size")]
    fn square(&self, x: f64, y: f64) -> [i64; 2] {
        [x, y].map(|v| (v / self.side_m).floor() as i64)
    }

    fn covers(&self, point: &Point3<f64>) -> bool {
        let here = self.squares.get(&self.square(point.x, point.y));
        here.into_iter().flatten().any(|house| covers(house, point))
    }
}

fn windows(house: &SceneryBox, near: &Near<'_>, sink: &mut impl Sink) {
    let half = house.half_extent_m;
    // Each wall by its outward direction; along it, left to right seen from outside.
    let walls = [
        (Vector3::x(), Vector3::y(), half.x, half.y),
        (-Vector3::x(), -Vector3::y(), half.x, half.y),
        (Vector3::y(), -Vector3::x(), half.y, half.x),
        (-Vector3::y(), Vector3::x(), half.y, half.x),
    ];
    for (outward, along, depth_m, half_width_m) in walls {
        let before_wall = house.pose * Point3::from(outward * (depth_m + NEIGHBOUR_M));
        if near.covers(&before_wall) {
            continue;
        }
        let bays = (2.0 * half_width_m / BAY_M).floor();
        let storeys = (2.0 * half.z / STOREY_M).floor();
        let mut storey = 0.0;
        while storey < storeys {
            let [width_m, height_m] = if storey == 0.0 { SHOP_M } else { WINDOW_M };
            let sill_m = -half.z + storey * STOREY_M + if storey == 0.0 { 0.4 } else { 0.9 };
            let mut bay = 0.0;
            while bay < bays {
                let middle_m = (bay + 0.5 - bays / 2.0) * (2.0 * half_width_m / bays);
                let corner = |across_m: f64, up_m: f64| {
                    let local = outward * (depth_m + PANE_M)
                        + along * (middle_m + across_m)
                        + Vector3::z() * (sill_m + up_m);
                    house.pose * Point3::from(local)
                };
                let (l, r) = (-width_m / 2.0, width_m / 2.0);
                let pane =
                    [corner(l, 0.0), corner(r, 0.0), corner(r, height_m), corner(l, height_m)];
                sink.quad(Material::Window, pane);
                bay += 1.0;
            }
            storey += 1.0;
        }
    }
}

/// Whether a point lies within the outline of a house, at any height.
fn covers(house: &SceneryBox, point: &Point3<f64>) -> bool {
    let local = house.pose.inverse_transform_point(point);
    local.x.abs() < house.half_extent_m.x && local.y.abs() < house.half_extent_m.y
}

/// A post with an arm that holds a lamp over the road, which lies along the box's x axis.
fn lamp(thing: &SceneryBox, sink: &mut impl Sink) {
    const ARM_M: f64 = 1.4;
    let half = thing.half_extent_m;
    cuboid(thing, half, [Material::Metal; 2], sink);
    let arm = Vector3::new(ARM_M / 2.0, 0.0, half.z);
    block(thing, arm, Vector3::new(ARM_M / 2.0, 0.04, 0.05), [Material::Metal; 2], sink);
    let head = Vector3::new(ARM_M, 0.0, half.z - 0.05);
    block(thing, head, Vector3::new(0.35, 0.12, 0.06), [Material::Metal; 2], sink);
}
