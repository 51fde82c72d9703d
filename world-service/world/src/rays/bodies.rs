//! The shapes of what moves, as rays see them.

use super::{Owner, Solid, Solids, tag};
use crate::world::{State, World};

impl World {
    pub(super) fn solids(&self) -> Solids {
        self.state.solids()
    }
}

impl State {
    /// The shapes that also collide, at their present places.
    pub(crate) fn solids(&self) -> Solids {
        let bodies = self.actors.iter().filter_map(|actor| Some((actor, actor.rigid()?)));
        let solids = bodies.flat_map(|(actor, body)| {
            let tag = tag::of_actor(actor.blueprint());
            let shapes = self.physics.shapes(body);
            shapes.map(move |(shape, pose)| Solid::new(shape, &pose, tag, Owner::Actor(actor.id)))
        });
        Solids::new(solids.collect())
    }
}
