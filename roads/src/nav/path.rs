//! Ways over the mesh.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use nalgebra::Point3;

use super::funnel::{Portal, pull};
use super::{Area, NavMesh};
use crate::limits;

/// A metre on the road counts as much as this many on a sidewalk, as in the client library.
const ROAD_COST: f64 = 10.0;

/// How a polygon was reached.
#[derive(Clone, Copy, Debug)]
struct Reached {
    cost_m: f64,
    /// The polygon before, and the edge of it that was crossed.
    from: Option<(u32, usize)>,
    /// Where it was entered.
    entry: Point3<f64>,
    is_done: bool,
}

impl NavMesh {
    /// The corners of a short way between the places on the mesh nearest to two points, both
    /// places included; empty when there is no way or no mesh.
    ///
    /// With `cross_roads` the way may lead over the road, at ten times the cost; without, a walker
    /// who stands on a road may leave it but nobody steps onto one. Between corners the way is
    /// straight seen from above; heights in between follow the mesh.
    #[must_use]
    pub fn path(&self, from: Point3<f64>, to: Point3<f64>, cross_roads: bool) -> Vec<Point3<f64>> {
        let (Some((start, from)), Some((goal, to))) = (self.nearest(from), self.nearest(to)) else {
            return Vec::new();
        };
        self.search([start, goal], [from, to], cross_roads)
            .map_or_else(Vec::new, |portals| pull(from, &portals, to))
    }

    /// The edges to cross from polygon to polygon (A*, over the middles of edges).
    fn search(
        &self,
        [start, goal]: [u32; 2],
        [from, to]: [Point3<f64>; 2],
        cross_roads: bool,
    ) -> Option<Vec<Portal>> {
        let mut reached: BTreeMap<u32, Reached> = BTreeMap::new();
        let mut open: BinaryHeap<Reverse<(Millimetres, u32)>> = BinaryHeap::new();
        let first = Reached { cost_m: 0.0, from: None, entry: from, is_done: false };
        reached.insert(start, first);
        open.push(Reverse((Millimetres::new(0.0), start)));
        let mut looked_at = 0;
        while let Some(Reverse((_, index))) = open.pop() {
            let Some(state) = reached.get_mut(&index) else { continue };
            if std::mem::replace(&mut state.is_done, true) {
                continue;
            }
            if index == goal {
                return self.portals(&reached, goal);
            }
            looked_at += 1;
            if looked_at > limits::NAV_SEARCH_POLYGONS_MAX {
                return None;
            }
            let (entry, cost_m) = (state.entry, state.cost_m);
            for (edge, next, area) in self.ways_on(index) {
                let own = self.polygons.get(index as usize)?.area;
                if area == Area::Road && own != Area::Road && !cross_roads {
                    continue;
                }
                let Some(portal) = self.portal(index, edge) else { continue };
                let middle = nalgebra::center(&portal.left, &portal.right);
                let rate = if own == Area::Road { ROAD_COST } else { 1.0 };
                let cost_m = cost_m + (middle - entry).norm() * rate;
                if reached.get(&next).is_some_and(|known| known.cost_m <= cost_m) {
                    continue;
                }
                let from = Some((index, edge));
                reached.insert(next, Reached { cost_m, from, entry: middle, is_done: false });
                open.push(Reverse((Millimetres::new(cost_m + (to - middle).norm()), next)));
            }
        }
        None
    }

    /// Edges with a polygon beyond: position, that polygon, its area.
    fn ways_on(&self, polygon: u32) -> impl Iterator<Item = (usize, u32, Area)> {
        let neighbours = self.polygons.get(polygon as usize).map_or(&[][..], |p| &p.neighbours);
        neighbours.iter().enumerate().filter_map(|(edge, next)| {
            let next = (*next)?;
            Some((edge, next, self.polygons.get(next as usize)?.area))
        })
    }

    /// An edge as seen by someone who leaves the polygon over it.
    fn portal(&self, polygon: u32, edge: usize) -> Option<Portal> {
        let corners = &self.polygons.get(polygon as usize)?.corners;
        let corner = |position: usize| {
            let vertex = corners.get(position % corners.len())?;
            self.vertices.get(*vertex as usize).copied()
        };
        Some(Portal { right: corner(edge)?, left: corner(edge + 1)? })
    }

    fn portals(&self, reached: &BTreeMap<u32, Reached>, goal: u32) -> Option<Vec<Portal>> {
        let mut portals = Vec::new();
        let mut at = goal;
        while let Some((before, edge)) = reached.get(&at)?.from {
            portals.push(self.portal(before, edge)?);
            at = before;
        }
        portals.reverse();
        Some(portals)
    }
}

/// A cost that can be ordered: the search needs no finer steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Millimetres(u64);

impl Millimetres {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "costs are positive, and the conversion stops at the largest number"
    )]
    fn new(cost_m: f64) -> Self {
        Self((cost_m * 1000.0) as u64)
    }
}
