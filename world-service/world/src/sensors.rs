//! The sensors of a world and what they gave in the last tick.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use schemas::{ActorId, ActorKind, Error, ErrorCode, SensorDatum, Vec3};
use serde::{Deserialize, Serialize};

use crate::actor::Actor;
use crate::hash::Hasher;
use crate::rays::{RayScene, tag};
use crate::sensor::{Carrier, Mount, Outcome, Sensor, Surroundings};
use crate::town::Town;
use crate::world::{State, World};

/// All sensors, by their actors.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sensors {
    by_actor: BTreeMap<ActorId, Sensor>,
}

/// What sensors gave in one tick.
#[derive(Debug, Default)]
pub(crate) struct Readings {
    /// Ordered by sensor.
    data: Vec<SensorDatum>,
    /// Ordered by id.
    cameras_due: Vec<ActorId>,
}

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
    pub(crate) fn insert(&mut self, id: ActorId, sensor: Sensor) {
        self.by_actor.insert(id, sensor);
    }

    pub(crate) fn remove(&mut self, id: ActorId) {
        self.by_actor.remove(&id);
    }

    /// # Errors
    /// `InvalidArgument` for an actor that is no sensor.
    pub(crate) fn listen(&mut self, id: ActorId, on: bool) -> Result<(), Error> {
        let sensor = self.by_actor.get_mut(&id).ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the actor measures nothing")
                .wanted("a sensor")
                .found(id)
        })?;
        sensor.listening = on;
        Ok(())
    }

    pub(crate) fn hash(&self, hasher: &mut Hasher) {
        for sensor in &self.by_actor {
            hasher.value(&sensor);
        }
    }

    /// Whether there is one for each actor that is a sensor, with the settings of its attributes.
    pub(crate) fn is_consistent(&self, state: &State) -> bool {
        let is_sensor = |actor: &&Actor| actor.blueprint().kind() == ActorKind::Sensor;
        let mut actors = state.actors.iter().filter(is_sensor);
        let fits = |actor: &Actor| {
            let (id, attributes) = (&actor.blueprint().id, &actor.attributes);
            let fresh = Sensor::new(id, attributes, state.seed, actor.id);
            let sensor = self.by_actor.get(&actor.id);
            sensor.zip(fresh.ok()).is_some_and(|(sensor, fresh)| sensor.is_used(&fresh))
        };
        state.actors.iter().filter(is_sensor).count() == self.by_actor.len() && actors.all(fits)
    }

    fn measure(&mut self, state: &State, town: &Town) -> Readings {
        let bodies = OnceCell::new();
        let rays = || RayScene {
            town: &town.rays,
            hidden: &state.hidden,
            bodies: bodies.get_or_init(|| state.solids()),
        };
        let velocity_mps = |id: ActorId, point_m: Vec3| state.velocity_at(id, point_m);
        let tag = |id: ActorId| state.actor(id).map_or(0, |actor| tag::of_actor(actor.blueprint()));
        let around = Surroundings {
            roads: &town.roads,
            rays: &rays,
            velocity_mps: &velocity_mps,
            tag: &tag,
            collisions: &state.collisions,
            dt_secs: state.dt_secs,
        };
        let sim_secs = state.sim_secs;
        let mut readings = Readings::default();
        for (&id, sensor) in &mut self.by_actor {
            let Some(mount) = state.mount_of(id) else { continue };
            match sensor.tick(&mount, &around, sim_secs) {
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
        })
    }

    /// The nearest of those an actor hangs on that has a body.
    fn carrier_of(&self, actor: &Actor) -> Option<Carrier> {
        let parent_of = |actor: &Actor| self.actor(actor.body.attachment()?.parent);
        let mut parent = parent_of(actor)?;
        while parent.rigid().is_none() {
            parent = parent_of(parent)?;
        }
        let blueprint = parent.blueprint();
        Some(Carrier {
            id: parent.id,
            world_from_actor: self.pose_of(parent),
            box_centre_m: blueprint.box_centre_m(),
            box_half_m: blueprint.box_half_extent_m(),
        })
    }
}
