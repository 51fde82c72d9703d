//! Projection: the nearest lane to a point, by chords in a tree of boxes.

use nalgebra::Point3;

use crate::geometry::Shape;
use crate::kinds::LaneTypes;
use crate::lanes::{LaneIndex, LanePose, LaneTable, lane_pose, parts};
use crate::model::{Lane, Model, Road, Section};
use crate::shapes::Shapes;

/// A straight piece of a lane's middle line.
#[derive(Clone, Copy, Debug)]
struct Chord {
    from: Point3<f64>,
    to: Point3<f64>,
    from_s: f64,
    to_s: f64,
    lane: LaneIndex,
    type_bits: u32,
}

/// Box around chords; a leaf names chords, another node its second child (the first follows it).
#[derive(Clone, Copy, Debug)]
struct TreeNode {
    min: [f64; 3],
    max: [f64; 3],
    type_bits: u32,
    first: u32,
    /// 0 for inner nodes.
    count: u32,
}

/// Finds the nearest chord in logarithmic time.
#[derive(Debug, Default)]
pub(crate) struct ProjectionIndex {
    chords: Vec<Chord>,
    nodes: Vec<TreeNode>,
}

const LEAF_CHORDS: usize = 4;

impl ProjectionIndex {
    pub(crate) fn new(model: &Model, table: &LaneTable, shapes: &Shapes) -> Self {
        let mut chords = Vec::new();
        for (index, entry) in (0..).zip(&table.lanes) {
            if entry.lane_id == 0 || entry.length_m() <= 0.0 {
                continue;
            }
            if let Some((road, section, lane)) = parts(model, entry) {
                let pose = |s: f64| {
                    let known = shapes.pose(entry, index, s);
                    known.unwrap_or_else(|| lane_pose(road, section, lane.id, s))
                };
                push_chords(&mut chords, index, (road, section, lane), pose);
            }
        }
        // A place that is no number has no nearest lane; the map check reports such lanes.
        chords.retain(|chord| (chord.from.coords + chord.to.coords).iter().all(|v| v.is_finite()));
        let mut index = Self { nodes: Vec::with_capacity(chords.len()), chords };
        if !index.chords.is_empty() {
            let all = index.chords.len();
            index.build(0, all);
        }
        index
    }

    /// The lane nearest to `point` among these types, and the road coordinate there.
    pub(crate) fn nearest(
        &self,
        point: &Point3<f64>,
        types: LaneTypes,
    ) -> Option<(LaneIndex, f64)> {
        let mask = types.bits();
        let mut best: Option<(f64, &Chord)> = None;
        let mut stack: Vec<(usize, f64)> = vec![(0, 0.0)];
        while let Some((node_index, box_distance2)) = stack.pop() {
            let Some(node) = self.nodes.get(node_index) else { continue };
            if node.type_bits & mask == 0 || best.is_some_and(|(d2, ..)| box_distance2 >= d2) {
                continue;
            }
            if node.count == 0 {
                let children = [node_index + 1, node.first as usize];
                let mut near = children.map(|child| (child, self.distance2(child, point)));
                near.sort_by(|a, b| b.1.total_cmp(&a.1));
                stack.extend(near);
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for chord in self.chords.get(range).into_iter().flatten() {
                if chord.type_bits & mask == 0 {
                    continue;
                }
                let distance2 = chord.distance2(point);
                if best.is_none_or(|(d2, _)| distance2 < d2) {
                    best = Some((distance2, chord));
                }
            }
        }
        let (_, chord) = best?;
        Some((chord.lane, chord.s_after(chord.along_m(point))))
    }

    /// The box around all chords.
    pub(crate) fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        self.nodes.first().map(|node| (Point3::from(node.min), Point3::from(node.max)))
    }

    fn distance2(&self, node: usize, point: &Point3<f64>) -> f64 {
        self.nodes.get(node).map_or(f64::INFINITY, |node| {
            (0..3)
                .map(|axis| {
                    let p = point[axis];
                    let outside = (node.min[axis] - p).max(p - node.max[axis]).max(0.0);
                    outside * outside
                })
                .sum()
        })
    }

    /// Appends the subtree over `chords[from..to]`, depth first.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the limit on the sum of lane lengths keeps the number of chords below 32 bits"
    )]
    fn build(&mut self, from: usize, to: usize) {
        let node_index = self.nodes.len();
        let Some(chords) = self.chords.get_mut(from..to) else { return };
        let (min, max, type_bits) = bounds(chords);
        let count = chords.len();
        self.nodes.push(TreeNode { min, max, type_bits, first: from as u32, count: count as u32 });
        if count <= LEAF_CHORDS {
            return;
        }
        let axis =
            (0..3).max_by(|a, b| (max[*a] - min[*a]).total_cmp(&(max[*b] - min[*b]))).unwrap_or(0);
        let middle = count / 2;
        chords.select_nth_unstable_by(middle, |a, b| {
            (a.from[axis] + a.to[axis]).total_cmp(&(b.from[axis] + b.to[axis]))
        });
        self.build(from, from + middle);
        let second = self.nodes.len() as u32;
        self.build(from + middle, to);
        if let Some(node) = self.nodes.get_mut(node_index) {
            node.first = second;
            node.count = 0;
        }
    }
}

impl Chord {
    /// Squared distance of `point`.
    fn distance2(&self, point: &Point3<f64>) -> f64 {
        let along = self.to - self.from;
        let length2 = along.norm_squared();
        let rate = if length2 > 0.0 {
            ((point - self.from).dot(&along) / length2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (point - (self.from + along * rate)).norm_squared()
    }

    /// How far along the chord the foot of `point` lies, both seen from above: the client looks
    /// for the nearest chord in space, and for the place on it in the plane.
    fn along_m(&self, point: &Point3<f64>) -> f64 {
        let along = (self.to - self.from).xy();
        let length2 = along.norm_squared();
        if length2 > 0.0 {
            ((point - self.from).xy().dot(&along) / length2).clamp(0.0, 1.0) * length2.sqrt()
        } else {
            0.0
        }
    }

    /// The road coordinate `along_m` after the chord's start in travel direction.
    fn s_after(&self, along_m: f64) -> f64 {
        let (low, high) = (self.from_s.min(self.to_s), self.from_s.max(self.to_s));
        let s =
            if self.to_s >= self.from_s { self.from_s + along_m } else { self.from_s - along_m };
        s.clamp(low, high)
    }
}

fn bounds(chords: &[Chord]) -> ([f64; 3], [f64; 3], u32) {
    let mut min = [f64::INFINITY; 3];
    let mut max = [f64::NEG_INFINITY; 3];
    let mut type_bits = 0;
    for chord in chords {
        for axis in 0..3 {
            min[axis] = min[axis].min(chord.from[axis]).min(chord.to[axis]);
            max[axis] = max[axis].max(chord.from[axis]).max(chord.to[axis]);
        }
        type_bits |= chord.type_bits;
    }
    (min, max, type_bits)
}

/// Whether one chord stands for the whole section: straight reference line, grades without bend.
fn is_straight(road: &Road, section: &Section) -> bool {
    let first = road.geometries.partition_point(|g| g.start_s <= section.start_s).saturating_sub(1);
    road.geometries.get(first).is_some_and(|geometry| {
        geometry.shape == Shape::Line && geometry.start_s + geometry.length_m >= section.end_s
    }) && road.elevation.is_linear()
}

/// Cuts one lane into chords, in travel direction.
fn push_chords(
    chords: &mut Vec<Chord>,
    index: LaneIndex,
    (road, section, lane): (&Road, &Section, &Lane),
    pose_at: impl Fn(f64) -> LanePose,
) {
    /// Places at the very end of a lane belong to the next one.
    const END_GAP_M: f64 = 1e-6;
    const STEP_M: f64 = 1.0;
    const CHORD_LENGTH_MAX_M: f64 = 100.0;
    const TURN_MAX_RAD: f64 = 1.8 * std::f64::consts::PI / 180.0;

    let length_m = section.end_s - section.start_s;
    let end_m = (length_m - END_GAP_M).max(0.0);
    let forward = road.runs_forward(lane.id);
    let s_at = |m: f64| if forward { section.start_s + m } else { section.end_s - m };
    let pose = |m: f64| pose_at(s_at(m));
    let mut push = |from_m: f64, from: Point3<f64>, to_m: f64, to: Point3<f64>| {
        let type_bits = lane.lane_type as u32;
        let (from_s, to_s) = (s_at(from_m), s_at(to_m));
        chords.push(Chord { from, to, from_s, to_s, lane: index, type_bits });
    };
    let start_m = END_GAP_M.min(length_m / 2.0);
    if is_straight(road, section) {
        push(start_m, pose(start_m).point, end_m, pose(end_m).point);
        return;
    }
    let mut from_m = start_m;
    let mut from = pose(from_m);
    let mut from_direction = direction(&from);
    let mut at_m = from_m;
    while at_m + STEP_M < end_m {
        at_m += STEP_M;
        let here = pose(at_m);
        let here_direction = direction(&here);
        let cos = from_direction.dot(&here_direction);
        if cos < TURN_MAX_RAD.cos() || at_m - from_m > CHORD_LENGTH_MAX_M {
            push(from_m, from.point, at_m, here.point);
            (from_m, from, from_direction) = (at_m, here, here_direction);
        }
    }
    push(from_m, from.point, end_m, pose(end_m).point);
}

fn direction(pose: &LanePose) -> nalgebra::Vector3<f64> {
    let (sin, cos) = pose.heading_rad.sin_cos();
    let level = pose.pitch_rad == 0.0;
    let (sin_pitch, cos_pitch) = if level { (0.0, 1.0) } else { pose.pitch_rad.sin_cos() };
    nalgebra::Vector3::new(cos * cos_pitch, sin * cos_pitch, sin_pitch)
}
