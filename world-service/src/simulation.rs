//! The crate `world` behind the port that shards step.

use std::sync::Arc;

use schemas::{ActorId, Collision, Command, CommandReply, Error, Frame, MapRef, Reply};
use schemas::{SensorDatum, Tick, WorldId};
use world::{Town, World, WorldConfig};

use crate::service::{NewWorld, Question, Simulation};

impl Simulation for World {
    type Town = Town;

    fn create(new: NewWorld<Town>) -> Result<Self, Error> {
        let NewWorld { id, epoch, seed, dt_secs, town, traffic, first_actor } = new;
        let config = WorldConfig { id, epoch, seed, dt_secs, map: town };
        let world = if traffic { Self::with_traffic(config) } else { Self::new(config) }?;
        world.numbered_from(first_actor)
    }

    fn restore(
        snapshot: &[u8],
        id: WorldId,
        epoch: u64,
        town_of: &dyn Fn(&MapRef) -> Option<Arc<Town>>,
    ) -> Result<Self, Error> {
        Self::restore(snapshot, id, epoch, town_of)
    }

    fn snapshot(&self) -> Vec<u8> {
        self.snapshot()
    }

    fn fork(&self, id: WorldId) -> Self {
        self.fork(id)
    }

    fn apply(&mut self, command: &Command) -> CommandReply {
        self.apply(command)
    }

    fn tick(&mut self, dt_secs: Option<f64>) -> Result<(), Error> {
        match dt_secs {
            None => self.tick(),
            Some(dt_secs) => self.tick_by(dt_secs),
        }
    }

    fn frame(&self) -> Frame {
        self.frame()
    }

    fn tick_number(&self) -> Tick {
        self.tick_number()
    }

    fn collisions(&self) -> &[Collision] {
        self.collisions()
    }

    fn sensors(&self) -> &[SensorDatum] {
        self.sensors()
    }

    fn cameras_due(&self) -> &[ActorId] {
        self.cameras_due()
    }

    fn answer(&self, question: &Question) -> Result<Reply, Error> {
        match question {
            Question::Actors(wanted) => Ok(Reply::Actors(self.describe(wanted))),
            Question::Vehicles(ids) => {
                let reports = ids.iter().map(|id| self.vehicle_report(*id));
                Ok(Reply::Vehicles(reports.collect::<Result<_, _>>()?))
            }
            Question::Rays(rays) => Ok(Reply::RayHits(self.cast_rays(rays)?)),
        }
    }

    fn actor_count(&self) -> usize {
        self.actor_count()
    }

    fn map(&self) -> &MapRef {
        self.map_ref()
    }

    fn map_text(&self) -> &str {
        self.map_text()
    }
}
