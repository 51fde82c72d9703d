//! Triangles cut into clusters that a view can skip.

use std::ops;

use crate::vector::{V3, add, cross, dot, norm, scale, sub, unit};

/// Triangles of a cluster: few enough to be skipped often, and their corners to be numbered by a
/// byte.
const CLUSTER_MAX: usize = 64;
/// How many metres of distance a normal's turn counts for when clusters are cut.
const NORMAL_M: f32 = 12.0;
/// The thing of a triangle that belongs to none.
const NO_THING: u32 = u32::MAX;

/// One corner of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// In the model's own frame; metres for what is in the world already.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Metres along and up a facade; unused elsewhere.
    pub facade_m: [f32; 2],
    /// What the triangle belongs to, unless its placement says it.
    pub label: u32,
    /// Number of the material.
    pub material: u8,
    /// Variant of colour.
    pub variant: u8,
}

/// Triangles that are drawn together, in clusters.
///
/// **Determinism:** equal corners and triangles give equal models.
#[derive(Debug, Default)]
pub struct Model {
    corners: Vec<Corner>,
    /// In the order of the clusters, each cluster filled up to a multiple of eight.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Numbers within the cluster of first, second and third corners, for eight triangles each.
    pub(crate) local: Vec<[[u8; 8]; 3]>,
    /// At the places of the triangles.
    things: Vec<u32>,
    pub(crate) clusters: Vec<Cluster>,
    /// The same for views to choose from, eight clusters each.
    pub(crate) blocks: Vec<Block>,
    /// Of the clusters' corners, each cluster filled up to a multiple of eight.
    pub(crate) xyz: [Vec<f32>; 3],
    centre: V3,
    radius: f32,
}

/// One of several ways to draw a thing.
#[derive(Clone, Debug, Default)]
pub struct ThingLevel {
    /// Numbers of the corners.
    pub triangles: Vec<[u32; 3]>,
    /// How far it is off, at most, in the model's own unit.
    pub error_m: f32,
}

/// Where clusters are drawn that are one level of a thing.
#[derive(Clone, Copy, Debug)]
struct Range {
    /// Middle and radius of a ball around the thing.
    ball: [f32; 4],
    /// How far this level is off, and the next coarser one.
    errors_m: [f32; 2],
}

impl Range {
    /// At every distance.
    const ALL: Self = Self { ball: [0.0; 4], errors_m: [0.0, f32::INFINITY] };
}

/// What a view needs to know of a cluster, for those who draw models by other means.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusterFacts {
    /// Middle and radius of a ball around it.
    pub ball: [f32; 4],
    /// Mean normal, and sine of the angle within which all normals are; no angle is 2.
    pub cone: [f32; 4],
    /// Middle and radius of a ball around the thing of which it is a level.
    pub level_ball: [f32; 4],
    /// How far this level is off, and the next coarser one, in the model's unit; infinite for none.
    pub errors_m: [f32; 2],
    /// Of the model's triangles, no more than [`TRIANGLES_MAX`](Self::TRIANGLES_MAX).
    pub triangles: ops::Range<usize>,
}

impl ClusterFacts {
    /// Triangles of a cluster.
    pub const TRIANGLES_MAX: usize = CLUSTER_MAX;
}

/// Some triangles that are near each other and face alike.
#[derive(Clone, Debug)]
pub(crate) struct Cluster {
    /// Of the coordinates.
    pub(crate) corners: ops::Range<usize>,
    /// Of the triangles.
    pub(crate) triangles: ops::Range<usize>,
}

/// Where eight clusters are and where they face; those that are missing are nowhere.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Middles of balls and their radii.
    pub(crate) balls: [[f32; 8]; 4],
    /// Mean normals, and sines of the angles within which all normals are; no angle is 2.
    pub(crate) cones: [[f32; 8]; 4],
    /// Least and largest coordinates.
    pub(crate) boxes: [[[f32; 8]; 3]; 2],
    /// As in [`Range`].
    pub(crate) level_balls: [[f32; 8]; 4],
    pub(crate) errors_m: [[f32; 8]; 2],
    /// Whether any of them is one of two levels.
    pub(crate) has_levels: bool,
}

impl Model {
    /// Cuts triangles, counter-clockwise seen from outside, into clusters. `things` are what the
    /// triangles belong to and can be hidden by, at their places; it may be shorter. Triangles with
    /// a missing corner, without an area or with a place that is no number are left out.
    pub fn new(corners: Vec<Corner>, triangles: &[[u32; 3]], things: &[Option<u32>]) -> Self {
        let mut model = Self { corners, ..Self::default() };
        let thing = |at: usize| things.get(at).copied().flatten();
        let mut parts = model.parts(triangles, thing);
        model.cut(&mut parts, Range::ALL);
        (model.centre, model.radius) = ball(model.corners.iter().map(|corner| corner.position));
        model
    }

    /// Adds a thing of the same corners that is drawn at one of some levels, fine ones first: the
    /// first one is off by nothing, each other one by more than the one before. `thing` is what it
    /// can be hidden by.
    pub fn add(&mut self, levels: &[ThingLevel], thing: Option<u32>) {
        let corners = levels.iter().flat_map(|level| &level.triangles).flatten();
        let places = corners.filter_map(|at| self.corners.get(*at as usize));
        let ([x, y, z], radius) = ball(places.map(|corner| corner.position));
        for (at, level) in levels.iter().enumerate() {
            let next_m = levels.get(at + 1).map_or(f32::INFINITY, |next| next.error_m);
            let range = Range { ball: [x, y, z, radius], errors_m: [level.error_m, next_m] };
            let mut parts = self.parts(&level.triangles, |_| thing);
            self.cut(&mut parts, range);
        }
    }

    /// Triangles that can be drawn, each with the thing that its number says.
    fn parts(&self, triangles: &[[u32; 3]], thing: impl Fn(usize) -> Option<u32>) -> Vec<Part> {
        let mut parts = Vec::with_capacity(triangles.len());
        for (at, triangle) in triangles.iter().enumerate() {
            let Some([a, b, c]) = self.corners_of(triangle) else { continue };
            let normal = cross(sub(b.position, a.position), sub(c.position, a.position));
            let length = norm(normal);
            if length.is_finite() && length > 0.0 {
                let centre = scale(add(add(a.position, b.position), c.position), 1.0 / 3.0);
                let normal = scale(normal, 1.0 / length);
                let thing = thing(at).unwrap_or(NO_THING);
                parts.push(Part { centre, normal, triangle: *triangle, thing });
            }
        }
        parts
    }

    /// How many triangles, with those that fill clusters up.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// All corners.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// The numbers of the corners of every triangle, in the order of the clusters, and what it can
    /// be hidden by. Those that fill clusters up have three times the same corner.
    pub fn triangles(&self) -> impl Iterator<Item = ([u32; 3], Option<u32>)> {
        self.triangles.iter().enumerate().map(|(at, triangle)| (*triangle, self.thing(at)))
    }

    /// All clusters.
    pub fn clusters(&self) -> impl Iterator<Item = ClusterFacts> {
        self.clusters.iter().enumerate().filter_map(|(at, cluster)| {
            let Block { balls, cones, level_balls, errors_m, .. } = self.blocks.get(at / 8)?;
            let lane = at % 8;
            Some(ClusterFacts {
                ball: balls.map(|part| part[lane]),
                cone: cones.map(|part| part[lane]),
                level_ball: level_balls.map(|part| part[lane]),
                errors_m: errors_m.map(|part| part[lane]),
                triangles: cluster.triangles.clone(),
            })
        })
    }

    /// A ball around all of it.
    pub(crate) fn ball(&self) -> (V3, f32) {
        (self.centre, self.radius)
    }

    /// What a triangle belongs to.
    pub(crate) fn thing(&self, triangle: usize) -> Option<u32> {
        self.things.get(triangle).copied().filter(|thing| *thing != NO_THING)
    }

    /// The corners of a triangle.
    pub(crate) fn corners_of(&self, triangle: &[u32; 3]) -> Option<[&Corner; 3]> {
        let [a, b, c] = *triangle;
        let corner = |index: u32| self.corners.get(index as usize);
        Some([corner(a)?, corner(b)?, corner(c)?])
    }

    fn cut(&mut self, parts: &mut [Part], range: Range) {
        if parts.is_empty() {
            return;
        }
        if parts.len() <= CLUSTER_MAX {
            parts.sort_by_key(|part| part.triangle);
            self.push(parts, range);
            return;
        }
        let axis = widest(parts);
        let middle = parts.len() / 2;
        let place = |part: &Part| part.place(axis);
        parts.select_nth_unstable_by(middle, |a, b| {
            place(a).total_cmp(&place(b)).then_with(|| a.triangle.cmp(&b.triangle))
        });
        let (low, high) = parts.split_at_mut(middle);
        self.cut(low, range);
        self.cut(high, range);
    }

    fn push(&mut self, parts: &[Part], range: Range) {
        let (first_corner, first_triangle) = (self.xyz[0].len(), self.triangles.len());
        let mut known: Vec<u32> = Vec::new();
        for part in parts {
            let local = part.triangle.map(|index| self.number(&mut known, index));
            self.push_triangle(part.triangle, local, part.thing);
        }
        while !self.triangles.len().is_multiple_of(8) {
            self.push_triangle([0; 3], [0; 3], NO_THING);
        }
        for axis in &mut self.xyz {
            let last = axis.last().copied().unwrap_or_default();
            axis.resize(axis.len().next_multiple_of(8), last);
        }
        let corners = known.iter().filter_map(|index| self.corners.get(*index as usize));
        let (centre, radius) = ball(corners.map(|corner| corner.position));
        self.push_ball((centre, radius), cone(parts), range);
        self.push_box(first_corner);
        self.clusters.push(Cluster {
            corners: first_corner..self.xyz[0].len(),
            triangles: first_triangle..self.triangles.len(),
        });
    }

    fn push_triangle(&mut self, triangle: [u32; 3], local: [u8; 3], thing: u32) {
        let lane = self.triangles.len() % 8;
        if lane == 0 {
            self.local.push([[0; 8]; 3]);
        }
        if let Some(eight) = self.local.last_mut() {
            eight.iter_mut().zip(local).for_each(|(corners, number)| corners[lane] = number);
        }
        self.triangles.push(triangle);
        self.things.push(thing);
    }

    /// Notes where the next cluster is and where it faces.
    fn push_ball(
        &mut self,
        ([x, y, z], radius): (V3, f32),
        ([ax, ay, az], sine): (V3, f32),
        range: Range,
    ) {
        let lane = self.clusters.len() % 8;
        if lane == 0 {
            let nowhere = [[f32::NAN; 8]; 4];
            self.blocks.push(Block {
                balls: nowhere,
                cones: nowhere,
                boxes: [[[0.0; 8]; 3]; 2],
                level_balls: [[0.0; 8]; 4],
                errors_m: [[0.0; 8], [f32::INFINITY; 8]],
                has_levels: false,
            });
        }
        if let Some(block) = self.blocks.last_mut() {
            let put = |slots: &mut [[f32; 8]; 4], parts: [f32; 4]| {
                slots.iter_mut().zip(parts).for_each(|(slots, part)| slots[lane] = part);
            };
            put(&mut block.balls, [x, y, z, radius]);
            put(&mut block.cones, [ax, ay, az, sine]);
            put(&mut block.level_balls, range.ball);
            block.errors_m[0][lane] = range.errors_m[0];
            block.errors_m[1][lane] = range.errors_m[1];
            block.has_levels |= range.errors_m != Range::ALL.errors_m;
        }
    }

    /// Notes the box around the corners of the next cluster, which are all from this one on.
    fn push_box(&mut self, first_corner: usize) {
        let lane = self.clusters.len() % 8;
        let Some(Block { boxes: [low, high], .. }) = self.blocks.last_mut() else { return };
        for ((low, high), places) in low.iter_mut().zip(high).zip(&self.xyz) {
            let places = places.get(first_corner..).unwrap_or_default();
            low[lane] = places.iter().copied().fold(f32::INFINITY, f32::min);
            high[lane] = places.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        }
    }

    /// The number of a corner within its cluster. Corners at one place share it.
    fn number(&mut self, known: &mut Vec<u32>, index: u32) -> u8 {
        let Self { corners, xyz, .. } = self;
        let place = |index: u32| corners.get(index as usize).map(|corner| corner.position);
        let position = place(index);
        if let Some(at) = known.iter().position(|other| place(*other) == position) {
            return at as u8;
        }
        for (axis, part) in xyz.iter_mut().zip(position.unwrap_or_default()) {
            axis.push(part);
        }
        known.push(index);
        (known.len() - 1) as u8
    }
}

/// A triangle that is not in its cluster yet.
struct Part {
    centre: V3,
    normal: V3,
    triangle: [u32; 3],
    thing: u32,
}

impl Part {
    /// One of six coordinates: place, then normal.
    fn place(&self, axis: usize) -> f32 {
        let normal = scale(self.normal, NORMAL_M);
        self.centre.into_iter().chain(normal).nth(axis).unwrap_or_default()
    }
}

fn widest(parts: &[Part]) -> usize {
    let width = |axis: usize| {
        let places = parts.iter().map(|part| part.place(axis));
        let (low, high) = places.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        high - low
    };
    (0..6).max_by(|a, b| width(*a).total_cmp(&width(*b))).unwrap_or_default()
}

fn cone(parts: &[Part]) -> (V3, f32) {
    let axis = unit(parts.iter().fold([0.0; 3], |sum, part| add(sum, part.normal)));
    let least = parts.iter().map(|part| dot(part.normal, axis)).fold(1.0, f32::min);
    let sine = if least > 0.05 { (1.0 - least * least).max(0.0).sqrt() + 1e-3 } else { 2.0 };
    (axis, sine)
}

/// A ball around points: the middle of their box, and what reaches them all.
fn ball(points: impl Iterator<Item = V3> + Clone) -> (V3, f32) {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for point in points.clone().filter(|point| point.iter().all(|part| part.is_finite())) {
        for ((low, high), part) in low.iter_mut().zip(&mut high).zip(point) {
            (*low, *high) = (low.min(part), high.max(part));
        }
    }
    if low > high {
        return ([0.0; 3], 0.0);
    }
    let centre = scale(add(low, high), 0.5);
    let reach = points.map(|point| norm(sub(point, centre))).filter(|reach| reach.is_finite());
    (centre, reach.fold(0.0, f32::max) * 1.000_01)
}

#[cfg(test)]
mod tests;
