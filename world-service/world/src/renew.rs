//! Where a road ends: traffic of the world's own begins anew where a road begins.

use schemas::{Pose, Vec3};

use crate::place;
use crate::town::Town;
use crate::world::State;

/// How far behind the beginning of a road a vehicle is put.
const BEHIND_M: f32 = 6.0;
/// Way between places on a map on which no road begins.
const PLACES_M: f32 = 20.0;
/// A place counts as free when nobody is nearer along its lane...
const FREE_M: f32 = 14.0;
/// ...and beside its middle.
const BESIDE_M: f32 = 2.4;

impl State {
    /// Takes vehicles of the world's traffic that stand where their road ends to a free beginning
    /// of a road; while none is free they wait.
    pub(crate) fn renew_ended(&mut self, town: &Town) {
        for index in 0..self.actors.len() {
            let vehicle = self.actors[index].vehicle.as_deref();
            let traffic = vehicle.and_then(|vehicle| vehicle.wheel.traffic());
            if !traffic.is_some_and(|traffic| traffic.of_world && traffic.driver.has_ended()) {
                continue;
            }
            if let Some(pose) = self.free_beginning(town) {
                self.renew(index, town, &pose);
            }
        }
    }

    /// A free place where a road begins, from a random one on.
    fn free_beginning(&mut self, town: &Town) -> Option<Pose> {
        let mut places = town.network().sources(BEHIND_M);
        if places.is_empty() {
            places = town.network().places(PLACES_M);
        }
        let count = places.len();
        let first = (self.rng.next_u64() % count.max(1) as u64) as usize;
        let around = places.iter().cycle().skip(first).take(count);
        let free = |pose: &&Pose| {
            let bodies = self.actors.iter().filter(|actor| actor.is_solid());
            bodies.into_iter().all(|actor| {
                let there = self.pose_of(actor).translation.vector;
                let away_m = pose.inverse_transform_point(&there.into());
                away_m.x.abs() > FREE_M || away_m.y.abs() > BESIDE_M
            })
        };
        around.copied().collect::<Vec<_>>().iter().find(free).copied()
    }

    fn renew(&mut self, index: usize, town: &Town, pose: &Pose) {
        let actor = &mut self.actors[index];
        let Some(handle) = actor.rigid() else { return };
        let placed = place::on_ground(actor.blueprint(), pose, &town.ground).world_from_actor;
        actor.outside.told_mps = Vec3::zeros();
        let Some(vehicle) = actor.vehicle_mut() else { return };
        vehicle.state.set_rolling(vehicle.tuning.fit(), 0.0);
        vehicle.state.lift();
        if let Some(traffic) = vehicle.wheel.traffic_mut() {
            *traffic.driver = traffic.driver.anew();
        }
        self.physics.set_pose(handle, &placed);
        self.physics.set_velocity(handle, Vec3::zeros(), Vec3::zeros());
    }
}
