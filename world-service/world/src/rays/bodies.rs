//! The shapes of what moves, as rays see them.

use schemas::ActorId;

use super::{Owner, Solid, Solids, tag};
use crate::world::{State, World};

impl World {
    pub(super) fn solids(&self) -> Solids {
        self.state.solids_but(&[])
    }
}

impl State {
    /// The shapes that also collide, at their present places, but those of some actors.
    pub(crate) fn solids_but(&self, ignored: &[ActorId]) -> Solids {
        let seen = self.actors.iter().filter(|actor| !ignored.contains(&actor.id));
        let bodies = seen.filter_map(|actor| Some((actor, actor.rigid()?)));
        let solids = bodies.flat_map(|(actor, body)| {
            let tag = tag::of_actor(actor.blueprint());
            let shapes = self.physics.shapes(body);
            shapes.map(move |(shape, pose)| Solid::new(shape, &pose, tag, Owner::Actor(actor.id)))
        });
        Solids::new(solids.collect())
    }
}
