//! What the sensors of a world measure at the end of a tick.

use schemas::{ActorId, ActorKind, SemanticTag, SensorDatum, StationKind, Vec3};

use crate::actor::Actor;
use crate::rays::{Sight, tag};
use crate::sensor::{Carrier, Mount, Outcome, Sensor, Station, Surroundings, Transmission};
use crate::sensors::{Readings, Sensors};
use crate::town::Town;
use crate::world::{State, World};

impl World {
    /// What sensors measured in the last tick, ordered by sensor. Nothing yet in a fork or restored
    /// world.
    pub fn sensors(&self) -> &[SensorDatum] {
        &self.readings.data
    }

    /// The cameras that take a picture of the last tick, ordered by id.
    pub fn cameras_due(&self) -> &[ActorId] {
        &self.readings.cameras_due
    }
}

impl Sensors {
    /// Whether there is one for each actor that is a sensor, with the settings of its attributes.
    pub(crate) fn is_consistent(&self, state: &State) -> bool {
        let is_sensor = |actor: &&Actor| actor.blueprint().kind() == ActorKind::Sensor;
        let mut actors = state.actors.iter().filter(is_sensor);
        let fits = |actor: &Actor| {
            let (id, attributes) = (&actor.blueprint().id, &actor.attributes);
            let number = state.number_of(actor.id.get());
            let fresh = Sensor::new(id, attributes, state.seed, number);
            let sensor = self.by_actor.get(&actor.id);
            sensor.zip(fresh.ok()).is_some_and(|(sensor, fresh)| sensor.is_used(&fresh))
        };
        state.actors.iter().filter(is_sensor).count() == self.by_actor.len() && actors.all(fits)
    }

    /// What is in the air in this tick.
    fn transmit(&mut self, state: &State, around: &Surroundings) -> Vec<Transmission> {
        let radios = self.by_actor.iter_mut().filter(|(_, sensor)| sensor.is_radio());
        let sent = radios.filter_map(|(&id, sensor)| {
            sensor.transmit(id, &state.mount_of(id)?, around, state.sim_secs)
        });
        sent.collect()
    }

    fn measure(&mut self, state: &State, town: &Town) -> Readings {
        let everybody = || state.actors_but(&[]);
        let sight = Sight::new(&town.rays, &state.hidden, &everybody);
        let velocity_mps = |id: ActorId, point_m: Vec3| state.velocity_at(id, point_m);
        let tag = |id: ActorId| state.actor(id).map_or(0, |actor| tag::of_actor(actor.blueprint()));
        let around = Surroundings {
            roads: &town.roads,
            sight: &sight,
            velocity_mps: &velocity_mps,
            tag: &tag,
            collisions: &state.collisions,
            station: &|id| state.station(id),
            air: &[],
            dt_secs: state.dt_secs,
        };
        let sim_secs = state.sim_secs;
        let air = self.transmit(state, &around);
        let around = Surroundings { air: &air, ..around };
        let mut readings = Readings::default();
        for (&id, sensor) in &mut self.by_actor {
            let Some(mount) = state.mount_of(id) else { continue };
            let ignored = sensor.ignored.clone();
            let others = || state.actors_but(&ignored);
            let own_sight = Sight::new(&town.rays, &state.hidden, &others);
            let sight = if ignored.is_empty() { &sight } else { &own_sight };
            let around = Surroundings { sight, ..around };
            match sensor.tick(id, &mount, &around, sim_secs) {
                None => {}
                Some(Outcome::Picture) => readings.cameras_due.push(id),
                Some(Outcome::Measured(measurements)) => {
                    readings.data.extend(measurements.into_iter().map(|measurement| SensorDatum {
                        sensor: id,
                        tick: state.tick,
                        sim_secs,
                        world_from_sensor: mount.world_from_sensor,
                        measurement,
                    }));
                }
            }
        }
        readings
    }
}

impl State {
    /// Lets every sensor measure that has to at the end of this tick.
    pub(crate) fn measure(&mut self, town: &Town) -> Readings {
        if self.sensors.by_actor.is_empty() {
            return Readings::default();
        }
        let mut sensors = std::mem::take(&mut self.sensors);
        let readings = sensors.measure(self, town);
        self.sensors = sensors;
        readings
    }

    /// Velocity of an actor's body at a point, world frame; zero for an actor that is not there.
    fn velocity_at(&self, id: ActorId, point_m: Vec3) -> Vec3 {
        self.actor(id).map_or(Vec3::zeros(), |actor| {
            let body = self.motion_of(actor);
            body.linear_mps + body.angular_radps.cross(&(point_m - body.centre_of_mass_m))
        })
    }

    fn mount_of(&self, id: ActorId) -> Option<Mount> {
        let actor = self.actor(id)?;
        let motion = self.motion_of(actor);
        Some(Mount {
            world_from_sensor: motion.world_from_body,
            velocity_mps: motion.linear_mps,
            angular_radps: motion.angular_radps,
            carrier: self.carrier_of(actor),
            host: actor.body.attachment().map(|attachment| attachment.parent),
        })
    }

    /// The nearest of those an actor hangs on that has a body.
    fn carrier_of(&self, actor: &Actor) -> Option<Carrier> {
        let parent_of = |actor: &Actor| self.actor(actor.body.attachment()?.parent);
        let mut parent = parent_of(actor)?;
        while parent.rigid().is_none() {
            parent = parent_of(parent)?;
        }
        Some(self.as_carrier(parent))
    }

    fn as_carrier(&self, actor: &Actor) -> Carrier {
        let blueprint = actor.blueprint();
        Carrier {
            id: actor.id,
            world_from_actor: self.pose_of(actor),
            box_centre_m: blueprint.box_centre_m(),
            box_half_m: blueprint.box_half_extent_m(),
        }
    }

    fn station(&self, id: ActorId) -> Option<Station> {
        let actor = self.actor(id)?;
        let motion = self.motion_of(actor);
        let carrier = self.as_carrier(actor);
        Some(Station {
            kind: station_kind(actor),
            has_wheels: actor.blueprint().kind() == ActorKind::Vehicle,
            lights: actor.lights,
            velocity_mps: self.velocity_at(id, carrier.world_from_actor.translation.vector),
            angular_radps: motion.angular_radps,
            carrier,
        })
    }
}

/// What an actor is for others by radio.
fn station_kind(actor: &Actor) -> StationKind {
    let blueprint = actor.blueprint();
    let special = blueprints::get(actor.blueprint).and_then(|it| it.attribute("special_type"));
    if special.is_some_and(|special| special.value == "emergency") {
        return StationKind::SpecialVehicle;
    }
    match SemanticTag::of_actor(blueprint.kind(), &blueprint.id) {
        SemanticTag::Pedestrians => StationKind::Pedestrian,
        SemanticTag::Bicycle => StationKind::Cyclist,
        SemanticTag::Motorcycle => StationKind::Motorcycle,
        SemanticTag::Car => StationKind::PassengerCar,
        SemanticTag::Bus => StationKind::Bus,
        SemanticTag::Truck => StationKind::LightTruck,
        SemanticTag::Train => StationKind::Tram,
        SemanticTag::TrafficLight | SemanticTag::TrafficSigns => StationKind::RoadSideUnit,
        _ => StationKind::Unknown,
    }
}
