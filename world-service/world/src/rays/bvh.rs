//! A tree of boxes that a ray compares four at a time.
//!
//! Own and not parry's: built for enhanced determinism, parry computes boxes one number at a time,
//! while the loops over four lanes here become vector instructions that give the same bits
//! everywhere (only additions, products and comparisons).

use super::bounds::Bounds;
use super::build;
use super::packet::{Mask, Nearest, Packet, greater, lesser};
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

/// The same of packets, with the node and the lane from which each comes.
pub(crate) type PacketStack = Vec<(f32, (u32, (u32, u8)))>;

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

    /// Visits the leaves that rays of a packet may meet before what they met so far, roughly from
    /// near to far, with those rays. `visit` takes the leaf, the rays, what they met, and the stack
    /// for a walk within this one.
    #[inline(never)]
    pub(crate) fn walk_packet(
        &self,
        packet: &Packet,
        nearest: &mut Nearest,
        stack: &mut PacketStack,
        mut visit: impl FnMut(u32, Mask, &mut Nearest, &mut PacketStack),
    ) {
        let Some(root) = self.root else { return };
        let mut reach_m = nearest.longest_m();
        let base = stack.len();
        if root & LEAF != 0 {
            return visit(root & !LEAF, Mask::MAX, nearest, stack);
        }
        stack.push((0.0, (root, (0, 0))));
        while stack.len() > base {
            let Some((entry_m, (child, (parent, lane)))) = stack.pop() else { return };
            if entry_m > reach_m {
                continue;
            }
            if child & LEAF != 0 {
                let bounds = self.nodes[parent as usize].bounds(lane.into());
                let mask = packet.meeting(&bounds, nearest);
                if mask != 0 {
                    visit(child & !LEAF, mask, nearest, stack);
                    reach_m = nearest.longest_m();
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let (near_m, far_m) = node.cross_packet(packet, reach_m);
            let first = stack.len();
            for lane in 0..WIDTH {
                if near_m[lane] <= far_m[lane] {
                    let from = (child, lane as u8);
                    push_sorted(stack, first, (near_m[lane], (node.children[lane], from)));
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
fn push_sorted<Child>(stack: &mut Vec<(f32, Child)>, first: usize, entry: (f32, Child)) {
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
                near_m[lane] = greater(enters_m, near_m[lane]);
                far_m[lane] = lesser(leaves_m, far_m[lane]);
            }
        }
        (near_m, far_m)
    }

    /// Before which no ray of a packet enters each child, and after which all have left it.
    #[inline(never)]
    fn cross_packet(&self, packet: &Packet, reach_m: f32) -> ([f32; WIDTH], [f32; WIDTH]) {
        let mut near_m = [0.0; WIDTH];
        let mut far_m = [reach_m; WIDTH];
        for axis in 0..3 {
            let Some([least, greatest]) = packet.span(axis) else { continue };
            let origin_m = packet.origin_m()[axis];
            let [low_m, high_m] = &self.planes_m[axis];
            let (entry, exit) = if least >= 0.0 { (low_m, high_m) } else { (high_m, low_m) };
            for lane in 0..WIDTH {
                let (to_entry_m, to_exit_m) = (entry[lane] - origin_m, exit[lane] - origin_m);
                let enters_m = lesser(to_entry_m * least, to_entry_m * greatest);
                let leaves_m = greater(to_exit_m * least, to_exit_m * greatest);
                near_m[lane] = greater(enters_m, near_m[lane]);
                far_m[lane] = lesser(leaves_m, far_m[lane]);
            }
        }
        (near_m, far_m)
    }
}
