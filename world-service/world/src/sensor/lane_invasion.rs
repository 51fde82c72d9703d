//! Lines the carrier crosses: `sensor.other.lane_invasion`.
//!
//! **Source:** the client library: each lower corner of the carrier's box is followed from tick to
//! tick; what counts are the lines between its two lanes if both are of one lane section outside of
//! junctions.

use nalgebra::{Point3, Vector3};
use roads::{LaneTypes, Map, MarkType, Waypoint};
use schemas::{Measurement, Vec3};
use serde::{Deserialize, Serialize};

use super::mount::Carrier;

/// Lanes of a section, at most, as far as a crossing is looked for.
const LANES_MAX: usize = 64;

/// Where a corner was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Place {
    lane: Waypoint,
    /// Beside the outermost lane of the road.
    off_road: bool,
}

/// The corners of the carrier's box at the end of the last tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaneInvasion {
    corners: [Option<Place>; 4],
}

/// A line of a lane section: the side of one of its lanes.
#[derive(Clone, Copy, PartialEq)]
struct Line {
    /// Lanes on both sides, the smaller id first; the same twice at the edge of the road.
    lanes: (i32, i32),
    kind: MarkType,
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

impl LaneInvasion {
    /// `None` when no line was crossed in this tick.
    pub(super) fn measure(&mut self, carrier: &Carrier, roads: &Map) -> Option<Measurement> {
        let mut lines: Vec<Line> = Vec::new();
        for (last, corner_m) in self.corners.iter_mut().zip(lower_corners_m(carrier)) {
            let now = place(roads, corner_m);
            if let (Some(before), Some(now)) = (*last, now) {
                for line in crossed(roads, before, now) {
                    if !lines.contains(&line) {
                        lines.push(line);
                    }
                }
            }
            *last = now;
        }
        let marks: Vec<String> = lines.iter().map(|line| line.kind.name().to_owned()).collect();
        (!marks.is_empty()).then_some(Measurement::LaneInvasion { marks })
    }
}

/// World frame.
fn lower_corners_m(carrier: &Carrier) -> [Vec3; 4] {
    let Carrier { world_from_actor, box_centre_m, box_half_m, .. } = carrier;
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(ahead, left)| {
        let out_m = Vec3::new(ahead * box_half_m.x, left * box_half_m.y, -box_half_m.z);
        (world_from_actor * nalgebra::Point3::from(box_centre_m + out_m)).coords
    })
}

fn place(roads: &Map, corner_m: Vec3) -> Option<Place> {
    let point: Vector3<f64> = nalgebra::convert(corner_m);
    let point = Point3::from(point);
    let lane = roads.nearest(point, LaneTypes::ANY)?;
    Some(Place { lane, off_road: roads.inside(point, LaneTypes::ANY).is_none() })
}

fn crossed(roads: &Map, before: Place, now: Place) -> Vec<Line> {
    let (from, to) = (before.lane, now.lane);
    let same_section = from.road == to.road && from.section == to.section;
    let stays = from.lane == to.lane && before.off_road == now.off_road;
    if !same_section || stays || roads.lane(&to).is_junction {
        return Vec::new();
    }
    let mut lines = if from.lane == to.lane {
        Vec::new()
    } else {
        [Side::Left, Side::Right]
            .into_iter()
            .find_map(|side| lines_towards(roads, from, to.lane, side))
            .unwrap_or_default()
    };
    if before.off_road != now.off_road {
        lines.extend(edge(roads, &to));
    }
    lines.retain(|line| line.kind != MarkType::None);
    lines
}

/// The lines from one lane to another to this side; `None` when the other is not there.
fn lines_towards(roads: &Map, from: Waypoint, to: i32, side: Side) -> Option<Vec<Line>> {
    let (mut at, mut side, mut lines) = (from, side, Vec::new());
    for _ in 0..LANES_MAX {
        if at.lane == to {
            return Some(lines);
        }
        let next = neighbour(roads, &at, side)?;
        lines.extend(line(roads, &at, side, next.lane));
        // Beyond the middle of the road traffic comes the other way, and its left is our right.
        if next.lane.signum() != at.lane.signum() {
            side = if side == Side::Left { Side::Right } else { Side::Left };
        }
        at = next;
    }
    None
}

fn neighbour(roads: &Map, at: &Waypoint, side: Side) -> Option<Waypoint> {
    match side {
        Side::Left => roads.left(at),
        Side::Right => roads.right(at),
    }
}

fn line(roads: &Map, at: &Waypoint, side: Side, beyond: i32) -> Option<Line> {
    let lane = roads.lane(at);
    let mark = if side == Side::Left { lane.left_mark } else { lane.right_mark };
    let lanes = (at.lane.min(beyond), at.lane.max(beyond));
    Some(Line { lanes, kind: mark?.mark_type })
}

/// The line at the outer edge of an outermost lane.
fn edge(roads: &Map, at: &Waypoint) -> Option<Line> {
    let sides = [Side::Right, Side::Left];
    let outer = sides.into_iter().find(|&side| neighbour(roads, at, side).is_none())?;
    line(roads, at, outer, at.lane)
}
