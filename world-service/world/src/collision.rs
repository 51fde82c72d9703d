//! From pushes of single substeps to the collisions of a tick.

use std::collections::{BTreeMap, BTreeSet};

use schemas::{ActorId, Collision, Pose, Vec3};
use serde::{Deserialize, Serialize};

use crate::actor::Actor;
use crate::physics::{BodyState, Contact, Physics};

/// Two actors, or an actor and scenery; the smaller id first.
type Pair = (ActorId, Option<ActorId>);

/// Which pairs touched in the last tick.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Contacts {
    /// With the closing speed at which the contact started.
    touching: BTreeMap<Pair, f32>,
}

/// Collects the contacts of one tick.
#[derive(Default)]
pub(crate) struct ContactLog {
    /// Awake bodies just before the present substep, ordered by id; the others stand still.
    before: Vec<(ActorId, BodyState)>,
    pairs: BTreeMap<Pair, Sum>,
}

/// One pair so far.
struct Sum {
    impulse_ns: Vec3,
    /// Weighted by the size of the impulse.
    point_m_ns: Vec3,
    weight_ns: f32,
    closing_mps: f32,
}

impl ContactLog {
    pub(crate) fn before(&mut self, actors: &[Actor], physics: &Physics) {
        self.before.clear();
        let bodies = actors.iter().filter_map(|actor| Some((actor.id, actor.rigid()?)));
        let awake = bodies.filter(|&(_, body)| !physics.is_asleep(body));
        self.before.extend(awake.map(|(id, body)| (id, physics.state(body))));
    }

    pub(crate) fn after(&mut self, physics: &Physics) {
        // A car consists of two shapes: both may touch the same person in one substep, and the
        // faster approach of the two is the one that was felt.
        let mut started: BTreeSet<Pair> = BTreeSet::new();
        for contact in physics.contacts() {
            let pair = (contact.first, contact.second);
            let closing_mps = self.closing_mps(&contact);
            let new = !self.pairs.contains_key(&pair);
            if new {
                started.insert(pair);
            }
            let sum = self.pairs.entry(pair).or_insert_with(Sum::new);
            sum.add(&contact);
            if started.contains(&pair) {
                sum.closing_mps = sum.closing_mps.max(closing_mps);
            }
        }
    }

    /// Where a body that was awake began the present substep.
    pub(crate) fn pose_before(&self, id: ActorId) -> Option<Pose> {
        let at = self.before.binary_search_by_key(&id, |&(id, _)| id).ok()?;
        self.before.get(at).map(|(_, body)| body.world_from_body)
    }

    /// Speed at which the two surfaces approached each other before the substep.
    fn closing_mps(&self, contact: &Contact) -> f32 {
        let velocity = |id: Option<ActorId>| {
            let at = id.and_then(|id| self.before.binary_search_by_key(&id, |&(id, _)| id).ok());
            at.and_then(|at| self.before.get(at)).map_or(Vec3::zeros(), |(_, body)| {
                let arm_m = contact.point_m - body.centre_of_mass_m;
                body.linear_mps + body.angular_radps.cross(&arm_m)
            })
        };
        let relative_mps = velocity(Some(contact.first)) - velocity(contact.second);
        let push = contact.impulse_ns.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        (-relative_mps.dot(&push)).max(0.0)
    }
}

impl Sum {
    fn new() -> Self {
        Self {
            impulse_ns: Vec3::zeros(),
            point_m_ns: Vec3::zeros(),
            weight_ns: 0.0,
            closing_mps: 0.0,
        }
    }

    fn add(&mut self, contact: &Contact) {
        let weight_ns = contact.impulse_ns.norm();
        self.impulse_ns += contact.impulse_ns;
        self.point_m_ns += contact.point_m * weight_ns;
        self.weight_ns += weight_ns;
    }
}

impl Contacts {
    /// The collisions of a tick, ordered by (actor, other); remembers which pairs touch.
    pub(crate) fn conclude(&mut self, log: ContactLog) -> Vec<Collision> {
        let mut touching = BTreeMap::new();
        let collisions = log
            .pairs
            .into_iter()
            .map(|(pair, sum)| {
                let known_mps = self.touching.get(&pair).copied();
                let closing_speed_mps = known_mps.unwrap_or(sum.closing_mps);
                touching.insert(pair, closing_speed_mps);
                Collision {
                    actor: pair.0,
                    other: pair.1,
                    started: known_mps.is_none(),
                    position_m: sum.point_m_ns / sum.weight_ns,
                    impulse_ns: sum.impulse_ns,
                    closing_speed_mps,
                }
            })
            .collect();
        self.touching = touching;
        collisions
    }

    /// Forgets an actor that is no longer there.
    pub(crate) fn forget(&mut self, id: ActorId) {
        self.touching.retain(|&(first, second), _| first != id && second != Some(id));
    }
}
