//! Projection: the nearest lane to a point, by chords in a tree of boxes.

use nalgebra::Point3;

use crate::chords::{Chord, chords};
use crate::kinds::LaneTypes;
use crate::lanes::{LaneIndex, LaneTable};
use crate::model::Model;
use crate::shapes::Shapes;

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

const LEAF_CHORDS: usize = 8;
/// Nodes that wait in a search of a town's tree, at most.
const DEPTH: usize = 32;

impl ProjectionIndex {
    pub(crate) fn new(model: &Model, table: &LaneTable, shapes: &Shapes) -> Self {
        let mut chords = chords(model, table, shapes);
        // A place that is no number has no nearest lane; the map check reports such lanes.
        chords.retain(|chord| (chord.from.coords + chord.to.coords).iter().all(|v| v.is_finite()));
        let mut order = middles(&chords);
        let mut nodes = Vec::with_capacity(chords.len() / 2);
        if !chords.is_empty() {
            build(&mut nodes, 0, &mut order, &chords);
        }
        nodes.shrink_to_fit();
        reorder(&mut chords, order);
        Self { chords, nodes }
    }

    /// The lane nearest to `point` among these types, and the road coordinate there.
    pub(crate) fn nearest(
        &self,
        point: &Point3<f64>,
        types: LaneTypes,
    ) -> Option<(LaneIndex, f64)> {
        self.nearest_within(point, types, f64::INFINITY).map(|(lane, s, _)| (lane, s))
    }

    /// As [`nearest`](Self::nearest), with the squared distance; `None` if it is not below a limit.
    pub(crate) fn nearest_within(
        &self,
        point: &Point3<f64>,
        types: LaneTypes,
        within2: f64,
    ) -> Option<(LaneIndex, f64, f64)> {
        let mask = types.bits();
        let mut best: Option<(f64, &Chord)> = None;
        let mut stack: Vec<(usize, f64)> = Vec::with_capacity(DEPTH);
        stack.push((0, 0.0));
        while let Some((node_index, box_distance2)) = stack.pop() {
            let Some(node) = self.nodes.get(node_index) else { continue };
            let limit2 = best.map_or(within2, |(d2, _)| d2);
            let is_near = |distance2: f64| limit2 == f64::INFINITY || distance2 < limit2;
            if node.bounds.type_bits & mask == 0 || !is_near(box_distance2) {
                continue;
            }
            if node.count == 0 {
                let (first, second) = (node_index + 1, node.first as usize);
                let first = (first, self.distance2(first, point));
                let second = (second, self.distance2(second, point));
                // The nearer one is taken first.
                let (later, sooner) =
                    if first.1 < second.1 { (second, first) } else { (first, second) };
                if is_near(later.1) {
                    stack.push(later);
                }
                if is_near(sooner.1) {
                    stack.push(sooner);
                }
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for chord in self.chords.get(range).into_iter().flatten() {
                if chord.type_bits & mask == 0 {
                    continue;
                }
                let distance2 = chord.distance2(point);
                let is_nearer = match best {
                    Some((d2, _)) => distance2 < d2,
                    None => within2 == f64::INFINITY || distance2 < within2,
                };
                if is_nearer {
                    best = Some((distance2, chord));
                }
            }
        }
        let (distance2, chord) = best?;
        Some((chord.lane, chord.s_after(chord.along_m(point)), distance2))
    }

    /// Tells of every chord of these types that is at most so far from `point`.
    pub(crate) fn each_within(
        &self,
        point: &Point3<f64>,
        types: LaneTypes,
        within_m: f64,
        mut tell: impl FnMut(&Chord),
    ) {
        let (mask, within2) = (types.bits(), within_m * within_m);
        let mut stack = vec![0];
        while let Some(node_index) = stack.pop() {
            let Some(node) = self.nodes.get(node_index) else { continue };
            if node.bounds.type_bits & mask == 0 || self.distance2(node_index, point) > within2 {
                continue;
            }
            if node.count == 0 {
                stack.extend([node_index + 1, node.first as usize]);
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            let chords = self.chords.get(range).into_iter().flatten();
            let near =
                |chord: &&Chord| chord.type_bits & mask != 0 && chord.distance2(point) <= within2;
            chords.filter(near).for_each(&mut tell);
        }
    }

    /// The box around all chords.
    pub(crate) fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        self.nodes
            .first()
            .map(|node| (Point3::from(node.bounds.min), Point3::from(node.bounds.max)))
    }

    fn distance2(&self, node: usize, point: &Point3<f64>) -> f64 {
        let Some(TreeNode { bounds: Bounds { min, max, .. }, .. }) = self.nodes.get(node) else {
            return f64::INFINITY;
        };
        let outside2 = |axis: usize| {
            let (before, beyond) = (min[axis] - point[axis], point[axis] - max[axis]);
            // `f64::max` also asks which of both is no number.
            let outside = if before > beyond { before } else { beyond };
            if outside > 0.0 { outside * outside } else { 0.0 }
        };
        outside2(0) + outside2(1) + outside2(2)
    }
}

/// Appends the subtree over some chords, depth first, and brings them into the order of its leaves.
/// `first` is the position of the first of them in that order. Returns their box.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the limit on the steps along lanes keeps the number of chords below 32 bits"
)]
fn build(nodes: &mut Vec<TreeNode>, first: u32, own: &mut [Middle], all: &[Chord]) -> Bounds {
    let node_index = nodes.len();
    if own.len() <= LEAF_CHORDS {
        let chords = own.iter().filter_map(|middle| all.get(middle.chord as usize));
        let bounds = Bounds::of_chords(chords);
        nodes.push(TreeNode { bounds, first, count: own.len() as u32 });
        return bounds;
    }
    nodes.push(TreeNode { bounds: Bounds::NONE, first: 0, count: 0 });
    let axis = widest_axis(own);
    let half = own.len() / 2;
    own.select_nth_unstable_by(half, |a, b| a.place[axis].total_cmp(&b.place[axis]));
    let (left, right) = own.split_at_mut(half);
    let left = build(nodes, first, left, all);
    let second_child = nodes.len() as u32;
    let bounds = left.with(&build(nodes, first + half as u32, right, all));
    if let Some(node) = nodes.get_mut(node_index) {
        *node = TreeNode { bounds, first: second_child, count: 0 };
    }
    bounds
}

/// Brings chords into an order, in their place: a second list would be the largest of a map.
fn reorder(chords: &mut [Chord], mut order: Vec<Middle>) {
    for start in 0..order.len() {
        let mut to = start;
        loop {
            let from = std::mem::replace(&mut order[to].chord, to as u32) as usize;
            if from == start || from == to {
                break;
            }
            chords.swap(to, from);
            to = from;
        }
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

    fn of_chords<'c>(chords: impl Iterator<Item = &'c Chord>) -> Self {
        chords.fold(Self::NONE, |bounds, chord| {
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
