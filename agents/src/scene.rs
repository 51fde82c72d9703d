//! What drivers see of the world around them.

mod extent;
mod queue;
mod strip;

use schemas::{ActorId, TrafficLightColour, Vec3};

use crate::network::floor;
use crate::path::PathPoint;
use extent::Extent;
pub(crate) use queue::Queue;
use strip::Strip;

/// Side of a cell of the scene's grid.
const CELL_M: f32 = 16.0;
/// People get so much more room ahead: they walk around whoever stopped for them.
const MORE_TO_WALKERS_M: f32 = 1.2;

/// A body on the road: a box seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Whose.
    pub id: ActorId,
    /// Whether it is a person on foot.
    pub is_walker: bool,
    /// Whether it is an emergency vehicle under way with blue lights: all others let it through.
    pub is_urgent: bool,
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
    spots: Vec<Spot>,
    /// Columns of cells that have any body, each with where it begins in `spots`.
    columns: Vec<(i32, u32)>,
    lights: Vec<TrafficLightColour>,
    has_walkers: bool,
    /// From the middle of a body to its corners, seen from above, at most.
    around_m_max: f32,
}

/// Where a body is in the grid.
#[derive(Clone, Copy, Debug)]
struct Spot {
    cell: [i32; 2],
    /// Position of the body.
    index: u32,
    /// From its middle to its corners, seen from above.
    around_m: f32,
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

impl Room {
    /// What a vehicle with this box needs, with so much on each side towards vehicles and people.
    pub(crate) fn of(body: &Body, beside_m: f32, beside_walkers_m: f32) -> Self {
        let Body { id, half_m, .. } = *body;
        Self { id, front_m: half_m.x, half_width_m: half_m.y, beside_m, beside_walkers_m }
    }
}

impl Scene {
    /// A scene of these bodies; `lights` by position among the map's traffic lights, none in a
    /// world without lights.
    #[must_use]
    pub fn new(bodies: Vec<Body>, lights: Vec<TrafficLightColour>) -> Self {
        let spot = |(index, body): (u32, &Body)| {
            let around_m = body.half_m.xy().norm();
            Spot { cell: cell(&body.centre_m), index, around_m }
        };
        let mut spots: Vec<Spot> = (0..).zip(&bodies).map(spot).collect();
        spots.sort_unstable_by_key(|spot| (spot.cell, spot.index));
        let mut columns: Vec<(i32, u32)> = Vec::new();
        for (at, Spot { cell: [x, _], .. }) in (0..).zip(&spots) {
            if columns.last().is_none_or(|(last, _)| last != x) {
                columns.push((*x, at));
            }
        }
        let has_walkers = bodies.iter().any(|body| body.is_walker);
        let around_m_max = spots.iter().map(|spot| spot.around_m).fold(0.0, f32::max);
        Self { bodies, spots, columns, lights, has_walkers, around_m_max }
    }

    /// What a light shows; unknown in a world without lights.
    pub(crate) fn light(&self, light: u32) -> TrafficLightColour {
        self.lights.get(light as usize).copied().unwrap_or(TrafficLightColour::Unknown)
    }

    /// Somebody's body, in a scene of bodies in the order of their ids.
    #[must_use]
    pub fn body(&self, id: ActorId) -> Option<&Body> {
        let at = self.bodies.binary_search_by_key(&id, |body| body.id).ok()?;
        self.bodies.get(at)
    }

    /// As [`body`](Self::body), with a guess of how many have lower ids.
    #[must_use]
    pub fn body_about(&self, guess: usize, id: ActorId) -> Option<&Body> {
        self.bodies.get(guess).filter(|body| body.id == id).or_else(|| self.body(id))
    }

    /// Whether anybody is on foot.
    #[must_use]
    pub fn has_walkers(&self) -> bool {
        self.has_walkers
    }

    /// Calls for every body whose middle is within about `radius_m`, in a fixed order.
    pub(crate) fn near(&self, centre_m: &Vec3, radius_m: f32, mut tell: impl FnMut(&Body)) {
        self.within(cells_around(centre_m, radius_m), |body, _| tell(body));
    }

    /// Calls for every body whose middle is in these cells, from the lowest to the highest, with
    /// how far its corners are from there.
    fn within<'s>(&'s self, [low, high]: [[i32; 2]; 2], mut tell: impl FnMut(&'s Body, f32)) {
        let first = self.columns.partition_point(|(x, _)| *x < low[0]);
        let columns = self.columns.get(first..).unwrap_or_default();
        for (at, (_, begins)) in columns.iter().enumerate().take_while(|(_, (x, _))| *x <= high[0])
        {
            let ends = columns.get(at + 1).map_or(self.spots.len(), |(_, next)| *next as usize);
            let column = self.spots.get(*begins as usize..ends).unwrap_or_default();
            let within = column.iter().skip_while(|spot| spot.cell[1] < low[1]);
            for spot in within.take_while(|spot| spot.cell[1] <= high[1]) {
                if let Some(body) = self.bodies.get(spot.index as usize) {
                    tell(body, spot.around_m);
                }
            }
        }
    }

    /// The first body in the way of a vehicle on a path; `points` begin at the vehicle.
    pub(crate) fn ahead(&self, points: &[PathPoint], room: &Room) -> Option<Ahead> {
        self.queue(points, room).first()
    }

    /// All bodies in the way of a vehicle on a path.
    pub(crate) fn queue<'a>(&'a self, points: &'a [PathPoint], room: &'a Room) -> Queue<'a> {
        let mut queue = Queue::default();
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return queue };
        let middle_m = (first.point.point_m + last.point.point_m) / 2.0;
        let radius_m = last.ahead_m / 2.0 + 10.0;
        let extent = Extent::of(points, room);
        let cells = common(cells_around(&middle_m, radius_m), extent.cells(self.around_m_max));
        // Most who are about are not on the way: the strip is made for the first who may be.
        self.within(cells, |body, around_m| {
            if body.id == room.id {
                return;
            }
            if let Some(start) = extent.met_from(body, around_m) {
                queue.add(body, start, || Strip::new(points, room, extent.swing_m));
            }
        });
        queue
    }
}

/// The lowest and the highest cell of a square around a point.
fn cells_around(centre_m: &Vec3, radius_m: f32) -> [[i32; 2]; 2] {
    let reach = Vec3::new(radius_m, radius_m, 0.0);
    [cell(&(centre_m - reach)), cell(&(centre_m + reach))]
}

/// The cells of both rectangles.
fn common(a: [[i32; 2]; 2], b: [[i32; 2]; 2]) -> [[i32; 2]; 2] {
    let [low, high] = [0, 1].map(|end| [0, 1].map(|axis| [a[end][axis], b[end][axis]]));
    [low.map(|[a, b]| a.max(b)), high.map(|[a, b]| a.min(b))]
}

fn cell(point_m: &Vec3) -> [i32; 2] {
    [floor(point_m.x / CELL_M), floor(point_m.y / CELL_M)]
}

#[cfg(test)]
mod tests;
