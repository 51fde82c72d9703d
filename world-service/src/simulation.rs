//! The crate `world` behind the port that shards step.

use std::sync::Arc;

use schemas::{Collision, Command, CommandReply, Error, ErrorCode, Frame, MapRef, Tick, WorldId};
use world::{Town, World, WorldConfig};

use crate::service::{NewWorld, Simulation};

impl Simulation for World {
    type Town = Town;

    fn create(new: NewWorld<Town>) -> Result<Self, Error> {
        let NewWorld { id, epoch, seed, dt_secs, town } = new;
        Self::new(WorldConfig { id, epoch, seed, dt_secs, map: town })
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

    fn tick(&mut self) -> Result<(), Error> {
        self.tick().map_err(|cause| Error::new(ErrorCode::WorldQuarantined, cause.to_string()))
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

    fn actor_count(&self) -> usize {
        self.actor_count()
    }

    fn map(&self) -> &MapRef {
        self.map_ref()
    }
}
