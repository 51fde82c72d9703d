//! What can be asked of a world beyond its frame.

use schemas::{
    ActorDescription, ActorId, ActorKind, Error, ErrorCode, RayHit, Vec3, VehicleReport,
};

use crate::actor::Actor;
use crate::attributes;
use crate::blueprint::{Blueprint, BodySpec};
use crate::world::World;

impl World {
    /// What does not change from tick to tick, of the known actors among those asked for, ordered by
    /// id; of all when none is named.
    pub fn describe(&self, wanted: &[ActorId]) -> Vec<ActorDescription> {
        let is_wanted = |actor: &&Actor| wanted.is_empty() || wanted.contains(&actor.id);
        self.state.actors.iter().filter(is_wanted).map(description).collect()
    }

    /// Parameters and last measurements of a vehicle.
    ///
    /// # Errors
    /// `UnknownActor`, or `InvalidArgument` for an actor without wheels.
    pub fn vehicle_report(&self, id: ActorId) -> Result<VehicleReport, Error> {
        self.state.index_of(id)?;
        Err(Error::new(ErrorCode::Unsupported, "vehicles cannot be inspected"))
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
