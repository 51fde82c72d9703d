//! Projection: the nearest lane to a point, by chords in a tree of boxes.

use nalgebra::Point3;

use crate::geometry::{Shape, unit};
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
    bounds: Bounds,
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
                    shapes.pose_with_direction(entry, index, s).unwrap_or_else(|| {
                        let pose = lane_pose(road, section, lane.id, s);
                        (pose, unit(pose.heading_rad))
                    })
                };
                push_chords(&mut chords, index, (road, section, lane), pose);
            }
        }
        // A place that is no number has no nearest lane; the map check reports such lanes.
        chords.retain(|chord| (chord.from.coords + chord.to.coords).iter().all(|v| v.is_finite()));
        let mut index = Self {
            chords: Vec::with_capacity(chords.len()),
            nodes: Vec::with_capacity(chords.len()),
        };
        if !chords.is_empty() {
            index.build(&mut middles(&chords), &chords);
        }
        index.nodes.shrink_to_fit();
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
            if node.bounds.type_bits & mask == 0 || best.is_some_and(|(d2, ..)| box_distance2 >= d2)
            {
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
        self.nodes
            .first()
            .map(|node| (Point3::from(node.bounds.min), Point3::from(node.bounds.max)))
    }

    fn distance2(&self, node: usize, point: &Point3<f64>) -> f64 {
        self.nodes.get(node).map_or(f64::INFINITY, |node| {
            (0..3)
                .map(|axis| {
                    let p = point[axis];
                    let Bounds { min, max, .. } = &node.bounds;
                    let outside = (min[axis] - p).max(p - max[axis]).max(0.0);
                    outside * outside
                })
                .sum()
        })
    }

    /// Appends the subtree over some chords, depth first, and the chords of its leaves in their
    /// order. Returns its box.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the limit on the steps along lanes keeps the number of chords below 32 bits"
    )]
    fn build(&mut self, middles: &mut [Middle], all: &[Chord]) -> Bounds {
        let node_index = self.nodes.len();
        if middles.len() <= LEAF_CHORDS {
            let first = self.chords.len();
            let own = middles.iter().filter_map(|middle| all.get(middle.chord as usize));
            self.chords.extend(own);
            let bounds = Bounds::of_chords(self.chords.get(first..).unwrap_or_default());
            self.nodes.push(TreeNode { bounds, first: first as u32, count: middles.len() as u32 });
            return bounds;
        }
        self.nodes.push(TreeNode { bounds: Bounds::NONE, first: 0, count: 0 });
        let axis = widest_axis(middles);
        let half = middles.len() / 2;
        middles.select_nth_unstable_by(half, |a, b| a.place[axis].total_cmp(&b.place[axis]));
        let (left, right) = middles.split_at_mut(half);
        let left = self.build(left, all);
        let first = self.nodes.len() as u32;
        let bounds = left.with(&self.build(right, all));
        if let Some(node) = self.nodes.get_mut(node_index) {
            *node = TreeNode { bounds, first, count: 0 };
        }
        bounds
    }
}

/// What chords are sorted by: small, as sorting moves it often.
#[derive(Clone, Copy, Debug)]
struct Middle {
    place: [f32; 3],
    chord: u32,
}

#[allow(clippy::cast_possible_truncation, reason = "the tree need not be cut at exact middles")]
fn middles(chords: &[Chord]) -> Vec<Middle> {
    let place = |chord: &Chord| [0, 1, 2].map(|axis| (chord.from[axis] + chord.to[axis]) as f32);
    (0..).zip(chords).map(|(index, chord)| Middle { place: place(chord), chord: index }).collect()
}

fn widest_axis(middles: &[Middle]) -> usize {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for Middle { place, .. } in middles {
        for axis in 0..3 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    let span = |axis: &usize| high[*axis] - low[*axis];
    (0..3).max_by(|a, b| span(a).total_cmp(&span(b))).unwrap_or(0)
}

/// A box, and the types of the lanes in it.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: [f64; 3],
    max: [f64; 3],
    type_bits: u32,
}

impl Bounds {
    const NONE: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3], type_bits: 0 };

    fn of_chords(chords: &[Chord]) -> Self {
        chords.iter().fold(Self::NONE, |bounds, chord| {
            let of = |point: &Point3<f64>| {
                let place = [point.x, point.y, point.z];
                Self { min: place, max: place, type_bits: chord.type_bits }
            };
            bounds.with(&of(&chord.from)).with(&of(&chord.to))
        })
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            min: [0, 1, 2].map(|axis| self.min[axis].min(other.min[axis])),
            max: [0, 1, 2].map(|axis| self.max[axis].max(other.max[axis])),
            type_bits: self.type_bits | other.type_bits,
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

/// Whether one chord stands for the whole section: straight reference line, grades without bend.
fn is_straight(road: &Road, section: &Section) -> bool {
    let first = road.geometry_index(section.start_s);
    road.geometries.get(first).is_some_and(|geometry| {
        geometry.shape == Shape::Line && geometry.start_s + geometry.length_m >= section.end_s
    }) && road.elevation.is_linear()
}

/// Cuts one lane into chords, in travel direction.
fn push_chords(
    chords: &mut Vec<Chord>,
    index: LaneIndex,
    (road, section, lane): (&Road, &Section, &Lane),
    pose_at: impl Fn(f64) -> (LanePose, [f64; 2]),
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
        push(start_m, pose(start_m).0.point, end_m, pose(end_m).0.point);
        return;
    }
    let mut from_m = start_m;
    let (mut from, heading) = pose(from_m);
    let mut from_direction = direction(&from, heading);
    let mut at_m = from_m;
    while at_m + STEP_M < end_m {
        at_m += STEP_M;
        let (here, heading) = pose(at_m);
        let here_direction = direction(&here, heading);
        let cos = from_direction.dot(&here_direction);
        if cos < TURN_MAX_RAD.cos() || at_m - from_m > CHORD_LENGTH_MAX_M {
            push(from_m, from.point, at_m, here.point);
            (from_m, from, from_direction) = (at_m, here, here_direction);
        }
    }
    push(from_m, from.point, end_m, pose(end_m).0.point);
}

/// The direction of travel in space, from sine and cosine of the heading.
fn direction(pose: &LanePose, [sin, cos]: [f64; 2]) -> nalgebra::Vector3<f64> {
    let level = pose.pitch_rad == 0.0;
    let (sin_pitch, cos_pitch) = if level { (0.0, 1.0) } else { pose.pitch_rad.sin_cos() };
    nalgebra::Vector3::new(cos * cos_pitch, sin * cos_pitch, sin_pitch)
}
