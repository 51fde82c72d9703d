//! What can be asked of a world beyond its frame.

use schemas::{ActorDescription, ActorId, ActorKind, Error, ErrorCode, RayHit, Vec3};

use crate::actor::Actor;
use crate::attributes;
use crate::blueprint::{Blueprint, BodySpec};
use crate::world::World;

impl World {
    /// What does not change from tick to tick, of the known actors among those asked for, ordered by
    /// id; of all when none is named.
    pub fn describe(&self, wanted: &[ActorId]) -> Vec<ActorDescription> {
        let is_wanted = |id: ActorId| wanted.is_empty() || wanted.contains(&id);
        let fixed = self.fixed_actors().iter().filter(|actor| is_wanted(actor.id));
        let spawned = self.state.actors.iter().filter(|actor| is_wanted(actor.id));
        let plan = &self.town.traffic;
        fixed.map(|actor| plan.description(actor)).chain(spawned.map(description)).collect()
    }

    /// Everything that each ray meets, ordered by ray, then by distance.
    ///
    /// - **Frame:** from and to in the world, metres.
    ///
    /// # Errors
    /// `Unsupported`.
    pub fn cast_rays(&self, _rays: &[(Vec3, Vec3)]) -> Result<Vec<RayHit>, Error> {
        Err(Error::new(ErrorCode::Unsupported, "rays cannot be cast"))
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
        tag: tag(blueprint),
        signal: None,
    }
}

/// A prop lighter than this may be moved by hand.
const MOVABLE_KG: f32 = 100.0;

/// CARLA's semantic tag of everything of a blueprint; 0 for what cannot be seen.
fn tag(blueprint: &Blueprint) -> u8 {
    match (blueprint.kind(), &blueprint.body) {
        (ActorKind::TrafficLight, _) => 7,
        (ActorKind::TrafficSign, _) => 8,
        (ActorKind::Walker, _) => 12,
        (ActorKind::Vehicle, _) => 14,
        (ActorKind::Prop, BodySpec::Prop(spec)) if spec.mass_kg < MOVABLE_KG => 21,
        (ActorKind::Prop, _) => 20,
        (ActorKind::Sensor | ActorKind::Marker, _) => 0,
    }
}
