//! Which steps keep fast bodies from passing through what is thinner than their way in a step.
//!
//! Rapier then asks every body where it got to, and sweeps those that moved by more than half of
//! their least extent. That of a car is its height, so a motorway alone would ask for it.

use rapier3d::prelude::{RigidBody, SharedShape};
use schemas::Pose;

use super::Physics;

/// So much of its half width a body moves in a step without a sweep: its middle stays on the side
/// of whatever it runs into, which pushes it back.
const UNSWEPT_SHARE: f32 = 0.5;

/// Remembers with a body of these shapes how far it moves in a step without a sweep.
pub(super) fn note_width(body: &mut RigidBody, shapes: &[(SharedShape, Pose)]) {
    let halves_m = shapes.iter().map(|(shape, _)| shape.compute_local_aabb().half_extents());
    let half_width_m = halves_m.map(|half| half.x.min(half.y)).fold(f32::INFINITY, f32::min);
    body.user_data = u128::from((UNSWEPT_SHARE * half_width_m).to_bits());
}

fn unswept_m(body: &RigidBody) -> f32 {
    f32::from_bits(body.user_data as u32)
}

impl Physics {
    /// How often Rapier may sweep in a step of this length.
    pub(super) fn sweeps(&self, dt_secs: f32) -> usize {
        let is_fast = |body: &RigidBody| body.linvel().length() * dt_secs > unswept_m(body);
        usize::from(self.bodies.iter().any(|(_, body)| is_fast(body)))
    }
}

#[cfg(test)]
mod tests {
    use blueprints::{Age, Gender, WalkerModel};
    use schemas::{ActorId, Vec3};

    use super::*;
    use crate::physics::BodyHandle;
    use crate::vehicle::Tuning;

    const STEP_SECS: f32 = 0.01;
    /// Where fences stand, a decimetre thick.
    const FENCES_M: [f32; 6] = [12.0, 12.3, 12.6, 12.9, 13.2, 13.5];

    fn car(physics: &mut Physics, turned_rad: f32, towards_mps: Vec3) -> BodyHandle {
        let model3 = blueprints::index_of("vehicle.tesla.model3").and_then(Tuning::standard);
        let pose = Pose::new(Vec3::new(0.0, 0.0, 50.0), Vec3::z() * turned_rad);
        physics.insert_vehicle(model3.unwrap().fit(), &pose, towards_mps, ActorId::new(1).unwrap())
    }

    /// Each of some values with each fence.
    fn before_fences<const N: usize>(values: [f32; N]) -> impl Iterator<Item = (f32, f32)> {
        values.into_iter().flat_map(|value| FENCES_M.map(|fence_m| (value, fence_m)))
    }

    /// How near to a fence in its way the middle of a body gets within a second.
    fn nearest_m(physics: &mut Physics, body: BodyHandle, fence_m: f32) -> f32 {
        let half_m = Vec3::new(0.05, 40.0, 40.0);
        physics.insert_scenery(&Pose::translation(fence_m, 0.0, 50.0), half_m);
        let steps = (0..100).map(|_| {
            assert!(physics.step(STEP_SECS).is_empty());
            fence_m - physics.state(body).world_from_body.translation.x
        });
        steps.fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn no_car_gets_through_a_fence_whatever_its_speed() {
        for speed_mps in [5.0, 15.0, 25.0, 35.0, 44.0, 47.0, 70.0, 150.0] {
            for (turned_rad, fence_m) in before_fences([0.0, 0.6, 1.57]) {
                let mut physics = Physics::new();
                let body = car(&mut physics, turned_rad, Vec3::x() * speed_mps);
                let nearest_m = nearest_m(&mut physics, body, fence_m);
                assert!(nearest_m > 0.0, "{nearest_m} at {speed_mps}, {turned_rad}, {fence_m}");
            }
        }
    }

    #[test]
    fn nobody_flies_through_a_fence_whatever_the_speed() {
        let child = WalkerModel {
            mass_kg: 25.0,
            height_m: 1.1,
            radius_m: 0.25,
            walk_mps: 1.0,
            run_mps: 3.0,
            age: Age::Child,
            gender: Gender::Female,
        };
        for (speed_mps, fence_m) in before_fences([5.0, 12.0, 13.0, 25.0, 60.0, 150.0]) {
            let mut physics = Physics::new();
            let (pose, id) = (Pose::translation(0.0, 0.0, 50.0), ActorId::new(1).unwrap());
            let body = physics.insert_walker(&child, &pose, Vec3::x() * speed_mps, false, id);
            let nearest_m = nearest_m(&mut physics, body, fence_m);
            assert!(nearest_m > 0.0, "{nearest_m} at {speed_mps}, {fence_m}");
        }
    }

    #[test]
    fn only_who_is_faster_than_on_a_motorway_is_swept() {
        for (speed_mps, swept) in [(0.0, 0), (13.9, 0), (36.1, 0), (60.0, 1)] {
            let mut physics = Physics::new();
            car(&mut physics, 0.0, Vec3::y() * speed_mps);
            assert_eq!(physics.sweeps(STEP_SECS), swept, "{speed_mps} m/s");
        }
    }
}
