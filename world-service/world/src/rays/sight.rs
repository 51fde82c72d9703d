//! What one sensor's rays can meet.

use std::cell::OnceCell;

use schemas::HiddenScenery;

use super::{Actors, RayScene, TownRays};

/// The town, and what moves in it; that is gathered when the first ray is cast.
pub(crate) struct Sight<'a> {
    town: &'a TownRays,
    hidden: &'a HiddenScenery,
    gather: &'a dyn Fn() -> Actors,
    actors: OnceCell<Actors>,
}

impl<'a> Sight<'a> {
    pub(crate) fn new(
        town: &'a TownRays,
        hidden: &'a HiddenScenery,
        gather: &'a dyn Fn() -> Actors,
    ) -> Self {
        Self { town, hidden, gather, actors: OnceCell::new() }
    }

    pub(crate) fn scene(&self) -> RayScene<'_> {
        RayScene {
            town: self.town,
            hidden: self.hidden,
            actors: self.actors.get_or_init(self.gather),
        }
    }
}
