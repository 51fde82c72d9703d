//! The world port over the bus.

use schemas::{
    Camera, Error, ErrorCode, Image, MapRef, Reply, Request, ServiceId, SharedFrame, Tick,
    TickItem, TickResult, WorldId,
};
use worlds::{NewWorld, Patience, Worlds};

use super::{Answer, CreatedWorld, Sharing, WorldPort};
use crate::limits::{
    GUEST_LEASE_MILLIS, TICK_DEADLINE, TICK_DEADLINE_MAX, TICK_PATIENCE, WORLD_DEADLINE,
    WORLD_LEASE_MILLIS,
};

/// How long answers may take.
pub(crate) const PATIENCE: Patience = Patience {
    ask: WORLD_DEADLINE,
    ticks: TICK_DEADLINE,
    per_tick: TICK_PATIENCE,
    ticks_max: TICK_DEADLINE_MAX,
};

impl WorldPort for Worlds {
    fn create(&self, world: NewWorld) -> Answer<'_, CreatedWorld> {
        let request = world.request(self.lease(WORLD_LEASE_MILLIS));
        Box::pin(made(self, request))
    }

    fn branch(&self, name: String, tick: Option<Tick>) -> Answer<'_, CreatedWorld> {
        let lease = Some(self.lease(WORLD_LEASE_MILLIS));
        Box::pin(made(self, Request::BranchJournal { name, tick, lease }))
    }

    fn destroy(&self, world: WorldId) -> Answer<'_, ()> {
        Box::pin(async move { self.ask(Request::DestroyWorld { world }).await.map(drop) })
    }

    fn fork(&self, world: WorldId) -> Answer<'_, WorldId> {
        Box::pin(async move {
            let lease = Some(self.lease(WORLD_LEASE_MILLIS));
            match self.ask(Request::ForkWorld { world, count: 1, lease }).await? {
                Reply::Forked(forks) => forks.first().copied().ok_or_else(|| unexpected("a fork")),
                _ => Err(unexpected("a fork")),
            }
        })
    }

    fn snapshot(&self, world: WorldId) -> Answer<'_, Vec<u8>> {
        Box::pin(async move {
            match self.ask(Request::SnapshotWorld { world }).await? {
                Reply::Snapshot(bytes) => Ok(bytes),
                _ => Err(unexpected("a snapshot")),
            }
        })
    }

    fn restore(&self, snapshot: Vec<u8>) -> Answer<'_, CreatedWorld> {
        let lease = Some(self.lease(WORLD_LEASE_MILLIS));
        Box::pin(made(self, Request::RestoreWorld { snapshot, lease }))
    }

    fn should_move(&self, world: WorldId) -> bool {
        self.hosts().should_move(world)
    }

    fn owned(&self) -> Answer<'_, Vec<WorldId>> {
        Box::pin(Worlds::owned(self))
    }

    fn is_gone(&self, world: WorldId) -> bool {
        self.hosts().is_gone(world)
    }

    fn share_clock(&self, sharing: Sharing) -> Answer<'_, ServiceId> {
        Box::pin(async move {
            let Sharing { world, stands_for, guests } = sharing;
            let name = self.lease(WORLD_LEASE_MILLIS).owner;
            let own = std::iter::once((name.clone(), u32::MAX));
            let guests = guests.into_iter().map(|guest| (guest, GUEST_LEASE_MILLIS));
            for (participant, lease_millis) in own.chain(guests) {
                self.ask(Request::ShareClock { world, participant, lease_millis, stands_for })
                    .await?;
            }
            Ok(name)
        })
    }

    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>> {
        Box::pin(Worlds::tick(self, items))
    }

    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Answer<'_, Vec<Image>> {
        Box::pin(Worlds::draw(self, frame, cameras, schemas::Staging::default()))
    }

    fn maps(&self) -> Answer<'_, Vec<MapRef>> {
        Box::pin(Worlds::maps(self))
    }

    fn map_text(&self, digest: String) -> Answer<'_, Vec<u8>> {
        Box::pin(async move { Worlds::map_text(self, &digest).await })
    }
}

async fn made(worlds: &Worlds, request: Request) -> Result<CreatedWorld, Error> {
    match worlds.ask(request).await? {
        Reply::WorldCreated { world, frame, replies } => Ok(CreatedWorld { world, frame, replies }),
        _ => Err(unexpected("a new world")),
    }
}

fn unexpected(wanted: &str) -> Error {
    Error::new(ErrorCode::InvalidMessage, "the world service answered something else")
        .wanted(wanted)
}
