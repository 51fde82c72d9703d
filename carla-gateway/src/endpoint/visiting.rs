//! A world of a session at the OpenEnv face into which the clients of this endpoint came. It goes
//! on when the session steps, and in synchronous mode only when clients have ticked as well.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use schemas::{Error, ErrorCode, Request, SharedFrame, TickItem, TickOutcome, WorldId};
use tokio::sync::{mpsc, oneshot};
use tokio::time::Instant;

use super::Endpoint;
use super::visit::{Clock, Order, Visit};
use super::worlds::{first_result, refused};
use crate::dialect::EpisodeSettings;
use crate::rpc::{Answer, Payload, Refusal};
use crate::visited::VisitedTick;

/// Frames by which CARLA's client looks whether a step that it has set is the one that it gets,
/// where its newest frame has another one.
const TRIAL_FRAMES: u8 = 2;

impl Endpoint {
    /// Comes into the world of a session. The old world goes only when this one is known to be
    /// there.
    ///
    /// # Errors
    /// There is no such world, or it is not open; the old episode goes on.
    pub(super) async fn visit(&mut self, world: WorldId) -> Result<(), Refusal> {
        let (world, root) = self.present_world_of(world).await;
        let clock = self.clock_of(world);
        let told = self.visited.0.clone();
        let begun = Visit::begin(clock, root, told).await;
        let mut visit = begun.map_err(|error| not_open(error, world))?;
        match self.look_into(world).await {
            Ok((map, frame)) => {
                visit.deeds.note_tick(&frame);
                self.end_episode().await;
                self.visit = Some(visit);
                let told = map.name().to_owned();
                self.begin_episode((world, frame), map, told).await?;
                self.settle(self.settings.clone());
                self.follow_on();
                Ok(())
            }
            Err(refusal) => {
                visit.end().await;
                Err(refusal)
            }
        }
    }

    /// The map of a world, and what is there now.
    async fn look_into(&self, world: WorldId) -> Result<(Arc<roads::Map>, SharedFrame), Refusal> {
        let ticked = self.site.ask(Request::TickWorlds(vec![TickItem::new(world, 0)])).await;
        let outcome = ticked.and_then(first_result).map_err(|error| refused(&error))?;
        let frame = SharedFrame::decode(outcome.frame).map_err(|error| refused(&error))?;
        let map = self.maps.find(&frame.map.name).await;
        let map = map.map_err(|error| Refusal(error.message))?;
        super::loading::fits(&map, &frame)?;
        Ok((map, frame))
    }

    fn clock_of(&self, world: WorldId) -> Clock {
        let mut name = DefaultHasher::new();
        (self.config.owner.as_str(), self.port, self.episodes_begun).hash(&mut name);
        // Sixteen digits are a name.
        let participant = format!("carla-{:016x}", name.finish()).parse();
        let participant = participant.unwrap_or_else(|_| self.config.owner.clone());
        Clock { site: Arc::clone(&self.site), world, participant }
    }

    /// Where ticks of visited worlds are told, once.
    pub(crate) fn take_visited(&mut self) -> Option<mpsc::Receiver<VisitedTick>> {
        self.visited.1.take()
    }

    /// Settings as they can be in the present world: one that clients visit has its own time step.
    pub(super) fn settings_here(&self, wanted: EpisodeSettings) -> EpisodeSettings {
        match (&self.visit, &self.episode) {
            (Some(_), Some(episode)) => wanted.with_step(episode.frame.dt_secs),
            _ => wanted,
        }
    }

    /// Whether a client may have this step in the present world.
    ///
    /// # Errors
    /// It has another one of its own.
    pub(crate) fn check_step(&self, wanted: Option<f64>) -> Result<(), Refusal> {
        let (Some(_), Some(episode)) = (&self.visit, &self.episode) else { return Ok(()) };
        let own = episode.frame.dt_secs;
        match wanted.filter(|wanted| (wanted - own).abs() > 1e-6) {
            None => Ok(()),
            Some(found) => Err(Refusal(format!(
                "the world of a session has its own step; wanted fixed_delta_seconds {own} or None, \
                 found {found}"
            ))),
        }
    }

    /// A client that has set a step looks for it in the frames that follow. In a visited world
    /// these are frames in which it stands: the session knows nothing of them.
    pub(crate) async fn begin_trial(&mut self) {
        let Some(visit) = &mut self.visit else { return };
        visit.trial_frames = 0;
        // One with another step first: how many frames the client looks at depends on it.
        self.show_standstill().await;
        if let Some(visit) = &mut self.visit {
            visit.trial_frames = TRIAL_FRAMES;
        }
    }

    /// The step that a frame tells in which a visited world stands: none, unless a client looks for
    /// the one that it has set.
    pub(super) fn standing_secs(&mut self) -> f64 {
        let Some(visit) = self.visit.as_mut().filter(|visit| visit.trial_frames > 0) else {
            return 0.0;
        };
        visit.trial_frames -= 1;
        self.settings.fixed_delta_seconds.0.unwrap_or_default()
    }

    /// Synchronous mode has begun, or ended.
    pub(super) fn change_pace(&mut self) {
        if let Some(visit) = self.visit.as_mut().filter(|_| self.settings.synchronous_mode) {
            let (done, pausing) = oneshot::channel();
            visit.order(Order::Pause(done));
            visit.pausing = Some(pausing);
        }
        self.follow_on();
    }

    /// Has the next frame of a visited world shown, unless clients are to tick before.
    pub(super) fn follow_on(&self) {
        if let Some(visit) = self.visit.as_ref().filter(|_| !self.settings.synchronous_mode) {
            visit.order(Order::Tick);
        }
    }

    /// Clients have ticked: the frame that they were promised comes when the session steps.
    pub(super) async fn ask_visited(&mut self) -> Result<(), Refusal> {
        self.flush().await?;
        if self.visit.as_ref().is_some_and(|visit| visit.trial_frames > 0) {
            self.show_standstill().await;
            return Ok(());
        }
        self.present.awaits_world = true;
        if let Some(visit) = &mut self.visit {
            visit.owes_tick = true;
            visit.order(Order::Tick);
        }
        Ok(())
    }

    /// What a call has changed reaches a visited world before it is answered: nobody here knows
    /// when its next tick comes.
    pub(crate) async fn pass_on(&mut self) {
        let Some(visit) = &mut self.visit else { return };
        if let Some(pausing) = visit.pausing.take() {
            // Where it fails the world has ended, as the next call is told.
            _ = pausing.await;
        }
        if self.settings.synchronous_mode || self.pending.is_empty() {
            return;
        }
        if let Err(refusal) = self.flush().await {
            tracing::info!(port = self.port, %refusal, "changes have not reached a visited world");
        }
    }

    /// A visited world has ticked, or ended.
    pub(crate) async fn show_visited(&mut self, tick: VisitedTick) -> Answer {
        let is_here = self.visit.as_ref().is_some_and(|visit| visit.clock.world == tick.world);
        let shown = match tick.outcome {
            // Of a world whose place another one has taken.
            _ if !is_here => {
                self.await_visited_again();
                return Ok(Payload::Void);
            }
            Ok(outcome) => self.show_tick_of_session(outcome).await,
            Err(error) if worlds::is_gone(error.code) && self.come_back(&error).await => {
                self.await_visited_again();
                return Ok(Payload::Void);
            }
            Err(error) => Err(self.refusal_of(&error)),
        };
        if let Err(error) = shown {
            tracing::info!(port = self.port, %error, "a visited world does not tick");
            self.show_standstill().await;
        }
        Ok(Payload::Void)
    }

    async fn show_tick_of_session(&mut self, mut outcome: TickOutcome) -> Result<(), Refusal> {
        if let Some(visit) = &mut self.visit {
            visit.owes_tick = false;
        }
        self.follow_on();
        self.get_ready().await?;
        self.present.brief.last_tick = Instant::now();
        let frame = SharedFrame::decode(std::mem::take(&mut outcome.frame));
        let frame = frame.map_err(|error| refused(&error))?;
        if let Some(visit) = &mut self.visit {
            visit.deeds.note_tick(&frame);
        }
        // Commands may have brought a newer one.
        if frame.tick > self.episode()?.frame.tick {
            self.take_frame(frame, &[])?;
        }
        let strangers = self.episode()?.strangers();
        if !strangers.is_empty() {
            self.learn(strangers).await?;
        }
        let dt_secs = self.episode()?.frame.dt_secs;
        self.show_tick(outcome, dt_secs).await.map(drop)
    }

    /// Who was promised the tick that did not come is promised the next one.
    fn await_visited_again(&mut self) {
        self.present.awaits_world = self.visit.as_ref().is_some_and(|visit| visit.owes_tick);
    }

    /// Refuses what would change the world of a session as a whole.
    ///
    /// # Errors
    /// Clients are in the world of a session.
    pub(crate) fn unless_visiting(&self, what: &str) -> Result<(), Refusal> {
        match self.visit {
            None => Ok(()),
            Some(_) => Err(Refusal(format!(
                "{what} in the world of a session; load_world() of a map gives one of your own"
            ))),
        }
    }
}

fn not_open(error: Error, world: WorldId) -> Refusal {
    let wanted = "metadata.carla_world of a session whose reset had open_to_carla";
    let found = schemas::carla::name_of_world(world);
    refused(&match error.code {
        ErrorCode::UnknownWorld | ErrorCode::InvalidArgument | ErrorCode::Unreachable => {
            error.wanted(wanted).found(found)
        }
        _ => error,
    })
}
