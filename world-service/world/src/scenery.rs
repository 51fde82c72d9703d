//! Buildings, poles and walls: fixed boxes that enter the physics only near something that moves.
//!
//! A town has hundreds of them; all at once they would be most of a snapshot and of a world's
//! memory.

use nalgebra::Vector2;
use schemas::{HiddenScenery, Pose, Vec3};
use serde::{Deserialize, Serialize};

use crate::physics::{Physics, SceneryHandle};

/// Side of a cell of the search grid.
const CELL_M: f32 = 32.0;
/// Cells of the grid, at most.
const CELLS_MAX: usize = 1 << 16;
/// A box enters when a moving body comes this near, beyond what it can travel in the tick.
const ENTER_M: f32 = 2.0;
/// A box leaves when every moving body is this much farther than needed to enter.
const LEAVE_M: f32 = 8.0;

/// One fixed box.
#[derive(Clone, Debug)]
pub(crate) struct Fixture {
    pub world_from_box: Pose,
    pub half_m: Vec3,
    /// Of the circle around it, seen from above.
    radius_m: f32,
    /// Of the thing that it is of, by which it is hidden.
    place: u32,
}

/// All fixed boxes of a map, findable by place.
#[derive(Debug)]
pub(crate) struct Scenery {
    fixtures: Vec<Fixture>,
    /// Fixture indices by cell, each fixture in every cell its circle touches.
    cells: Vec<Vec<u32>>,
    origin_m: Vector2<f32>,
    cell_m: f32,
    columns: usize,
}

/// A circle that a body may reach within a tick, seen from above.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub centre_m: Vec3,
    pub radius_m: f32,
}

/// The fixtures that are in a world's physics now, ordered by index.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct NearFixtures {
    present: Vec<(u32, SceneryHandle)>,
}

impl Scenery {
    /// Boxes with the places of the things that they are of.
    pub(crate) fn new(boxes: impl IntoIterator<Item = (u32, Pose, Vec3)>) -> Self {
        let fixtures: Vec<Fixture> = boxes
            .into_iter()
            .map(|(place, world_from_box, half_m)| Fixture {
                world_from_box,
                half_m,
                radius_m: half_m.norm(),
                place,
            })
            .collect();
        let (low, high) = bounds(&fixtures);
        let size = high - low;
        let cells_along = |size_m: f32, cell_m: f32| (size_m / cell_m) as usize + 1;
        let mut cell_m = CELL_M;
        while cells_along(size.x, cell_m) * cells_along(size.y, cell_m) > CELLS_MAX {
            cell_m *= 2.0;
        }
        let columns = cells_along(size.x, cell_m);
        let cells = vec![Vec::new(); columns * cells_along(size.y, cell_m)];
        let mut scenery = Self { fixtures, cells, origin_m: low, cell_m, columns };
        scenery.fill_cells();
        scenery
    }

    /// Whether the fixture at an index is of a hidden thing.
    fn is_hidden(&self, index: u32, hidden: &HiddenScenery) -> bool {
        self.get(index).is_some_and(|fixture| hidden.contains(fixture.place))
    }

    /// The fixture at an index.
    pub(crate) fn get(&self, index: u32) -> Option<&Fixture> {
        self.fixtures.get(index as usize)
    }

    /// Adds the indices of all fixtures within a circle that are not hidden to `found`.
    pub(crate) fn find_shown(&self, reach: Reach, hidden: &HiddenScenery, found: &mut Vec<u32>) {
        self.find(reach, found);
        if !hidden.is_none() {
            found.retain(|index| !self.is_hidden(*index, hidden));
        }
    }

    /// Adds the indices of all fixtures within a circle to `found`.
    pub(crate) fn find(&self, reach: Reach, found: &mut Vec<u32>) {
        for cell in self.cells_around(reach.centre_m, reach.radius_m) {
            let candidates = self.cells[cell].iter().copied();
            found
                .extend(candidates.filter(|&index| self.fixtures[index as usize].is_within(reach)));
        }
    }

    fn fill_cells(&mut self) {
        for index in 0..self.fixtures.len() {
            let fixture = &self.fixtures[index];
            let centre_m = fixture.world_from_box.translation.vector;
            let around: Vec<usize> = self.cells_around(centre_m, fixture.radius_m).collect();
            for cell in around {
                self.cells[cell].push(index as u32);
            }
        }
    }

    /// Cells of the grid that a square around a point touches; none outside of the grid.
    fn cells_around(&self, centre_m: Vec3, radius_m: f32) -> impl Iterator<Item = usize> + use<> {
        let rows = self.cells.len() / self.columns;
        let columns = self.columns;
        let span = |centre: f32, origin: f32, count: usize| {
            let low = ((centre - radius_m - origin) / self.cell_m).floor().max(0.0);
            let high = ((centre + radius_m - origin) / self.cell_m).floor().min(count as f32 - 1.0);
            // An empty range when the square lies outside.
            if high < low { 0..0 } else { low as usize..high as usize + 1 }
        };
        let across = span(centre_m.x, self.origin_m.x, columns);
        span(centre_m.y, self.origin_m.y, rows)
            .flat_map(move |row| across.clone().map(move |column| row * columns + column))
    }
}

impl Fixture {
    fn is_within(&self, reach: Reach) -> bool {
        let offset_m = self.world_from_box.translation.vector.xy() - reach.centre_m.xy();
        let distance_m = self.radius_m + reach.radius_m;
        offset_m.norm_squared() <= distance_m * distance_m
    }
}

impl NearFixtures {
    /// Puts fixtures near moving bodies into the physics and takes far ones out.
    ///
    /// - **Determinism:** depends on the bodies and on what is present only.
    pub(crate) fn update(
        &mut self,
        scenery: &Scenery,
        hidden: &HiddenScenery,
        reaches: &[Reach],
        physics: &mut Physics,
    ) {
        if scenery.fixtures.is_empty() || reaches.is_empty() {
            return;
        }
        let mut wanted = Vec::new();
        for &reach in reaches {
            scenery.find_shown(reach.wider(ENTER_M), hidden, &mut wanted);
        }
        wanted.sort_unstable();
        wanted.dedup();
        self.present.retain(|&(index, handle)| {
            let near = || {
                let stays = |reach: &Reach| reach.wider(ENTER_M + LEAVE_M);
                let fixture = scenery.get(index);
                fixture.is_some_and(|it| reaches.iter().any(|reach| it.is_within(stays(reach))))
            };
            // What a sleeping body leans on stays, or taking it away would wake the body.
            let stays =
                wanted.binary_search(&index).is_ok() || near() || physics.is_touched(handle);
            if !stays {
                physics.remove_scenery(handle);
            }
            stays
        });
        for index in wanted {
            let Err(at) = self.present.binary_search_by_key(&index, |&(present, _)| present) else {
                continue;
            };
            let Some(fixture) = scenery.get(index) else { continue };
            let handle = physics.insert_scenery(&fixture.world_from_box, fixture.half_m);
            self.present.insert(at, (index, handle));
        }
    }

    /// Takes hidden fixtures out of the physics; what leans on them wakes.
    pub(crate) fn leave_hidden(
        &mut self,
        scenery: &Scenery,
        hidden: &HiddenScenery,
        physics: &mut Physics,
    ) {
        self.present.retain(|&(index, handle)| {
            let stays = !scenery.is_hidden(index, hidden);
            if !stays {
                physics.remove_scenery(handle);
            }
            stays
        });
    }

    /// Whether every entry is one of the town's that is not hidden and in the physics, in order.
    pub(crate) fn is_consistent(
        &self,
        scenery: &Scenery,
        hidden: &HiddenScenery,
        physics: &Physics,
    ) -> bool {
        self.present.windows(2).all(|pair| pair[0].0 < pair[1].0)
            && self.present.iter().all(|&(index, handle)| {
                scenery.get(index).is_some()
                    && !scenery.is_hidden(index, hidden)
                    && physics.contains_scenery(handle)
            })
    }
}

impl Reach {
    fn wider(self, by_m: f32) -> Self {
        Self { radius_m: self.radius_m + by_m, ..self }
    }
}

fn bounds(fixtures: &[Fixture]) -> (Vector2<f32>, Vector2<f32>) {
    fixtures
        .iter()
        .map(|fixture| {
            let centre = fixture.world_from_box.translation.vector.xy();
            let radius = Vector2::repeat(fixture.radius_m);
            (centre - radius, centre + radius)
        })
        .reduce(|(low, high), (l, h)| (low.inf(&l), high.sup(&h)))
        .unwrap_or((Vector2::zeros(), Vector2::zeros()))
}
