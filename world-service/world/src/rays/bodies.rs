//! The shapes of what moves, as rays see them.

use super::{Solid, Solids, tag};
use crate::world::{State, World};

impl World {
    pub(super) fn solids(&self) -> Solids {
        self.state.solids()
    }
}

impl State {
    /// The shapes that also collide, at their present places.
    pub(crate) fn solids(&self) -> Solids {
        let solids = self.actors.iter().flat_map(|actor| {
            let tag = tag::of_actor(actor.blueprint().kind());
            let shapes = self.physics.shapes(actor.body);
            shapes.map(move |(shape, pose)| Solid::new(shape, &pose, tag, Some(actor.id)))
        });
        Solids::new(solids.collect())
    }
}
