//! Where the worlds of episodes are made again.

use std::sync::Arc;

use schemas::{EncodedFrame, Error, ErrorCode, TickItem, WorldId};
use worlds::{Maker, State};

use super::SessionContext;
use crate::world_port::CreatedWorld;
use crate::world_port::collector::OwnedWorld;

/// Makes worlds for the sessions of one tenant.
pub(super) struct FreshWorlds<'a>(pub(super) &'a Arc<SessionContext>);

impl Maker for FreshWorlds<'_> {
    type World = OwnedWorld;

    /// Runs to its end even if the caller is cancelled, so that no world is made that nobody owns.
    async fn make(&self, state: &State) -> Result<(EncodedFrame, OwnedWorld), Error> {
        let (context, state) = (Arc::clone(self.0), state.clone());
        let made = tokio::spawn(async move {
            let CreatedWorld { world, frame, .. } = match state {
                State::New(new) => context.port.create(new).await?,
                State::Snapshot(bytes) => context.port.restore(bytes).await?,
            };
            Ok((frame, context.collector.keep(world)))
        });
        let interrupted =
            |_| Err(Error::new(ErrorCode::Internal, "making a world again was interrupted"));
        made.await.unwrap_or_else(interrupted)
    }

    fn id(world: &OwnedWorld) -> WorldId {
        world.id()
    }

    async fn tick(&self, item: TickItem) -> Result<EncodedFrame, Error> {
        Ok(self.0.ticker.tick(item).await?.frame)
    }
}
