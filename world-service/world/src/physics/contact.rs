//! Contacts that pushed during the last substep.

use rapier3d::prelude::{ColliderHandle, ContactPair};
use schemas::{ActorId, Vec3};

use super::Physics;
use crate::convert::from_rapier;

/// One touching pair of shapes during one substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    pub first: ActorId,
    /// `None` for scenery.
    pub second: Option<ActorId>,
    /// On `first`, along the contact normal.
    pub impulse_ns: Vec3,
    pub point_m: Vec3,
}

impl Physics {
    /// Every pair that pushed in the last [`step`](Physics::step).
    ///
    /// - **Order:** that of Rapier's contact graph, which a snapshot preserves.
    pub(crate) fn contacts(&self) -> impl Iterator<Item = Contact> + '_ {
        self.narrow_phase.contact_pairs().filter_map(|pair| self.contact(pair))
    }

    fn contact(&self, pair: &ContactPair) -> Option<Contact> {
        if !pair.has_any_active_contact() {
            return None;
        }
        // Two sleeping bodies keep the impulses of the step in which they fell asleep.
        if self.asleep_or_fixed(pair.collider1) && self.asleep_or_fixed(pair.collider2) {
            return None;
        }
        // The normal points from the first shape to the second, the push on the first back.
        let impulse_ns = -from_rapier(pair.total_impulse());
        // Also of none, and of one too small to be weighed.
        let pushes = impulse_ns.norm() > 0.0 && impulse_ns.norm().is_finite();
        let point_m = self.point(pair).filter(|_| pushes)?;
        match (self.actor(pair.collider1), self.actor(pair.collider2)) {
            (Some(first), Some(second)) if second < first => Some(Contact {
                first: second,
                second: Some(first),
                impulse_ns: -impulse_ns,
                point_m,
            }),
            (Some(first), second) => Some(Contact { first, second, impulse_ns, point_m }),
            (None, Some(second)) => {
                Some(Contact { first: second, second: None, impulse_ns: -impulse_ns, point_m })
            }
            (None, None) => None,
        }
    }

    fn asleep_or_fixed(&self, collider: ColliderHandle) -> bool {
        let parent = self.colliders.get(collider).and_then(|collider| collider.parent());
        parent.and_then(|body| self.bodies.get(body)).is_none_or(super::rests)
    }

    fn actor(&self, collider: ColliderHandle) -> Option<ActorId> {
        let user_data = self.colliders.get(collider)?.user_data;
        ActorId::new(u32::try_from(user_data).ok()?)
    }

    /// Mean of the points that pushed.
    fn point(&self, pair: &ContactPair) -> Option<Vec3> {
        let world_from_shape = *self.colliders.get(pair.collider1)?.position();
        let mut sum_m = Vec3::zeros();
        let mut count = 0.0;
        for manifold in pair.solver_manifolds() {
            for point in manifold.points.iter().filter(|point| point.data.impulse > 0.0) {
                sum_m += from_rapier(world_from_shape.transform_point(point.local_p1));
                count += 1.0;
            }
        }
        (count > 0.0).then(|| sum_m / count)
    }
}
