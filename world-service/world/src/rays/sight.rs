//! What one sensor's rays can meet.

use std::cell::OnceCell;

use schemas::HiddenScenery;

use super::{RayScene, Solids, TownRays};

/// The town, and what moves in it; that is gathered when the first ray is cast.
pub(crate) struct Sight<'a> {
    town: &'a TownRays,
    hidden: &'a HiddenScenery,
    gather: &'a dyn Fn() -> Solids,
    bodies: OnceCell<Solids>,
}

impl<'a> Sight<'a> {
    pub(crate) fn new(
        town: &'a TownRays,
        hidden: &'a HiddenScenery,
        gather: &'a dyn Fn() -> Solids,
    ) -> Self {
        Self { town, hidden, gather, bodies: OnceCell::new() }
    }

    pub(crate) fn scene(&self) -> RayScene<'_> {
        RayScene {
            town: self.town,
            hidden: self.hidden,
            bodies: self.bodies.get_or_init(self.gather),
        }
    }
}
