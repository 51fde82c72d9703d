//! Who comes while a recording is under way, and whose physics has to be told.

use std::collections::{BTreeMap, BTreeSet};

use schemas::{ActorId, ActorKind, ActorState, Frame, Pose};

use crate::dialect::ActorDescription;
use crate::episode::Episode;

/// An actor that the frames before did not have.
#[derive(Debug)]
pub(super) struct Arrival {
    pub(super) id: ActorId,
    /// `None` if it is not known what it was made from.
    pub(super) description: Option<ActorDescription>,
    /// Where it came.
    pub(super) place: Place,
}

/// Where an actor was when it was first seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    pub(super) in_world: Pose,
    /// As in the world, if nobody carries it.
    pub(super) on_carrier: Pose,
}

/// What the frames of a recording had so far.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    /// Who was in the last frame, by id.
    known: Vec<ActorId>,
    came: BTreeMap<ActorId, Place>,
    /// Vehicles whose physics was changed.
    changed: BTreeSet<ActorId>,
}

impl Arrivals {
    /// Notes where new actors are, in a frame or between two.
    pub(super) fn see(&mut self, frame: &Frame) {
        for actor in newcomers(&self.known, frame) {
            let carrier = actor.parent.and_then(|id| frame.actor(id));
            let world_from_carrier = carrier.map_or(Pose::identity(), |it| it.world_from_actor);
            let in_world = actor.world_from_actor;
            let on_carrier = world_from_carrier.inverse() * in_world;
            self.came.entry(actor.id).or_insert(Place { in_world, on_carrier });
        }
    }

    pub(super) fn note_physics(&mut self, vehicle: ActorId) {
        self.changed.insert(vehicle);
    }

    /// Vehicles that are new or whose physics was changed.
    pub(super) fn vehicles_to_inspect(&self, frame: &Frame) -> Vec<ActorId> {
        let new = newcomers(&self.known, frame).filter(|actor| actor.kind == ActorKind::Vehicle);
        let mut vehicles: BTreeSet<ActorId> = new.map(|vehicle| vehicle.id).collect();
        vehicles.extend(self.changed.iter().filter(|id| frame.actor(**id).is_some()));
        vehicles.into_iter().collect()
    }

    /// Those who are new in the newest frame, which from now on are known.
    pub(super) fn take(&mut self, episode: &Episode) -> Vec<Arrival> {
        let frame = &episode.frame;
        self.see(frame);
        let arrival = |actor: &ActorState| Arrival {
            id: actor.id,
            description: episode.actor(actor.id).map(|known| known.description.clone()),
            place: self.came.get(&actor.id).copied().unwrap_or_default(),
        };
        let arrivals = newcomers(&self.known, frame).map(arrival).collect();
        self.known.clear();
        self.known.extend(frame.actors.iter().map(|actor| actor.id));
        self.came.clear();
        self.changed.clear();
        arrivals
    }
}

/// Those of a frame who are not known; both are ordered by id.
fn newcomers<'a>(known: &'a [ActorId], frame: &'a Frame) -> impl Iterator<Item = &'a ActorState> {
    let mut known = known.iter().peekable();
    frame.actors.iter().filter(move |actor| {
        while known.next_if(|id| **id < actor.id).is_some() {}
        known.next_if(|id| **id == actor.id).is_none()
    })
}
