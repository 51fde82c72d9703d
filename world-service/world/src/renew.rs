//! Where a road ends: traffic of the world's own begins anew where a road begins.

use schemas::{Pose, Vec3};

use crate::place;
use crate::town::Town;
use crate::world::State;

/// A place counts as free when nobody is nearer along its lane...
const FREE_M: f32 = 14.0;
/// ...and beside its middle, and so far above or below it, as on a bridge.
const BESIDE_M: f32 = 2.4;
const STOREY_M: f32 = 4.0;

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
            match self.free_beginning(town) {
                Some(pose) => self.renew(index, town, &pose),
                None => self.wait_on(index),
            }
        }
    }

    /// A free place where a road begins, from a random one on.
    fn free_beginning(&mut self, town: &Town) -> Option<Pose> {
        let places = town.beginnings();
        let first = (self.rng.next_u64() % places.len().max(1) as u64) as usize;
        let solid = || self.actors.iter().filter(|actor| actor.is_solid());
        let bodies: Vec<Vec3> =
            solid().map(|actor| self.pose_of(actor).translation.vector).collect();
        let free = |pose: &&Pose| bodies.iter().all(|there_m| leaves_free(pose, there_m));
        places.iter().cycle().skip(first).take(places.len()).find(free).copied()
    }

    /// Lets the driver of a vehicle stand for a while before it asks again.
    fn wait_on(&mut self, index: usize) {
        let vehicle = self.actors[index].vehicle_mut();
        if let Some(traffic) = vehicle.and_then(|vehicle| vehicle.wheel.traffic_mut()) {
            traffic.driver.wait_on();
        }
    }

    fn renew(&mut self, index: usize, town: &Town, pose: &Pose) {
        let actor = &mut self.actors[index];
        let Some(handle) = actor.rigid() else { return };
        let placed = place::on_ground(actor.blueprint(), pose, &town.ground).world_from_actor;
        actor.outside.told_mps = Vec3::zeros();
        let Some(vehicle) = actor.vehicle_mut() else { return };
        vehicle.state.set_rolling(vehicle.tuning.fit(), 0.0);
        vehicle.state.lift();
        vehicle.rules.put();
        if let Some(traffic) = vehicle.wheel.traffic_mut() {
            *traffic.driver = traffic.driver.anew();
        }
        self.physics.set_pose(handle, &placed);
        self.physics.set_velocity(handle, Vec3::zeros(), Vec3::zeros());
    }
}

/// Whether a body there is far enough from a place.
fn leaves_free(place: &Pose, there_m: &Vec3) -> bool {
    let away_m = place.inverse_transform_point(&(*there_m).into());
    away_m.x.abs() > FREE_M || away_m.y.abs() > BESIDE_M || away_m.z.abs() > STOREY_M
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use schemas::{Command, TrafficCommand, WorldId};

    use super::*;
    use crate::{World, WorldConfig};

    #[test]
    fn who_is_near_on_the_same_storey_takes_a_place() {
        let place = schemas::level_pose(Vec3::new(100.0, 50.0, 2.0), 0.0);
        let is_free = |x_m: f32, y_m: f32, z_m: f32| {
            leaves_free(&place, &(place.translation.vector + Vec3::new(x_m, y_m, z_m)))
        };
        assert!(!is_free(0.0, 0.0, 0.0) && !is_free(-13.0, 2.0, 1.0));
        assert!(is_free(15.0, 0.0, 0.0) && is_free(0.0, -3.0, 0.0));
        assert!(is_free(0.0, 0.0, -6.0), "below a bridge");
    }

    #[test]
    fn whoever_begins_anew_is_put_there_and_runs_no_sign_by_it() {
        let text = roads::town::build("Town02_Opt").unwrap();
        let roads = Arc::new(roads::Map::parse("Town02_Opt", &text).unwrap());
        let (id, map) = (WorldId::new(1).unwrap(), Arc::new(Town::new(roads)));
        let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: Arc::clone(&map) };
        let mut world = World::with_traffic(config).unwrap();
        let spawn = TrafficCommand::Spawn { count: 1, behaviour: None };
        world.apply(&Command::Traffic(spawn)).unwrap();
        let rules = |world: &World| world.state.actors[0].vehicle.as_deref().unwrap().rules;
        let mut wanted = rules(&world);
        wanted.put();
        assert_ne!(rules(&world), wanted);
        world.state.renew(0, &map, &map.beginnings()[0]);
        assert_eq!(rules(&world), wanted);
    }
}
