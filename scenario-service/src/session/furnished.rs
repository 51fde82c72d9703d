//! How the world of a new episode comes about.

use std::sync::Arc;

use schemas::{ActorId, CommandReply, SharedFrame};
use worlds::{NewWorld, State};

use super::origin::Origin;
use super::{Session, SessionError, decode, invalid};
use crate::scenario::WorldSpec;
use crate::world_port::collector::OwnedWorld;
use crate::world_port::{CreatedWorld, DT_SECS};

/// A world with its first frame, and the replies to what furnished it.
pub(super) type Furnished = (SharedFrame, Vec<CommandReply>, OwnedWorld);

impl Session {
    /// A new world for a scenario, and from what it can be made again.
    pub(super) async fn furnished(
        &self,
        map: String,
        seed: u64,
        spec: &WorldSpec,
    ) -> Result<(Furnished, Option<State>), SessionError> {
        let new = NewWorld {
            map,
            seed,
            dt_secs: DT_SECS,
            commands: spec.commands(),
            traffic: spec.signals,
            first_actor: ActorId::FIRST,
        };
        self.context.may_spawn(self.quotas, &new.commands)?;
        let (created, world) = self.create(new.clone()).await?;
        Ok(((decode(created.frame)?, created.replies, world), Some(State::New(new))))
    }

    pub(super) async fn branched(&self, origin: &Origin) -> Result<Furnished, SessionError> {
        let (created, world) = origin.branch(&self.context).await?;
        let frame = decode(created.frame)?;
        let replies = origin.replies(&frame)?;
        Ok((frame, replies, world))
    }

    /// Runs to its end even if the caller is cancelled, so that no world is made that nobody owns.
    async fn create(&self, new: NewWorld) -> Result<(CreatedWorld, OwnedWorld), SessionError> {
        let context = Arc::clone(&self.context);
        let created = tokio::spawn(async move {
            let created = context.port.create(new).await?;
            let world = context.collector.keep(created.world);
            Ok((created, world))
        });
        let created = created.await.map_err(|_| invalid("making a world was interrupted"))?;
        created.map_err(SessionError::World)
    }
}
