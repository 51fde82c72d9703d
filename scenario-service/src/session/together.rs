//! Episodes in worlds that several sessions share.

use std::sync::Arc;

use schemas::{CommandReply, Error, ErrorCode, SharedFrame};

use super::home::Home;
use super::shared::{self, Joined, Opened};
use super::world::EpisodeWorld;
use super::{ResetRequest, Session, SessionContext, SessionError, invalid, random_id};
use crate::episode::{Episode, Report, Start};
use crate::scenario::Scenario;

/// A world in which nothing has happened yet, and what its episode begins with.
pub(super) struct Begun {
    pub(super) start: Start,
    pub(super) frame: SharedFrame,
    pub(super) replies: Vec<CommandReply>,
}

impl Begun {
    /// The episode of one of its egos.
    ///
    /// # Errors
    /// The ego is not there.
    pub(super) fn episode(self, number: usize) -> Result<(Episode, Report), SessionError> {
        Episode::begin(self.start, self.frame, &self.replies, number)
            .ok_or_else(|| invalid("the world service made a world without the ego"))
    }

    /// Has others come into its world as the egos of these scenarios.
    ///
    /// # Errors
    /// An ego is not there.
    pub(super) fn share(
        mut self,
        world: EpisodeWorld,
        guests: Vec<Box<dyn Scenario>>,
        context: &Arc<SessionContext>,
    ) -> Result<(Episode, Home, Report), SessionError> {
        // Before the first tick, whoever asks for it.
        let opening = std::mem::take(&mut self.start.opening);
        let sharing = self.start.scenario.common().sharing;
        let scenarios = std::iter::once(self.start.scenario.clone_box()).chain(guests);
        let mut egos = Vec::new();
        for (number, scenario) in scenarios.enumerate() {
            let start = Start { scenario, ..self.start.clone() };
            let own = Self { start, frame: self.frame.clone(), replies: self.replies.clone() };
            let (episode, _) = own.episode(number)?;
            egos.push((episode.ego(), episode));
        }
        let first = egos[0].1.clone();
        let opened = Opened { world, frame: self.frame, egos, opening, sharing };
        let (participant, company) = shared::open(context, opened);
        let report = Report { company: Some(company), ..first.opened() };
        Ok((first, Home::Shared(participant), report))
    }
}

impl Session {
    /// Takes part in a world that another session has made.
    ///
    /// # Errors
    /// [`SessionError`]; the episode that was running still is.
    pub(super) async fn join(
        &mut self,
        code: &str,
        request: &ResetRequest,
    ) -> Result<Report, SessionError> {
        let other = request.scenario_name.is_some() || !request.scenario_config.is_empty();
        if other || request.seed.is_some() || request.snapshot_id.is_some() {
            let text = "who joins a world has that one's scenario, settings and seed";
            let error = Error::new(ErrorCode::InvalidArgument, text);
            return Err(SessionError::Refused(error.wanted("join and ego, and no other of these")));
        }
        let joined = self.context.shared.join(code, request.ego.as_deref()).await;
        let Joined { participant, episode, company } = joined.map_err(SessionError::Refused)?;
        let episode = episode.named(request.episode_id.clone().unwrap_or_else(random_id));
        let report = Report { company: Some(company), ..episode.opened() };
        self.go_on(episode, Home::Shared(participant));
        Ok(report)
    }
}
