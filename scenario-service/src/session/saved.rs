//! States of episodes that are kept to go on from, several times: for trainers who try what comes
//! of different actions from one beginning. A sealed episode knows nothing of them.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use schemas::{Error, ErrorCode, Tick};
use serde_json::{Map, Value};
use worlds::{Maker as _, Seen, State};

use super::home::Home;
use super::recovery::FreshWorlds;
use super::world::EpisodeWorld;
use super::{ResetRequest, Running, Session, SessionError, decode, invalid, random_id};
use crate::episode::{Episode, Report, SavedState};
use crate::limits::{SAVED_BYTES_MAX, SAVED_IDLE, SAVED_MAX};
use crate::scenario::Scenario;

/// What a trainer asks for in the metadata of an action; anything else there is not ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operation<'a> {
    /// Keeps the present state.
    Snapshot,
    /// Gives one up.
    Forget(&'a str),
}

impl<'a> Operation<'a> {
    pub(super) fn of(metadata: &'a Map<String, Value>) -> Option<Self> {
        match metadata.get("op")?.as_str()? {
            "snapshot" => Some(Self::Snapshot),
            "forget" => {
                let id = metadata.get("snapshot_id").and_then(Value::as_str);
                Some(Self::Forget(id.unwrap_or_default()))
            }
            _ => None,
        }
    }
}

/// The states that a tenant's sessions keep, oldest first. Whoever of the tenant knows the id of
/// one may go on from it.
#[derive(Default)]
pub(crate) struct SavedStates(Mutex<Vec<Kept>>);

struct Kept {
    saved: Saved,
    used: Instant,
}

/// An episode with its world, and the settings of its session.
#[derive(Clone)]
pub(crate) struct Saved {
    id: String,
    episode: Episode,
    world: Vec<u8>,
    scenario: Box<dyn Scenario>,
    built_from: String,
}

impl Saved {
    /// The tick and hash of its world.
    pub(crate) fn state(&self) -> (Tick, u64) {
        (self.episode.frame().tick, self.episode.frame().state_hash)
    }

    /// What it takes up.
    pub(crate) fn bytes(&self) -> usize {
        self.world.len()
    }
}

impl SavedStates {
    /// Keeps a state; the oldest go where there is no room.
    fn keep(&self, saved: Saved, now: Instant) -> SavedState {
        let told = SavedState { id: saved.id.clone(), bytes: saved.bytes() };
        let mut kept = self.lock(now);
        kept.push(Kept { saved, used: now });
        while kept.len() > SAVED_MAX || bytes(&kept) > SAVED_BYTES_MAX && kept.len() > 1 {
            kept.remove(0);
        }
        told
    }

    fn copy(&self, id: &str, now: Instant) -> Option<Saved> {
        let mut kept = self.lock(now);
        let found = kept.iter_mut().find(|kept| kept.saved.id == id)?;
        found.used = now;
        Some(found.saved.clone())
    }

    /// Id, size and time without use of each, oldest first.
    pub(crate) fn list(&self, now: Instant) -> Vec<(String, usize, Duration)> {
        let told = |kept: &Kept| {
            let idle = now.saturating_duration_since(kept.used);
            (kept.saved.id.clone(), kept.saved.bytes(), idle)
        };
        self.lock(now).iter().map(told).collect()
    }

    /// Whether there was one.
    pub(crate) fn forget(&self, id: &str, now: Instant) -> bool {
        let mut kept = self.lock(now);
        let before = kept.len();
        kept.retain(|kept| kept.saved.id != id);
        kept.len() < before
    }

    /// Without those that nobody has asked for in a long time.
    fn lock(&self, now: Instant) -> MutexGuard<'_, Vec<Kept>> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|kept| now.saturating_duration_since(kept.used) < SAVED_IDLE);
        kept
    }
}

fn bytes(kept: &[Kept]) -> usize {
    kept.iter().map(|kept| kept.saved.bytes()).sum()
}

impl Session {
    /// Does what the metadata of an action asks for beside the episode. No time passes, and no step
    /// is counted.
    ///
    /// # Errors
    /// [`SessionError`]; nothing has changed.
    pub(super) async fn operate(
        &mut self,
        operation: Operation<'_>,
    ) -> Result<Report, SessionError> {
        self.unless_sealed()?;
        if let Operation::Forget(id) = operation {
            return match self.context.saved.forget(id, Instant::now()) {
                true => Ok(Report { reward: Some(0.0), ..Report::default() }),
                false => Err(SessionError::Refused(unknown(id))),
            };
        }
        let saved = self.saved().await?;
        let told = self.keep(saved);
        Ok(Report { reward: Some(0.0), saved: Some(told), ..Report::default() })
    }

    /// The present state. No time passes.
    ///
    /// # Errors
    /// [`SessionError`]; nothing has changed.
    pub(crate) async fn saved(&mut self) -> Result<Saved, SessionError> {
        self.unless_sealed()?;
        if matches!(self.running, Running::Nothing) {
            let error = Error::new(ErrorCode::InvalidArgument, "the session has no episode yet");
            return Err(SessionError::Refused(error.wanted("a reset before a snapshot")));
        }
        let (episode, world) = self.running.episode()?;
        let world = world.snapshot(&self.context).await?;
        Ok(Saved {
            id: random_id(),
            episode: episode.clone(),
            world,
            scenario: self.scenario.clone_box(),
            built_from: self.built_from.clone(),
        })
    }

    /// Keeps a state for whoever of the tenant knows its id.
    pub(crate) fn keep(&self, saved: Saved) -> SavedState {
        self.context.saved.keep(saved, Instant::now())
    }

    /// Goes on from a state that was kept.
    ///
    /// # Errors
    /// [`SessionError`]; the episode that was running still is.
    pub(super) async fn resume(
        &mut self,
        id: &str,
        request: &ResetRequest,
    ) -> Result<Report, SessionError> {
        self.unless_sealed()?;
        let other = request.scenario_name.is_some() || !request.scenario_config.is_empty();
        if other || request.seed.is_some() {
            let error = "an episode from a snapshot has that one's scenario, settings and seed";
            let error = Error::new(ErrorCode::InvalidArgument, error);
            return Err(SessionError::Refused(error.wanted("snapshot_id, and no other of these")));
        }
        let saved = self.context.saved.copy(id, Instant::now());
        let saved = saved.ok_or_else(|| SessionError::Refused(unknown(id)))?;
        self.go_on_from(saved, request.episode_id.clone()).await
    }

    /// Goes on from a state, in a world of its own.
    ///
    /// # Errors
    /// [`SessionError`]; the episode that was running still is.
    pub(crate) async fn go_on_from(
        &mut self,
        saved: Saved,
        episode_id: Option<String>,
    ) -> Result<Report, SessionError> {
        let begun = Instant::now();
        let Saved { id, mut episode, world, scenario, built_from } = saved;
        let base = State::Snapshot(world);
        let (frame, world) =
            FreshWorlds(&self.context).make(&base).await.map_err(SessionError::World)?;
        let frame = decode(frame)?;
        let seen = match scenario.common().open_to_carla {
            true => Seen::WithOthers(episode.frame()),
            false => Seen::Alone(episode.frame()),
        };
        if !seen.fits(&frame) {
            return Err(invalid("the world of a snapshot is not as it was"));
        }
        episode.resume(frame, id, episode_id.unwrap_or_else(random_id));
        let mut world = EpisodeWorld::new(world, Some(base), &self.context).await;
        if scenario.common().open_to_carla {
            world.open(&self.context).await.map_err(SessionError::World)?;
        }
        let carla_world = world.carla_world();
        self.scenario = scenario;
        self.built_from = built_from;
        self.go_on(episode, Home::Own(world));
        self.context.figures.reset_seconds.observe(begun.elapsed());
        Ok(Report { carla_world, ..Report::default() })
    }

    fn unless_sealed(&self) -> Result<(), SessionError> {
        if !self.scenario.common().sealed {
            return Ok(());
        }
        let error = Error::new(ErrorCode::Unsupported, "SEALED: no snapshot of a sealed episode");
        Err(SessionError::Refused(error.wanted("scenario_config.sealed false at its reset")))
    }
}

fn unknown(id: &str) -> Error {
    let kept = format!(
        "the id of one that is kept: {SAVED_MAX} at most, of {} MiB in all, for {} s without use",
        SAVED_BYTES_MAX >> 20,
        SAVED_IDLE.as_secs()
    );
    Error::new(ErrorCode::UnknownAsset, "there is no such snapshot").wanted(kept).found(id)
}
