//! Where an episode happens: in a world of its own, or in one that it shares.

use std::sync::Arc;

use schemas::{Error, ErrorCode, Frame};

use super::shared::Participant;
use super::world::{EpisodeWorld, Told, Trouble, Work};
use super::{SessionContext, SessionError};

pub(super) enum Home {
    Own(EpisodeWorld),
    Shared(Participant),
}

impl Home {
    /// Does something in the world, which is as `seen` shows it unless others are in it.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(super) async fn advance(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
        work: Work,
    ) -> Result<Told, Trouble> {
        match self {
            Self::Own(world) => world.advance(context, seen, work).await,
            Self::Shared(participant) => participant.advance(work).await,
        }
    }

    /// Nobody shall wait for this episode any more.
    pub(super) fn leave(&mut self) {
        if let Self::Shared(participant) = self {
            participant.leave();
        }
    }

    /// Another episode takes the place of this one.
    pub(super) fn end(&self) {
        if let Self::Shared(participant) = self {
            participant.end();
        }
    }

    pub(super) fn is_shared(&self) -> bool {
        matches!(self, Self::Shared(_))
    }

    /// Whether it is a world of its own that CARLA's clients may come into.
    pub(super) fn is_open(&self) -> bool {
        matches!(self, Self::Own(world) if world.is_open())
    }

    /// Moves the world away from a service that ends.
    ///
    /// # Errors
    /// Why it could not be; it should be tried again.
    pub(super) async fn move_away(
        &mut self,
        context: &Arc<SessionContext>,
        seen: &Frame,
    ) -> Result<(), Error> {
        match self {
            Self::Own(world) => world.move_away(context, seen).await,
            Self::Shared(participant) => participant.move_away().await,
        }
    }

    /// The state of the world.
    ///
    /// # Errors
    /// [`SessionError`]: those of the port, or that others are in it.
    pub(super) async fn snapshot(&self, context: &SessionContext) -> Result<Vec<u8>, SessionError> {
        match self {
            Self::Own(world) => world.snapshot(context).await.map_err(SessionError::World),
            Self::Shared(_) => {
                let text = "no state of a world with several egos is kept";
                let error = Error::new(ErrorCode::Unsupported, text);
                Err(SessionError::Refused(error.wanted("num_egos 1 at its reset")))
            }
        }
    }

    /// Which world, if it is not gone and nobody else is in it.
    #[cfg(test)]
    pub(super) fn id(&self) -> Option<schemas::WorldId> {
        match self {
            Self::Own(world) => world.id(),
            Self::Shared(_) => None,
        }
    }
}
