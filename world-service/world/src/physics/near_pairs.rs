//! The tree of boxes that finds the pairs of shapes near each other.
//!
//! Rapier keeps such a tree good by building parts of it anew in every step. With a handful of
//! shapes that costs more than it saves: 8 % of a step of a car and three people.

use rapier3d::prelude::{BroadPhaseBvh, BvhOptimizationStrategy, IntegrationParameters};

use super::Physics;

/// Bodies up to which a tree stays as it grew.
const FEW_BODIES: usize = 16;

/// The tree of a world without bodies.
pub(super) fn of_few() -> BroadPhaseBvh {
    BroadPhaseBvh::with_optimization_strategy(BvhOptimizationStrategy::None)
}

impl Physics {
    /// Takes a tree that is kept good, once there is one body more than few. Pairs that are known
    /// are found again, which changes nothing about them.
    pub(super) fn outgrow_tree(&mut self) {
        if self.bodies.len() != FEW_BODIES + 1 {
            return;
        }
        let parameters = IntegrationParameters::default();
        let mut tree = BroadPhaseBvh::new();
        for (handle, collider) in self.colliders.iter_enabled() {
            let bounds = collider.compute_broad_phase_aabb(&parameters, &self.bodies);
            if bounds.mins.is_finite() && bounds.maxs.is_finite() {
                tree.set_aabb(&parameters, handle, bounds);
            }
        }
        self.broad_phase = tree;
    }
}
