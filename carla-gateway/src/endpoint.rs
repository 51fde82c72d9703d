//! What one CARLA server has: its episode, with the world behind it, and its streams. It does one
//! thing at a time, what a call or the [lobby](crate::lobby) asks for.

mod branching;
mod cameras;
mod cars;
mod clock;
mod coming_back;
mod deeds;
mod following;
mod ids;
mod journal;
mod listeners;
mod loading;
mod recording;
mod street_lamps;
mod telling;
mod uploads;
mod visit;
mod visiting;
mod worlds;

pub(crate) use cameras::check_camera;

use std::sync::Arc;

use roads::MapLayer;
use schemas::{ActorId, Command, SharedFrame, wire};
use tokio::runtime;
use tokio::sync::mpsc;
use tokio::task::JoinHandle;
use tokio::time::Instant;

use crate::allowance::Room;
use crate::archive::Prepared;
use crate::config::{Ports, WorldConfig};
use crate::dialect::{EpisodeSettings, WeatherParameters};
use crate::episode::Episode;
use crate::figures::{StreamFigures, WorldFigures};
use crate::lobby::{Brief, Report, Timing, WorldState};
use crate::maps::Maps;
use crate::pictures::Shape;
use crate::recorder::{Recorder, RecordingFolder};
use crate::replayer::Replayer;
use crate::rpc::{Answer, Refusal};
use crate::site::Site;
use crate::stream::{Hub, StreamId, WORLD_OBSERVER};
use crate::visited::VisitedTick;
use cameras::EventMemories;
use coming_back::Keep;
use ids::GivenIds;
use listeners::Expected;
use street_lamps::StreetLamps;
use visit::Visit;

/// What gravity measures at rest, in metres per second squared.
pub(crate) const GRAVITY_MPS2: f32 = 9.81;
/// Commands that wait for the next tick at most.
const PENDING_MAX: usize = 4_096;
/// Ticks of a visited world that wait to be shown, at most.
const VISITED_MAX: usize = 4;

/// What the endpoint is told for a job, and what the job tells about its answer.
struct Present {
    brief: Brief,
    timing: Timing,
    expects_step: bool,
    asks_for_frame: bool,
    awaits_world: bool,
    later: Option<JoinHandle<Answer>>,
    /// Was made ready for the call.
    prepared: Option<Prepared>,
    again: Option<JoinHandle<Prepared>>,
}

impl Present {
    fn new(brief: Brief) -> Self {
        Self {
            brief,
            timing: Timing::Now,
            expects_step: false,
            asks_for_frame: false,
            awaits_world: false,
            later: None,
            prepared: None,
            again: None,
        }
    }
}

/// # Errors
/// No request may hold the command.
pub(crate) fn check(command: &Command) -> Result<(), Refusal> {
    wire::check_command(command).map_err(|error| worlds::refused(&error))
}

/// The state of one CARLA server.
pub(crate) struct Endpoint {
    pub(crate) site: Arc<dyn Site>,
    pub(crate) maps: Arc<Maps>,
    pub(crate) hub: Arc<Hub>,
    pub(crate) config: WorldConfig,
    /// Of calls.
    pub(crate) port: u16,
    /// Of streams.
    pub(crate) stream_port: u16,
    pub(crate) weather: WeatherParameters,
    /// Made at the first call that needs it.
    pub(crate) episode: Option<Episode>,
    keep: Keep,
    /// Its world is that of a session at the OpenEnv face.
    visit: Option<Visit>,
    /// What came of the ticks of such a world; the server takes where they are told.
    visited: (mpsc::Sender<VisitedTick>, Option<mpsc::Receiver<VisitedTick>>),
    /// What became of the world of the episode, when it is gone.
    pub(crate) lost: Option<String>,
    pub(crate) episodes_begun: u64,
    /// Of the newest snapshot; never goes back.
    pub(crate) frame_number: u64,
    pub(crate) recorder: Recorder,
    /// Whether the world keeps a journal beside the recording.
    has_journal: bool,
    pub(crate) replayer: Replayer,
    /// Wait for the next tick or flush.
    pub(crate) pending: Vec<Command>,
    /// Street lights of the map.
    pub(crate) lamps: StreetLamps,
    /// What clients drew into the world.
    pub(crate) shapes: Arc<Vec<Shape>>,
    /// What inertial sensors measure at rest.
    pub(crate) imui_gravity_mps2: f32,
    /// How the episode runs.
    settings: EpisodeSettings,
    present: Present,
    /// Of the streams that were ever opened.
    newest_stream: StreamId,
    /// In all its worlds.
    pub(crate) given: GivenIds,
    expected: Expected,
    pictures: Option<JoinHandle<()>>,
    /// The newest frame that clients have seen.
    shown: Option<SharedFrame>,
    event_memories: Arc<EventMemories>,
    /// Where pictures are made ready, away from the calls.
    workers: runtime::Handle,
    figures: WorldFigures,
    started: Instant,
    map_is_new: bool,
}

impl Endpoint {
    /// An endpoint without an episode.
    pub(crate) fn new(
        site: Arc<dyn Site>,
        maps: Arc<Maps>,
        config: WorldConfig,
        ports: Ports,
        workers: runtime::Handle,
        (streams, figures): (StreamFigures, WorldFigures),
    ) -> Self {
        let hub = Arc::new(Hub::counting(streams).serving(config.version));
        hub.open(WORLD_OBSERVER, true);
        let now = Instant::now();
        let (tell_ticks, ticks) = mpsc::channel(VISITED_MAX);
        let keep = Keep::new(Arc::clone(&config.recovery));
        let recorder = Recorder::new(RecordingFolder::clone(&config.recordings));
        Self {
            site,
            maps,
            hub,
            config,
            port: ports.calls,
            stream_port: ports.streams,
            weather: WeatherParameters::of(&schemas::Weather::CLEAR_NOON),
            episode: None,
            keep,
            visit: None,
            visited: (tell_ticks, Some(ticks)),
            lost: None,
            episodes_begun: 0,
            frame_number: 0,
            recorder,
            has_journal: false,
            replayer: Replayer::default(),
            pending: Vec::new(),
            lamps: StreetLamps::default(),
            shapes: Arc::default(),
            imui_gravity_mps2: GRAVITY_MPS2,
            settings: EpisodeSettings::default(),
            present: Present::new(Brief {
                last_tick: now,
                caller: None,
                finds_new_world: false,
                ticks_by_itself: false,
                shares_clock: false,
            }),
            newest_stream: WORLD_OBSERVER,
            given: GivenIds::default(),
            expected: Expected::default(),
            pictures: None,
            shown: None,
            event_memories: Arc::default(),
            workers,
            figures,
            started: now,
            map_is_new: false,
        }
    }

    /// How the episode runs.
    pub(crate) fn settings(&self) -> &EpisodeSettings {
        &self.settings
    }

    /// Takes over settings.
    pub(crate) fn settle(&mut self, settings: EpisodeSettings) {
        let settings = self.settings_here(settings);
        let changes_pace = settings.synchronous_mode != self.settings.synchronous_mode;
        self.settings = settings;
        self.queue_substeps();
        if changes_pace {
            self.change_pace();
        }
    }

    /// A job begins.
    pub(crate) fn begin(&mut self, brief: Brief) {
        self.present = Present::new(brief);
    }

    /// Brings what was made ready for the present call.
    pub(crate) fn bring(&mut self, prepared: Option<Prepared>) {
        self.present.prepared = prepared;
    }

    /// What was made ready for the present call, if it comes again.
    pub(crate) fn take_prepared(&mut self) -> Option<Prepared> {
        self.present.prepared.take()
    }

    /// The present call comes again when something is ready for it; others are answered meanwhile.
    pub(crate) fn come_again(&mut self, ready: JoinHandle<Prepared>) {
        self.present.again = Some(ready);
    }

    /// What the present call waits for, to come again.
    pub(crate) fn take_again(&mut self) -> Option<JoinHandle<Prepared>> {
        self.present.again.take()
    }

    /// The client's Traffic Managers take a step before its present call returns.
    pub(crate) fn expect_step(&mut self) {
        self.present.expects_step = true;
    }

    /// The present call has put actors into the world: its answer waits for a frame.
    pub(crate) fn answer_with_next_frame(&mut self) {
        self.present.timing = Timing::WithNextFrame;
    }

    /// The present call is answered with what comes of this, whenever that is.
    pub(crate) fn answer_later(&mut self, answer: JoinHandle<Answer>) {
        self.present.later = Some(answer);
    }

    /// The present call has destroyed an actor, which a step of the caller's Traffic Managers may
    /// be about.
    pub(crate) fn answer_after_managers_step(&mut self, actor: ActorId) {
        let actor = self.episode.as_ref().and_then(|episode| episode.actor(actor));
        if actor.is_some_and(|actor| actor.description.type_id.starts_with("vehicle.")) {
            self.present.timing = self.present.timing.max(Timing::AfterManagersStep);
        }
    }

    /// What came of a job.
    pub(crate) fn report(&mut self, answer: Answer) -> Report {
        let world = match (&self.episode, &self.lost) {
            (None, _) => WorldState::None,
            (Some(_), None) if self.visit.is_some() => WorldState::Visited,
            (Some(_), None) => WorldState::Alive,
            (Some(_), Some(_)) => WorldState::Lost,
        };
        Report {
            answer,
            later: self.present.later.take(),
            again: None,
            timing: self.present.timing,
            expects_step: self.present.expects_step,
            asks_for_frame: self.present.asks_for_frame,
            awaits_world: self.present.awaits_world,
            settings: self.settings.clone(),
            frame_number: self.frame_number,
            episodes_begun: self.episodes_begun,
            world,
            last_tick: self.present.brief.last_tick,
        }
    }

    /// What may still be spawned into the world.
    ///
    /// # Errors
    /// As for [`episode`](Self::episode).
    pub(crate) fn room(&mut self) -> Result<Room, Refusal> {
        let allowance = self.config.allowance.clone();
        Ok(allowance.room(&self.episode()?.frame))
    }

    /// The episode.
    ///
    /// # Errors
    /// Why there is none; a client gets one with `reload_world` or `load_world`.
    pub(crate) fn episode(&mut self) -> Result<&mut Episode, Refusal> {
        if let Some(why) = &self.lost {
            return Err(Refusal(format!("{why}; reload_world() begins anew")));
        }
        self.known_episode()
    }

    /// The episode, even one whose world is gone: its map is still what clients were told.
    ///
    /// # Errors
    /// None has begun yet.
    pub(crate) fn known_episode(&mut self) -> Result<&mut Episode, Refusal> {
        self.episode.as_mut().ok_or_else(|| Refusal("episode not ready".to_owned()))
    }

    /// Begins an episode if there is none yet, or if its world was gone before the caller came.
    ///
    /// # Errors
    /// As for [`load`](Self::load).
    pub(crate) async fn ensure_episode(&mut self) -> Result<(), Refusal> {
        let begins_anew = self.lost.is_some() && self.present.brief.finds_new_world;
        if self.episode.is_some() && !begins_anew {
            return Ok(());
        }
        self.load("", MapLayer::ALL).await
    }

    /// Notes that the world of the episode is gone.
    pub(crate) fn note_loss(&mut self, why: impl std::fmt::Display) {
        let why = format!("the world is gone: {why}");
        let tenant = self.config.allowance.tenant();
        tracing::warn!(target: "audit", %tenant, port = self.port, why, "lose world");
        self.figures.lost.inc();
        self.lost = Some(why);
        self.keep.end();
    }

    /// Whether the sun is below the horizon.
    pub(crate) fn is_night(&self) -> bool {
        self.weather.ours().sun_altitude_rad <= 0.0
    }

    /// Queues a command for the next tick or flush.
    ///
    /// # Errors
    /// No request may hold the command; those of a flush, when too many wait.
    pub(crate) async fn queue(&mut self, command: Command) -> Result<(), Refusal> {
        self.episode()?;
        check(&command)?;
        self.pending.push(command);
        if self.pending.len() >= PENDING_MAX {
            self.flush().await?;
        }
        Ok(())
    }
}
