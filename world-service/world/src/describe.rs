//! What can be asked of a world beyond its frame.

use schemas::{ActorDescription, ActorId};

use crate::actor::Actor;
use crate::attributes;
use crate::rays::tag;
use crate::world::World;

impl World {
    /// What does not change from tick to tick, of the known actors among those asked for, ordered
    /// by id; of all when none is named.
    pub fn describe(&self, wanted: &[ActorId]) -> Vec<ActorDescription> {
        let is_wanted = |id: ActorId| wanted.is_empty() || wanted.contains(&id);
        let fixed = self.fixed_actors().filter(|(_, actor)| is_wanted(actor.id));
        let spawned = self.state.actors.iter().filter(|actor| is_wanted(actor.id));
        let plan = &self.town.traffic;
        let fixed = fixed.map(|(at, actor)| plan.description(at, &actor));
        let mut described: Vec<ActorDescription> = fixed.chain(spawned.map(description)).collect();
        described.sort_by_key(|one| one.id);
        described
    }
}

fn description(actor: &Actor) -> ActorDescription {
    let blueprint = actor.blueprint();
    ActorDescription {
        id: actor.id,
        attachment: actor.body.attachment(),
        kind: blueprint.kind(),
        blueprint: blueprint.id.clone(),
        attributes: attributes::complete(actor),
        box_centre_m: blueprint.box_centre_m(),
        box_half_extent_m: blueprint.box_half_extent_m(),
        tag: tag::of_actor(blueprint),
        signal: None,
    }
}
