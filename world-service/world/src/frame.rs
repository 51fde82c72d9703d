//! The public picture of a world, and the number that stands for its state.

use schemas::{
    ActorId, ActorState, Frame, HiddenScenery, Paint, RulesBroken, TrafficLightState, Weather,
};

use crate::actor::Vehicle;
use crate::blueprint;
use crate::hash::Hasher;
use crate::traffic::Broken;
use crate::walker::Errand;
use crate::world::World;

impl World {
    /// The present state.
    pub fn frame(&self) -> Frame {
        let mut types: Vec<String> =
            if self.fixed_count() == 0 { Vec::new() } else { self.town.traffic.types().to_vec() };
        let mut type_of = vec![None; blueprint::all().len()];
        let mut actors: Vec<ActorState> = Vec::with_capacity(self.actor_count());
        actors.extend(self.fixed_actors().map(|(_, actor)| actor));
        for actor in &self.state.actors {
            let slot = &mut type_of[usize::from(actor.blueprint)];
            let type_index = *slot.get_or_insert_with(|| {
                types.push(actor.blueprint().id.clone());
                // Fewer blueprints than u16 values exist.
                (types.len() - 1) as u16
            });
            actors.push(actor.state(&self.state.motion_of(actor), type_index));
        }
        // By id: those that were given lower ones stand before the lights and signs.
        let fixed = self.fixed_count();
        let first = self.state.first_actor;
        let lower = self.state.actors.partition_point(|actor| actor.id < first);
        actors[..fixed + lower].rotate_left(fixed);
        Frame {
            world: self.id,
            tick: self.state.tick,
            epoch: self.epoch,
            dt_secs: self.state.dt_secs,
            state_hash: self.state_hash(),
            seed: self.state.seed,
            map: self.map_ref().clone(),
            weather: self.state.weather,
            types,
            actors,
            collisions: self.state.collisions.clone(),
            traffic_lights: self.traffic_lights(),
            agents: self.state.agents(),
            hidden: self.state.hidden.clone(),
            paint: self.state.paint.told(),
            halted: self.state.halted.clone(),
            rules_broken: self.broken(),
            walker_poses: self.state.walker_poses.clone(),
            sim_secs: self.state.sim_secs,
        }
    }

    fn broken(&self) -> Vec<RulesBroken> {
        let all = self.rules_broken().filter(|(_, broken)| *broken != Broken::default());
        let told = all.map(|(actor, broken)| {
            let Broken { red_lights, stop_signs, right_of_way, crossings } = broken;
            RulesBroken { actor, red_lights, stop_signs, right_of_way, crossings }
        });
        told.collect()
    }

    /// One spawned actor as [`frame`](Self::frame) tells it, without the cost of a frame; its
    /// `type_index` is 0. `None` for others, and for the town's lights and signs.
    pub fn actor(&self, id: ActorId) -> Option<ActorState> {
        let actor = self.state.actors.get(self.state.index_of(id).ok()?)?;
        Some(actor.state(&self.state.motion_of(actor), 0))
    }

    fn traffic_lights(&self) -> Vec<TrafficLightState> {
        let plan = &self.town.traffic;
        let Some(lights) = &self.state.traffic else { return Vec::new() };
        let ids = (0..).map(|position| self.state.first_actor.plus(position));
        let lights_with_ids = (0..plan.light_count()).zip(ids);
        lights_with_ids.filter_map(|(light, id)| lights.state(plan, light, id)).collect()
    }

    /// A number that is equal for equal states and, but for chance, different for different ones.
    ///
    /// - **Domain:** everything that moves or decides: tick, random generator, weather, lights,
    ///   what is hidden or painted, bodies, wheels, controls, pilots, agents, traffic, what lights
    ///   and signs say to vehicles, and how walkers are posed. Not the world's id and epoch, so
    ///   that forks agree.
    /// - **Determinism:** over bits in a fixed order, actors by id, -0.0 as +0.0; xxh3-64.
    pub fn state_hash(&self) -> u64 {
        let state = &self.state;
        let mut hasher = Hasher::new();
        hasher.integers([state.tick.0, state.seed, state.rng.state(), state.next_actor.into()]);
        let step = &state.step;
        for secs in [state.dt_secs, state.sim_secs, step.dt_secs, step.substep_secs_max] {
            hasher.real(secs);
        }
        hasher.integers([step.substeps_max.into()]);
        hasher.floats(weather_values(&state.weather));
        if let Some(radius_m) = state.hybrid_m {
            hasher.floats([radius_m]);
        }
        if state.hidden != HiddenScenery::default() {
            hasher.value(&state.hidden);
        }
        if !state.paint.is_none() {
            let Paint { textures, coats } = state.paint.told();
            hasher.value(&(textures, coats));
        }
        if !state.halted.is_empty() {
            hasher.value(&state.halted);
        }
        if !state.walker_poses.is_empty() {
            hasher.value(&state.walker_poses);
        }
        if let Some(lights) = &state.traffic {
            hasher.value(lights);
        }
        for actor in &state.actors {
            let body = state.motion_of(actor);
            hasher.integers([
                actor.id.get().into(),
                actor.blueprint.into(),
                actor.colour_rgb.into(),
                actor.lights.into(),
                actor.doors.into(),
                actor.switches.bits(),
                actor.body.attachment().map_or(0, |to| to.parent.get().into()),
                body.asleep.into(),
            ]);
            hasher.floats(body.world_from_body.translation.vector.data.0[0]);
            hasher.floats(body.world_from_body.rotation.coords.data.0[0]);
            hasher.floats(body.linear_mps.data.0[0]);
            hasher.floats(body.angular_radps.data.0[0]);
            hasher.floats(actor.outside.values());
            if let Some(walker) = actor.walker.as_deref() {
                hasher.floats(walker.values());
                match &walker.errand {
                    Some(Errand::Strolls(stroller)) => hasher.value(stroller),
                    Some(Errand::Follows(trajectory)) => hasher.value(trajectory),
                    None => {}
                }
            }
            if let Some(vehicle) = actor.vehicle.as_deref() {
                hash_vehicle(vehicle, &mut hasher);
            }
        }
        state.sensors.hash(&mut hasher);
        hasher.finish()
    }
}

fn hash_vehicle(vehicle: &Vehicle, hasher: &mut Hasher) {
    hasher.floats(vehicle.state.values().chain([vehicle.tipped_secs]));
    hasher.value(&vehicle.wheel.pilot());
    if let Some(agent) = &vehicle.agent {
        hasher.value(&(vehicle.wheel.is_agent(), agent));
    }
    if let Some(traffic) = vehicle.wheel.traffic() {
        hasher.value(traffic);
    }
    hasher.value(&vehicle.rules);
    vehicle.ackermann.hash(vehicle.wheel.ackermann(), hasher);
    hasher.value(&vehicle.tuning);
    hasher.value(&vehicle.hold());
    hasher.value(&vehicle.altered);
}

fn weather_values(weather: &Weather) -> [f32; 14] {
    [
        weather.cloudiness_percent,
        weather.precipitation_percent,
        weather.precipitation_deposits_percent,
        weather.wind_intensity_percent,
        weather.sun_azimuth_rad,
        weather.sun_altitude_rad,
        weather.fog_density_percent,
        weather.fog_distance_m,
        weather.wetness_percent,
        weather.fog_falloff,
        weather.scattering_intensity,
        weather.mie_scattering_scale,
        weather.rayleigh_scattering_scale,
        weather.dust_storm_percent,
    ]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use schemas::{Command, TrafficCommand, WorldId};

    use super::*;
    use crate::{Town, WorldConfig};

    type Change = fn(&mut Vehicle);

    /// Ways to change a vehicle of traffic so that it goes on otherwise.
    const CHANGES: [(&str, Change); 3] = [
        ("whose it is", |vehicle| {
            let traffic = vehicle.wheel.traffic_mut().unwrap();
            traffic.of_world = !traffic.of_world;
        }),
        ("whether it has dynamics", |vehicle| {
            let traffic = vehicle.wheel.traffic_mut().unwrap();
            traffic.on_rails = !traffic.on_rails;
        }),
        ("what lights and signs say to it", |vehicle| vehicle.rules.speed_limit_mps += 1.0),
    ];

    #[test]
    fn worlds_that_go_on_otherwise_have_other_hashes() {
        let text = roads::town::build("Town02_Opt").unwrap();
        let map = Arc::new(roads::Map::parse("Town02_Opt", &text).unwrap());
        let id = WorldId::new(1).unwrap();
        let map = Arc::new(Town::new(map));
        let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map };
        let mut world = World::with_traffic(config).unwrap();
        let spawn = TrafficCommand::Spawn { count: 1, behaviour: None };
        world.apply(&Command::Traffic(spawn)).unwrap();
        for (what, change) in CHANGES {
            let mut other = world.fork(id);
            assert_eq!(other.state_hash(), world.state_hash());
            change(other.state.actors[0].vehicle_mut().unwrap());
            assert_ne!(other.state_hash(), world.state_hash(), "{what}");
        }
    }
}
