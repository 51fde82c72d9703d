//! What drivers see of the world around them.

use schemas::{ActorId, TrafficLightColour, Vec3};

use crate::path::{PathPoint, heading};

/// Side of a cell of the scene's grid.
const CELL_M: f32 = 16.0;
/// People get so much more room ahead: they walk around whoever stopped for them.
const MORE_TO_WALKERS_M: f32 = 1.2;
/// Bodies higher or lower than this are on another storey.
const STOREY_M: f32 = 2.5;

/// A body on the road: a box seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Whose.
    pub id: ActorId,
    /// Whether it is a person on foot.
    pub is_walker: bool,
    /// Middle of the box, world frame.
    pub centre_m: Vec3,
    /// Unit vector along its length, world frame.
    pub forward: Vec3,
    /// Half its length, width and height.
    pub half_m: Vec3,
    /// World frame.
    pub velocity_mps: Vec3,
}

/// All bodies and lights at one moment.
#[derive(Debug, Default)]
pub struct Scene {
    bodies: Vec<Body>,
    /// Ordered by cell, then by position of the body.
    cells: Vec<([i32; 2], u32)>,
    lights: Vec<TrafficLightColour>,
}

/// The first body on a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ahead {
    /// Whose body.
    pub id: ActorId,
    /// From front bumper to body, along the path; below zero for an overlap.
    pub gap_m: f32,
    pub length_m: f32,
    /// Speed of the body along the path.
    pub along_mps: f32,
    /// In any direction.
    pub speed_mps: f32,
    pub is_walker: bool,
}

impl Ahead {
    /// Its gap, less what people need more, and its speed.
    pub(crate) fn leader(&self) -> (f32, f32) {
        let more_m = if self.is_walker { MORE_TO_WALKERS_M } else { 0.0 };
        (self.gap_m - more_m, self.along_mps)
    }
}

/// The room that a vehicle needs on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Room {
    pub id: ActorId,
    /// From the vehicle's origin to its front bumper.
    pub front_m: f32,
    pub half_width_m: f32,
    /// Room on each side, towards vehicles and towards people.
    pub beside_m: f32,
    pub beside_walkers_m: f32,
}

impl Scene {
    /// A scene of these bodies; `lights` by position among the map's traffic lights, none in a
    /// world without lights.
    #[must_use]
    pub fn new(bodies: Vec<Body>, lights: Vec<TrafficLightColour>) -> Self {
        let mut cells: Vec<_> =
            (0..).zip(&bodies).map(|(index, body)| (cell(&body.centre_m), index)).collect();
        cells.sort_unstable();
        Self { bodies, cells, lights }
    }

    /// What a light shows; unknown in a world without lights.
    pub(crate) fn light(&self, light: u32) -> TrafficLightColour {
        self.lights.get(light as usize).copied().unwrap_or(TrafficLightColour::Unknown)
    }

    /// Calls for every body whose middle is within about `radius_m`, in a fixed order.
    pub(crate) fn near(&self, centre_m: &Vec3, radius_m: f32, mut tell: impl FnMut(&Body)) {
        let reach = Vec3::new(radius_m, radius_m, 0.0);
        let (low, high) = (cell(&(centre_m - reach)), cell(&(centre_m + reach)));
        for x in low[0]..=high[0] {
            let first = self.cells.partition_point(|(cell, _)| *cell < [x, low[1]]);
            for (cell, index) in self.cells.get(first..).unwrap_or_default() {
                if *cell > [x, high[1]] {
                    break;
                }
                if let Some(body) = self.bodies.get(*index as usize) {
                    tell(body);
                }
            }
        }
    }

    /// The first body in the way of a vehicle on a path; `points` begin at the vehicle.
    pub(crate) fn ahead(&self, points: &[PathPoint], room: &Room) -> Option<Ahead> {
        self.queue(points, room).into_iter().next()
    }

    /// All bodies in the way of a vehicle on a path, the first one first.
    pub(crate) fn queue(&self, points: &[PathPoint], room: &Room) -> Vec<Ahead> {
        let mut queue = Vec::new();
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return queue };
        let middle_m = (first.point.point_m + last.point.point_m) / 2.0;
        let radius_m = last.ahead_m / 2.0 + 10.0;
        self.near(&middle_m, radius_m, |body| {
            if body.id != room.id {
                queue.extend(in_the_way(points, room, body));
            }
        });
        queue.sort_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        queue
    }
}

fn cell(point_m: &Vec3) -> [i32; 2] {
    [(point_m.x / CELL_M).floor() as i32, (point_m.y / CELL_M).floor() as i32]
}

/// A body as circles along its length, each held against the path.
fn in_the_way(points: &[PathPoint], room: &Room, body: &Body) -> Option<Ahead> {
    let radius_m = body.half_m.y.min(body.half_m.x);
    let beside_m = if body.is_walker { room.beside_walkers_m } else { room.beside_m };
    let within_m = room.half_width_m + radius_m + beside_m;
    let reach_m = (body.half_m.x - radius_m).max(0.0);
    if !comes_near(points, &body.centre_m, within_m + reach_m + 0.01) {
        return None;
    }
    let count = (reach_m / radius_m.max(0.2)).ceil().min(8.0) as i32;
    let mut nearest: Option<(f32, usize)> = None;
    for circle in -count..=count {
        let offset_m = if count == 0 { 0.0 } else { reach_m * circle as f32 / count as f32 };
        let centre_m = body.centre_m + body.forward * offset_m;
        if let Some((along_m, segment)) = meet(points, &centre_m, within_m)
            && nearest.is_none_or(|(least_m, _)| along_m < least_m)
        {
            nearest = Some((along_m, segment));
        }
    }
    let (along_m, segment) = nearest?;
    let along_mps =
        points.get(segment).map_or(0.0, |at| heading(&at.point).dot(&body.velocity_mps));
    let gap_m = along_m - radius_m - room.front_m;
    Some(Ahead {
        id: body.id,
        gap_m,
        length_m: 2.0 * body.half_m.x,
        along_mps,
        speed_mps: body.velocity_mps.norm(),
        is_walker: body.is_walker,
    })
}

/// A point beside one segment of a path, seen from above.
struct Beside {
    /// Along the segment's direction from its start; the segment's own length.
    along_m: f32,
    length_m: f32,
    /// From the nearest point of the segment.
    away_m: f32,
}

impl Beside {
    fn of([from, to]: &[PathPoint; 2], centre_m: &Vec3) -> Self {
        let way = (to.point.point_m - from.point.point_m).xy();
        let beside = (centre_m - from.point.point_m).xy();
        let length_m = way.norm().max(1.0e-3);
        let along_m = beside.dot(&way) / length_m;
        let away_m = (beside - way * (along_m / length_m).clamp(0.0, 1.0)).norm();
        Self { along_m, length_m, away_m }
    }

    /// Segments of this length on which no point of the path is nearer than the distance left.
    fn segments_beyond(&self, within_m: f32) -> usize {
        (((self.away_m - within_m).max(0.0) / self.length_m) as usize).max(1)
    }
}

fn segment(points: &[PathPoint], index: usize) -> Option<&[PathPoint; 2]> {
    points.get(index..index + 2)?.first_chunk()
}

/// Whether a path comes within a distance of a point, seen from above.
fn comes_near(points: &[PathPoint], centre_m: &Vec3, within_m: f32) -> bool {
    let mut index = 0;
    while let Some(ends) = segment(points, index) {
        let beside = Beside::of(ends, centre_m);
        if beside.away_m < within_m {
            return true;
        }
        index += beside.segments_beyond(within_m);
    }
    false
}

/// Where a path that comes within a distance of a point is nearest to it, the first time that it
/// comes so near, and on which segment.
fn meet(points: &[PathPoint], centre_m: &Vec3, within_m: f32) -> Option<(f32, usize)> {
    let mut index = 0;
    let mut met: Option<(f32, f32, usize)> = None;
    while let Some(ends @ [from, _]) = segment(points, index) {
        let beside = Beside::of(ends, centre_m);
        let same_storey = (centre_m.z - from.point.point_m.z).abs() < STOREY_M;
        let behind = index == 0 && beside.along_m < 0.0;
        let within = beside.away_m < within_m && same_storey && !behind;
        if within && met.is_none_or(|(least_m, _, _)| beside.away_m < least_m) {
            let along_m = beside.along_m.clamp(0.0, beside.length_m);
            met = Some((beside.away_m, from.ahead_m + along_m, index));
            index += 1;
        } else if met.is_some() {
            break;
        } else {
            index += beside.segments_beyond(within_m);
        }
    }
    met.map(|(_, along_m, segment)| (along_m, segment))
}

#[cfg(test)]
mod tests;
