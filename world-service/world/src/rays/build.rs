//! Building the tree: binned surface area heuristic.
//!
//! **Source:** Wald, "On fast construction of SAH-based bounding volume hierarchies", IEEE
//! Symposium on Interactive Ray Tracing 2007.

use schemas::Vec3;

use super::bounds::Bounds;
use super::bvh::{Bvh, LEAF, Node};

/// Places where a box may be cut, plus one, along each axis.
const BINS: usize = 16;
/// Levels after which halves are equal by number, so that the tree cannot become a list.
const DEPTH_MAX: usize = 24;

pub(super) fn build(
    items: &[Bounds],
    leaf_items: usize,
    make_leaf: impl FnMut(&[u32]) -> u32,
) -> Bvh {
    let mut order: Vec<u32> = (0..items.len() as u32).collect();
    let mut builder = Builder { items, leaf_items, make_leaf, nodes: Vec::new() };
    let root = (!items.is_empty()).then(|| builder.child(&mut order, 0));
    Bvh { nodes: builder.nodes, root }
}

struct Builder<'a, MakeLeaf> {
    items: &'a [Bounds],
    leaf_items: usize,
    make_leaf: MakeLeaf,
    nodes: Vec<Node>,
}

impl<MakeLeaf: FnMut(&[u32]) -> u32> Builder<'_, MakeLeaf> {
    fn child(&mut self, order: &mut [u32], depth: usize) -> u32 {
        if order.len() <= self.leaf_items {
            return LEAF | (self.make_leaf)(order);
        }
        let at = self.nodes.len();
        self.nodes.push(Node::new());
        let mut node = Node::new();
        // Two levels of halves are the four children of one node.
        let (left, right) = self.halve(order, depth);
        let (first, second) = self.halve(left, depth);
        let (third, fourth) = self.halve(right, depth);
        let parts = [first, second, third, fourth].into_iter().filter(|part| !part.is_empty());
        for (lane, part) in parts.enumerate() {
            let bounds = self.bounds(part);
            node.set(lane, &bounds, self.child(part, depth + 1));
        }
        self.nodes[at] = node;
        at as u32
    }

    /// Two parts; the second is empty where there is no use in cutting.
    fn halve<'o>(&self, order: &'o mut [u32], depth: usize) -> (&'o mut [u32], &'o mut [u32]) {
        if order.len() <= self.leaf_items {
            return order.split_at_mut(order.len());
        }
        let middle = order.len() / 2;
        let cut = if depth < DEPTH_MAX { self.cheapest_cut(order) } else { None };
        let Some(cut) = cut else { return order.split_at_mut(middle) };
        // Stable, so that the tree is the same with every version of the sorting.
        order.sort_by_key(|&item| cut.bin(self.items[item as usize].centre_m()) >= cut.before);
        let count = order
            .partition_point(|&item| cut.bin(self.items[item as usize].centre_m()) < cut.before);
        order.split_at_mut(count)
    }

    fn bounds(&self, order: &[u32]) -> Bounds {
        order.iter().fold(Bounds::empty(), |bounds, &item| bounds.union(&self.items[item as usize]))
    }

    /// `None` when all centres are in one place.
    fn cheapest_cut(&self, order: &[u32]) -> Option<Cut> {
        let centres = order.iter().map(|&item| self.items[item as usize].centre_m());
        let bounds = Bounds::around(centres);
        let cuts = (0..3).filter_map(|axis| self.cheapest_on(axis, &bounds, order));
        cuts.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    fn cheapest_on(&self, axis: usize, centres: &Bounds, order: &[u32]) -> Option<Cut> {
        let low_m = centres.low_m[axis];
        let size_m = centres.high_m[axis] - low_m;
        let scale = BINS as f32 / size_m;
        if !(size_m > 0.0 && scale.is_finite()) {
            return None;
        }
        let mut cut = Cut { axis, low_m, scale, before: 0, cost: f32::INFINITY };
        let mut bins = [(Bounds::empty(), 0u32); BINS];
        for &item in order {
            let bounds = &self.items[item as usize];
            let (sum, count) = &mut bins[cut.bin(bounds.centre_m())];
            *sum = sum.union(bounds);
            *count += 1;
        }
        for before in 1..BINS {
            let cost = cost(&bins[..before]) + cost(&bins[before..]);
            if cost < cut.cost {
                cut = Cut { before, cost, ..cut };
            }
        }
        // The lowest and the highest centre are in the first and the last bin: no half is empty.
        Some(cut).filter(|cut| cut.before > 0)
    }
}

/// A plane between two bins.
#[derive(Clone, Copy)]
struct Cut {
    axis: usize,
    low_m: f32,
    /// Bins per metre.
    scale: f32,
    /// Bins below this are on the low side.
    before: usize,
    cost: f32,
}

impl Cut {
    fn bin(&self, centre_m: Vec3) -> usize {
        (((centre_m[self.axis] - self.low_m) * self.scale) as usize).min(BINS - 1)
    }
}

/// What rays through these bins cost: their items times the surface around them.
fn cost(bins: &[(Bounds, u32)]) -> f32 {
    let (bounds, count) = bins
        .iter()
        .fold((Bounds::empty(), 0), |(sum, count), (bounds, n)| (sum.union(bounds), count + n));
    bounds.half_area_m2() * count as f32
}
