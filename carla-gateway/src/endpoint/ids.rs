//! Which ids of actors were given, and to whom: clients remember actors that are gone.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use schemas::{ActorId, limits};

use crate::catalogue;
use crate::dialect::Actor;

/// Actors that are remembered, those with the highest ids.
const KNOWN_MAX: usize = 65_536;

/// The ids that an endpoint has given in all of its worlds.
#[derive(Debug, Default)]
pub(crate) struct GivenIds {
    newest: Option<ActorId>,
    /// The newest of earlier worlds: clients forget their actors when another one begins.
    before: Option<ActorId>,
    /// What stands for the description of an actor of the present world.
    known: BTreeMap<ActorId, u64>,
}

impl GivenIds {
    /// From where on no id was given.
    pub(super) fn next(&self) -> ActorId {
        self.newest.map_or(ActorId::FIRST, |newest| newest.plus(1))
    }

    /// Another world begins, in which nobody has an id yet.
    pub(super) fn begin_world(&mut self) {
        self.before = self.newest;
        self.known.clear();
    }

    /// Somebody has this id, or had it.
    pub(super) fn note(&mut self, id: ActorId) {
        self.newest = self.newest.max(Some(id));
    }

    /// This is what somebody is.
    pub(super) fn learn(&mut self, actor: &Actor) {
        let Some(id) = actor.id.id() else { return };
        let attributes = &actor.description.attributes;
        let attributes = attributes.iter().map(|one| (one.id.as_str(), one.value.as_str()));
        self.known.insert(id, digest(&actor.description.type_id, attributes));
        while self.known.len() > KNOWN_MAX {
            self.known.pop_first();
            // Whether such an id was given in this world is not known any more.
            self.before = None;
        }
    }

    /// Whether an actor can have an id that nobody alive has: nobody had it in this world, or only
    /// actors that were made in the same way. What has a stream is never taken for another.
    pub(crate) fn suits<'a>(
        &self,
        id: ActorId,
        blueprint: &str,
        attributes: impl Iterator<Item = (&'a str, &'a str)>,
    ) -> bool {
        if id.get() > limits::WANTED_ACTOR_MAX {
            return false;
        }
        let suits_again = || {
            let had = self.known.get(&id);
            let is_same = had == Some(&digest(blueprint, attributes));
            let is_of_earlier_worlds = had.is_none() && Some(id) <= self.before;
            !catalogue::has_stream(blueprint) && (is_same || is_of_earlier_worlds)
        };
        Some(id) > self.newest || suits_again()
    }
}

fn digest<'a>(blueprint: &str, attributes: impl Iterator<Item = (&'a str, &'a str)>) -> u64 {
    let mut hasher = DefaultHasher::new();
    blueprint.hash(&mut hasher);
    attributes.filter(|(name, _)| !name.is_empty()).for_each(|one| one.hash(&mut hasher));
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::{ActorDescription, AttributeValue};

    fn actor(id: u32, type_id: &str, role: &str) -> Actor {
        let role = AttributeValue { id: "role_name".to_owned(), kind: 4, value: role.to_owned() };
        let (type_id, attributes) = (type_id.to_owned(), vec![role]);
        let description = ActorDescription { uid: 7, type_id, attributes };
        Actor { id: ActorId::new(id).into(), description, ..Actor::default() }
    }

    fn suits(ids: &GivenIds, id: u32, blueprint: &str, role: &str) -> bool {
        let id = ActorId::new(id).unwrap();
        ids.suits(id, blueprint, [("role_name", role), ("", "")].into_iter())
    }

    #[test]
    fn an_id_suits_whom_clients_can_take_for_the_one_that_had_it() {
        let mut ids = GivenIds::default();
        assert!(suits(&ids, 1, "vehicle.audi.tt", "hero"), "nobody had any");
        ids.note(ActorId::new(30).unwrap());
        ids.learn(&actor(24, "vehicle.audi.tt", "hero"));
        ids.learn(&actor(25, "sensor.other.gnss", "hero"));
        assert!(suits(&ids, 24, "vehicle.audi.tt", "hero"));
        assert!(!suits(&ids, 24, "vehicle.audi.tt", "other"));
        assert!(!suits(&ids, 24, "vehicle.audi.a2", "hero"));
        assert!(!suits(&ids, 25, "sensor.other.gnss", "hero"), "its stream has ended");
        assert!(!suits(&ids, 26, "vehicle.audi.tt", "hero"), "nobody knows who had it");
        assert!(suits(&ids, 31, "sensor.other.gnss", "hero"), "it was never given");
        assert!(!suits(&ids, u32::MAX, "vehicle.audi.tt", "hero"));
        assert_eq!(ids.next().get(), 31);
    }

    #[test]
    fn an_id_of_an_earlier_world_suits_anybody_without_a_stream() {
        let mut ids = GivenIds::default();
        ids.note(ActorId::new(30).unwrap());
        ids.learn(&actor(24, "vehicle.audi.tt", "hero"));
        ids.begin_world();
        ids.note(ActorId::new(40).unwrap());
        assert!(suits(&ids, 24, "vehicle.audi.a2", "other"));
        assert!(!suits(&ids, 25, "sensor.other.gnss", "hero"));
        assert!(!suits(&ids, 35, "vehicle.audi.a2", "other"), "clients remember who had it");
        ids.learn(&actor(24, "vehicle.audi.a2", "other"));
        assert!(!suits(&ids, 24, "vehicle.audi.tt", "hero"), "it is given in this world");
        assert_eq!(ids.next().get(), 41);
    }

    #[test]
    fn not_more_actors_are_remembered_than_there_is_room_for() {
        let mut ids = GivenIds::default();
        for id in 1..=KNOWN_MAX as u32 + 10 {
            ids.note(ActorId::new(id).unwrap());
            ids.learn(&actor(id, "vehicle.audi.tt", "hero"));
        }
        assert_eq!(ids.known.len(), KNOWN_MAX);
        assert!(!suits(&ids, 10, "vehicle.audi.tt", "hero"));
        assert!(suits(&ids, 11, "vehicle.audi.tt", "hero"));
        ids.begin_world();
        assert!(suits(&ids, 10, "vehicle.audi.a2", "hero"));
        for id in 0..=KNOWN_MAX as u32 {
            ids.learn(&actor(KNOWN_MAX as u32 + 20 + id, "vehicle.audi.tt", "hero"));
        }
        assert!(!suits(&ids, 10, "vehicle.audi.a2", "hero"), "nobody knows who has it");
    }
}
