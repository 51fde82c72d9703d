//! The sensors of a world and what they gave in the last tick.

use std::collections::BTreeMap;

use schemas::{ActorId, Error, ErrorCode, SensorDatum};
use serde::{Deserialize, Serialize};

use crate::hash::Hasher;
use crate::sensor::Sensor;

/// All sensors, by their actors.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sensors {
    pub by_actor: BTreeMap<ActorId, Sensor>,
}

/// What sensors gave in one tick.
#[derive(Debug, Default)]
pub(crate) struct Readings {
    /// Ordered by sensor.
    pub data: Vec<SensorDatum>,
    /// Ordered by id.
    pub cameras_due: Vec<ActorId>,
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
        self.get_mut(id)?.listening = on;
        Ok(())
    }

    /// # Errors
    /// `InvalidArgument` for an actor that is no sensor.
    pub(crate) fn ignore(&mut self, id: ActorId, vehicles: &[ActorId]) -> Result<(), Error> {
        self.get_mut(id)?.ignored = vehicles.to_vec();
        Ok(())
    }

    fn get_mut(&mut self, id: ActorId) -> Result<&mut Sensor, Error> {
        self.by_actor.get_mut(&id).ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the actor measures nothing")
                .wanted("a sensor")
                .found(id)
        })
    }

    pub(crate) fn hash(&self, hasher: &mut Hasher) {
        for sensor in &self.by_actor {
            hasher.value(&sensor);
        }
    }

    /// Gives a V2X sensor a text to send in the next tick.
    ///
    /// # Errors
    /// `InvalidArgument` for an actor that sends no texts, `TooLarge` and `Capacity` for too much.
    pub(crate) fn send(&mut self, id: ActorId, text: &str) -> Result<(), Error> {
        let sensor = self.by_actor.get_mut(&id).ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the actor sends nothing")
                .wanted("a sensor.other.v2x_custom")
                .found(id)
        })?;
        sensor.send(text)
    }
}
