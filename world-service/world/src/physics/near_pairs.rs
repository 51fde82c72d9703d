//! The tree of boxes that finds the pairs of shapes near each other.
//!
//! Rapier keeps such a tree good by building parts of it anew in every step. With a handful of
//! shapes that costs more than it saves: 8 % of a step of a car and three people.

use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::prelude::{Aabb, BroadPhaseBvh, BvhOptimizationStrategy, IntegrationParameters};

use super::Physics;

/// For so long a body moves inside of the room that it was given in the tree.
const ROOM_SECS: f32 = 0.2;
/// Bodies up to which a tree stays as it grew.
const FEW_BODIES: usize = 16;

/// The tree of a world without bodies.
pub(super) fn of_few() -> BroadPhaseBvh {
    BroadPhaseBvh::with_optimization_strategy(BvhOptimizationStrategy::None)
}

impl Physics {
    /// Gives bodies room in the tree for where they get to within the next ticks, some of them in
    /// every tick, so that it need not change in every step. Nothing relies on their staying
    /// there: one that leaves its room is found out in the step in which it does.
    pub(crate) fn make_room(&mut self, dt_secs: f32, tick: u64) {
        if self.bodies.len() <= FEW_BODIES {
            return;
        }
        let turns = (ROOM_SECS / dt_secs).round() as u64;
        let parameters = IntegrationParameters::default();
        let apart_m = parameters.prediction_distance() / 2.0;
        for handle in self.islands.active_bodies() {
            let number = u64::from(handle.into_raw_parts().0);
            if (number + tick).checked_rem(turns) != Some(0) {
                continue;
            }
            let body = &self.bodies[handle];
            let next = body.predict_position_using_velocity(dt_secs * turns as f32);
            for handle in body.colliders() {
                let collider = &self.colliders[*handle];
                let next = collider.position_wrt_parent().map_or(next, |at| next * *at);
                let room = collider.compute_swept_aabb(&next).loosened(apart_m);
                if collider.is_enabled() && is_finite(&room) {
                    self.broad_phase.set_aabb(&parameters, *handle, room);
                }
            }
        }
    }

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
            if is_finite(&bounds) {
                tree.set_aabb(&parameters, handle, bounds);
            }
        }
        self.broad_phase = tree;
    }
}

fn is_finite(bounds: &Aabb) -> bool {
    bounds.mins.is_finite() && bounds.maxs.is_finite()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use schemas::{ActorId, Pose, SplitMix64, Vec3};

    use super::*;
    use crate::vehicle::{Fit, Tuning};

    const DT_SECS: f32 = 0.05;
    const SUBSTEPS: u64 = 5;

    /// Pairs of cars that fly at each other, each pair for itself.
    fn pairs(fit: &Fit, count: u32) -> Physics {
        let mut rng = SplitMix64::new(11);
        let mut between = |low: f32, high: f32| {
            low + (high - low) * ((rng.next_u64() >> 40) as f32 / 16_777_216.0)
        };
        let mut physics = Physics::new();
        for pair in 0..count {
            for side in [-1.0, 1.0] {
                let at_m = Vec3::new(side * between(4.0, 20.0), 300.0 * pair as f32, 500.0);
                let turned = Vec3::z() * between(-3.0, 3.0);
                let pose = Pose::new(at_m, turned);
                let towards_mps = Vec3::new(-side * between(5.0, 50.0), between(-2.0, 2.0), 0.0);
                let id = ActorId::new(2 * pair + if side > 0.0 { 2 } else { 1 });
                physics.insert_vehicle(fit, &pose, towards_mps, id.unwrap());
            }
        }
        physics
    }

    /// In which step each car is first touched.
    fn first_touches(physics: &mut Physics, with_room: bool) -> BTreeMap<ActorId, u64> {
        let mut first = BTreeMap::new();
        for step in 0..300 {
            if with_room && step % SUBSTEPS == 0 {
                physics.make_room(DT_SECS, step / SUBSTEPS);
            }
            assert!(physics.step(DT_SECS / SUBSTEPS as f32).is_empty());
            for contact in physics.contacts() {
                first.entry(contact.first).or_insert(step);
            }
        }
        first
    }

    #[test]
    fn bodies_meet_when_they_do_whatever_room_the_tree_has() {
        let model3 = blueprints::index_of("vehicle.tesla.model3").and_then(Tuning::standard);
        let physics = pairs(model3.unwrap().fit(), 40);
        let [with, without] = [true, false].map(|room| first_touches(&mut physics.clone(), room));
        assert_eq!(with, without);
        assert!(with.len() > 20, "{with:?}");
    }
}
