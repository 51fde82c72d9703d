//! What one sensor's rays can meet.

use std::cell::OnceCell;

use schemas::ActorId;

use super::{RayScene, Solids, TownRays};
use crate::world::State;

/// Everything around but the actors that are ignored; gathered when the first ray is cast.
pub(crate) struct Sight<'a> {
    town: &'a TownRays,
    state: &'a State,
    ignored: &'a [ActorId],
    bodies: OnceCell<Solids>,
}

impl<'a> Sight<'a> {
    pub(crate) fn new(town: &'a TownRays, state: &'a State, ignored: &'a [ActorId]) -> Self {
        Self { town, state, ignored, bodies: OnceCell::new() }
    }

    pub(crate) fn scene(&self) -> RayScene<'_> {
        RayScene {
            town: self.town,
            hidden: &self.state.hidden,
            bodies: self.bodies.get_or_init(|| self.state.solids_but(self.ignored)),
        }
    }
}
