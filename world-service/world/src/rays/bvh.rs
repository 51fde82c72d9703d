//! A tree of boxes that a ray compares four at a time.
//!
//! Own and not parry's: built for enhanced determinism, parry computes boxes one number at a time,
//! while the loops over four lanes here become vector instructions that give the same bits
//! everywhere (only additions, products and comparisons).

use super::bounds::Bounds;
use super::build;
use super::ray::Ray;

/// Children of a node: numbers in the narrowest common vector register.
pub(super) const WIDTH: usize = 4;
/// Marks a leaf in a reference to a child.
pub(super) const LEAF: u32 = 1 << 31;
/// Boxes are this much larger than what is inside, so that rounding loses no hit.
const MARGIN_M: f32 = 1.0e-3;

/// Four boxes side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// By axis, low then high, by child.
    planes_m: [[[f32; WIDTH]; 2]; 3],
    /// Another node, or [`LEAF`] and the number of a leaf.
    children: [u32; WIDTH],
}

/// The tree. What is in a leaf is known to whoever built it.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    pub(super) nodes: Vec<Node>,
    pub(super) root: Option<u32>,
}

/// Nodes still to be visited and the distance to each; kept between rays to save allocations.
/// Empty after a walk.
pub(crate) type Stack = Vec<(f32, u32)>;

impl Bvh {
    /// Boxes of at most `leaf_items` items become leaves, which `make_leaf` numbers.
    pub(crate) fn new(
        items: &[Bounds],
        leaf_items: usize,
        make_leaf: impl FnMut(&[u32]) -> u32,
    ) -> Self {
        build::build(items, leaf_items, make_leaf)
    }

    /// Visits the leaves a ray may meet within `reach_m`, roughly from near to far. `visit` takes
    /// the leaf, the reach, and the stack for a walk within this one, and returns the reach from
    /// then on.
    // Within its callers it takes a fifth more: there are too few registers for both.
    #[inline(never)]
    pub(crate) fn walk(
        &self,
        ray: &Ray,
        reach_m: f32,
        stack: &mut Stack,
        mut visit: impl FnMut(u32, f32, &mut Stack) -> f32,
    ) {
        let Some(root) = self.root else { return };
        let mut reach_m = reach_m;
        let base = stack.len();
        stack.push((0.0, root));
        while stack.len() > base {
            let Some((entry_m, child)) = stack.pop() else { return };
            if entry_m > reach_m {
                continue;
            }
            if child & LEAF != 0 {
                reach_m = visit(child & !LEAF, reach_m, stack);
                continue;
            }
            let node = &self.nodes[child as usize];
            let (near_m, far_m) = node.cross(ray, reach_m);
            let first = stack.len();
            for lane in 0..WIDTH {
                if near_m[lane] <= far_m[lane] {
                    push_sorted(stack, first, (near_m[lane], node.children[lane]));
                }
            }
        }
    }

    /// Visits the leaves whose boxes overlap `bounds`.
    pub(crate) fn overlapping(&self, bounds: &Bounds, mut visit: impl FnMut(u32)) {
        let mut stack: Vec<u32> = self.root.into_iter().collect();
        while let Some(child) = stack.pop() {
            if child & LEAF != 0 {
                visit(child & !LEAF);
                continue;
            }
            let node = &self.nodes[child as usize];
            let lanes = (0..WIDTH).filter(|&lane| node.bounds(lane).overlaps(bounds));
            stack.extend(lanes.map(|lane| node.children[lane]));
        }
    }
}

/// Keeps what was pushed since `first` ordered with the nearest last.
fn push_sorted(stack: &mut Stack, first: usize, entry: (f32, u32)) {
    stack.push(entry);
    let mut at = stack.len() - 1;
    while at > first && stack[at - 1].0 < stack[at].0 {
        stack.swap(at - 1, at);
        at -= 1;
    }
}

impl Node {
    /// A node without children, which no ray meets.
    pub(super) fn new() -> Self {
        let plane_m = [[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]];
        Self { planes_m: [plane_m; 3], children: [LEAF; WIDTH] }
    }

    pub(super) fn set(&mut self, lane: usize, bounds: &Bounds, child: u32) {
        let bounds = bounds.grown(MARGIN_M);
        for axis in 0..3 {
            self.planes_m[axis][0][lane] = bounds.low_m[axis];
            self.planes_m[axis][1][lane] = bounds.high_m[axis];
        }
        self.children[lane] = child;
    }

    fn bounds(&self, lane: usize) -> Bounds {
        let corner = |side: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| self.planes_m[axis][side][lane]);
            schemas::Vec3::new(x, y, z)
        };
        Bounds { low_m: corner(0), high_m: corner(1) }
    }

    /// Where the ray enters and leaves each child; it misses those it would leave first.
    // Within its callers a scan takes a fifth more.
    #[inline(never)]
    fn cross(&self, ray: &Ray, reach_m: f32) -> ([f32; WIDTH], [f32; WIDTH]) {
        let mut near_m = [0.0; WIDTH];
        let mut far_m = [reach_m; WIDTH];
        for axis in 0..3 {
            let (origin_m, inverse) = (ray.origin_m[axis], ray.inverse[axis]);
            let [low_m, high_m] = &self.planes_m[axis];
            let (entry, exit) = if inverse >= 0.0 { (low_m, high_m) } else { (high_m, low_m) };
            for lane in 0..WIDTH {
                let enters_m = (entry[lane] - origin_m) * inverse;
                let leaves_m = (exit[lane] - origin_m) * inverse;
                // Not `f32::max`: without its rule for NaN this is one instruction for all lanes.
                near_m[lane] = if enters_m > near_m[lane] { enters_m } else { near_m[lane] };
                far_m[lane] = if leaves_m < far_m[lane] { leaves_m } else { far_m[lane] };
            }
        }
        (near_m, far_m)
    }
}
