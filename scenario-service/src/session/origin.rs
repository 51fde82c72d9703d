//! A recorded state in which an episode begins.

use std::sync::Arc;

use schemas::{ActorId, ActorKind, CommandReply, Error, ErrorCode, Frame, Tick};

use super::{SessionContext, SessionError};
use crate::scenario::{Overrides, ScenarioError, WorldSpec};
use crate::world_port::CreatedWorld;
use crate::world_port::collector::OwnedWorld;

/// Of the frame in which an episode of one begins, for its replies.
const REPLIES: usize = WorldSpec::EGO_COMMAND + 1;

/// Which state of which journal.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Origin {
    /// In the folder of the tenant.
    pub(crate) journal: String,
    /// After which tick; `None`: the last one.
    pub(crate) tick: Option<Tick>,
    /// The vehicle under control; `None`: the first one.
    ego: Option<ActorId>,
}

impl Origin {
    /// What a reset asks for, if it does.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for a value outside its domain.
    pub(crate) fn of(overrides: &mut Overrides<'_>) -> Result<Option<Self>, ScenarioError> {
        let (mut journal, mut tick, mut ego) = (String::new(), u32::MAX, 0);
        overrides.text("recording", &mut journal)?;
        overrides.integer("recording_tick", &mut tick, 0, u32::MAX - 1)?;
        overrides.integer("recording_ego", &mut ego, 1, u32::MAX)?;
        let tick = Some(tick).filter(|tick| *tick != u32::MAX).map(|tick| Tick(tick.into()));
        let ego = ActorId::new(ego);
        Ok((!journal.is_empty()).then_some(Self { journal, tick, ego }))
    }

    /// Makes the world; to its end even if the caller is cancelled, so that nobody leaves one that
    /// nobody owns.
    pub(super) async fn branch(
        &self,
        context: &Arc<SessionContext>,
    ) -> Result<(CreatedWorld, OwnedWorld), SessionError> {
        let (context, origin) = (Arc::clone(context), self.clone());
        let made = tokio::spawn(async move {
            let created = context.port.branch(origin.journal, origin.tick).await?;
            let world = context.collector.keep(created.world);
            Ok((created, world))
        });
        let made = made.await.map_err(|_| super::invalid("making a world was interrupted"))?;
        made.map_err(|error: Error| {
            let is_callers_fault = matches!(
                error.code,
                ErrorCode::UnknownAsset
                    | ErrorCode::WrongTick
                    | ErrorCode::InvalidArgument
                    | ErrorCode::InvalidMessage
                    | ErrorCode::Unsupported
            );
            if is_callers_fault { SessionError::Refused(error) } else { SessionError::World(error) }
        })
    }

    /// As if the commands that furnish a world had been replied to.
    pub(super) fn replies(&self, frame: &Frame) -> Result<Vec<CommandReply>, SessionError> {
        let is_vehicle =
            |id: &ActorId| frame.actor(*id).is_some_and(|actor| actor.kind == ActorKind::Vehicle);
        let ids = || frame.actors.iter().map(|actor| actor.id);
        let ego = match self.ego {
            Some(id) => Some(id).filter(is_vehicle),
            None => ids().find(is_vehicle),
        };
        let mut replies: Vec<CommandReply> = vec![Ok(None); REPLIES];
        match (ego, replies.last_mut()) {
            (Some(ego), Some(last)) => *last = Ok(Some(ego)),
            _ => {
                let wanted = self.ego.map_or("any".to_owned(), |ego| ego.to_string());
                let vehicles: Vec<String> =
                    ids().filter(is_vehicle).take(20).map(|id| id.get().to_string()).collect();
                let text = "the recording has no such vehicle at this tick";
                let error = Error::new(ErrorCode::UnknownActor, text).wanted(wanted);
                return Err(SessionError::Refused(error.found(vehicles.join(", "))));
            }
        }
        Ok(replies)
    }
}
