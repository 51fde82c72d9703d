//! One session: a scenario with its settings, and the episode that runs in its own world.

mod candidate;
mod clock;
mod context;
mod contexts;
mod error;
mod furnished;
mod home;
mod opened;
mod origin;
mod realtime;
mod recovery;
mod saved;
mod shared;
pub(crate) mod table;
mod together;
mod world;

use std::sync::Arc;
use std::time::Instant;

use monitoring::Drain;
use schemas::{EncodedFrame, Error, ErrorCode, Image, SharedFrame};
use serde_json::{Map, Value};
use tenancy::Quotas;

use crate::action::{Action, ActionKind};
use crate::episode::{Episode, Observation, Report, Start, State, idle_state};
use crate::scenario::{DoneReason, Scenario, ScenarioError, registry, sharing};
use candidate::Candidate;
pub(crate) use context::SessionContext;
pub(crate) use contexts::Contexts;
pub(crate) use error::SessionError;
use home::Home;
use realtime::WallClock;
use saved::Operation;
pub(crate) use saved::{Saved, SavedStates};
pub(crate) use shared::SharedWorlds;
use together::Begun;
use world::{EpisodeWorld, Told, Trouble, Work};

/// What a reset asks for.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ResetRequest {
    /// `None`: the scenario of the session.
    pub(crate) scenario_name: Option<String>,
    /// Changes to its settings.
    pub(crate) scenario_config: Map<String, Value>,
    /// `None`: a random one.
    pub(crate) seed: Option<u64>,
    /// `None`: a random one.
    pub(crate) episode_id: Option<String>,
    /// The state that it goes on from; `None`: the beginning.
    pub(crate) snapshot_id: Option<String>,
    /// The code of the shared world that it takes part in; `None`: it has a world of its own.
    pub(crate) join: Option<String>,
    /// As which ego; `None`: the first one that is free.
    pub(crate) ego: Option<String>,
}

/// One session.
pub(crate) struct Session {
    context: Arc<SessionContext>,
    /// The settings that the next reset starts from.
    scenario: Box<dyn Scenario>,
    /// The name the settings were built from, which `name` may have covered since.
    built_from: String,
    quotas: Quotas,
    running: Running,
    clock: WallClock,
}

/// How far a session is with its episode.
enum Stage {
    /// There was none, or it was lost.
    Nothing,
    /// It goes on.
    Playing,
    /// It is over.
    Over,
}

enum Running {
    Nothing,
    Episode(Box<Episode>, Home),
    Lost(String),
}

impl Session {
    /// A session that has not begun an episode.
    ///
    /// # Errors
    /// [`ScenarioError`] when the default scenario does not exist.
    pub(crate) fn new(context: Arc<SessionContext>, quotas: Quotas) -> Result<Self, ScenarioError> {
        let built_from = context.default_scenario.clone();
        let scenario = registry::find(&context.files, &built_from, context.profile)?;
        let clock = WallClock::start(Instant::now());
        Ok(Self { context, scenario, built_from, quotas, running: Running::Nothing, clock })
    }

    /// Begins an episode. All or nothing: only when the new world stands does the old one go.
    ///
    /// # Errors
    /// [`SessionError`]; the episode that was running still is.
    pub(crate) async fn reset(&mut self, request: ResetRequest) -> Result<Report, SessionError> {
        if let Some(code) = &request.join {
            return self.join(code, &request).await;
        }
        if let Some(id) = &request.snapshot_id {
            return self.resume(id, &request).await;
        }
        let begun = Instant::now();
        let report = self.begin(request).await?;
        self.context.figures.reset_seconds.observe(begun.elapsed());
        Ok(report)
    }

    async fn begin(&mut self, request: ResetRequest) -> Result<Report, SessionError> {
        let Candidate { mut scenario, built_from, ignored_config, origin } =
            self.candidate(&request)?;
        let settings = scenario.clone_box();
        let context = Arc::clone(&self.context);
        // A recorded world brings its map along; any other one is made for the map.
        let branched = match &origin {
            Some(origin) => Some(self.branched(origin).await?),
            None => None,
        };
        let map_name = match &branched {
            Some((frame, ..)) => frame.map.name.clone(),
            None => scenario.common().map_name().to_owned(),
        };
        let map = context.maps.get(&map_name).await.map_err(SessionError::World)?;
        let seed = request.seed.unwrap_or_else(random_seed);
        let mut spec = scenario.reset(seed, &map)?;
        let is_branch = branched.is_some();
        let guests = sharing::add_egos(&mut spec, settings.as_ref(), seed, &map)?;
        if is_branch && !guests.is_empty() {
            let text = "a recorded world has one ego";
            let error = Error::new(ErrorCode::InvalidArgument, text).wanted("num_egos 1");
            return Err(SessionError::Refused(error));
        }
        let ((frame, replies, world), base) = match branched {
            Some(branched) => (branched, None),
            None => self.furnished(map_name, seed, &spec).await?,
        };
        if frame.map.digest != map.digest() {
            context.maps.forget_names();
            let text = "the world service has another version of the map; reset again";
            return Err(SessionError::World(Error::new(ErrorCode::Internal, text)));
        }
        let start = Start {
            // Who drives in a recorded world goes on driving.
            opening: if is_branch { Vec::new() } else { spec.opening(&replies) },
            episode_id: request.episode_id.unwrap_or_else(random_id),
            seed,
            map,
            scenario,
            weather_name: spec.weather_name,
            ignored_config,
        };
        let begun = Begun { start, frame, replies };
        let mut world = EpisodeWorld::new(world, base, &context).await;
        if settings.common().open_to_carla {
            world.open(&context).await.map_err(SessionError::World)?;
        }
        let carla_world = world.carla_world();
        let (episode, home, report) = if guests.is_empty() {
            let (episode, report) = begun.episode(0)?;
            (episode, Home::Own(world), report)
        } else {
            begun.share(world, guests, &context)?
        };
        // Nothing waits any more from here on: a reset is done as a whole or not at all.
        self.scenario = settings;
        self.built_from = built_from;
        self.go_on(episode, home);
        Ok(Report { carla_world, ..report })
    }

    /// Another episode than before.
    fn go_on(&mut self, episode: Episode, home: Home) {
        if let Running::Episode(_, before) = &self.running {
            before.end();
        }
        self.running = Running::Episode(Box::new(episode), home);
        self.clock = WallClock::start(Instant::now());
    }

    /// One action, after an automatic reset if there is no episode yet.
    ///
    /// # Errors
    /// [`SessionError`]; the episode is as it was, or lost.
    pub(crate) async fn step(&mut self, action: &Action) -> Result<Report, SessionError> {
        if matches!(self.running, Running::Nothing) {
            self.reset(ResetRequest::default()).await?;
        }
        let begun = Instant::now();
        if let Some(operation) = Operation::of(&action.metadata) {
            return self.operate(operation).await;
        }
        if action.kind == ActionKind::CaptureImage {
            let captured = self.capture().await;
            self.context.figures.picture_seconds.observe(begun.elapsed());
            return captured;
        }
        let report = self.advance(action).await;
        self.clock.answer(Instant::now());
        let report = report?;
        self.context.figures.step_seconds.observe(begun.elapsed());
        Ok(report)
    }

    fn stage(&self) -> Stage {
        match &self.running {
            Running::Episode(episode, _) if episode.is_done() => Stage::Over,
            Running::Episode(..) => Stage::Playing,
            Running::Nothing | Running::Lost(_) => Stage::Nothing,
        }
    }

    /// Whether there is nothing to finish before a service that ends does: episodes go on to their
    /// end, and new ones begin in the first half of the time that there is.
    pub(crate) fn leaves(&self, drain: Drain) -> bool {
        match self.stage() {
            Stage::Nothing => drain.is_on(),
            Stage::Over => drain.is_late(Instant::now()),
            Stage::Playing => false,
        }
    }

    /// Moves the world of the episode away from a service that ends; on errors it should be tried
    /// again.
    pub(crate) async fn move_away(&mut self) -> Result<(), Error> {
        match &mut self.running {
            Running::Episode(episode, world) => {
                world.move_away(&self.context, episode.frame()).await
            }
            Running::Nothing | Running::Lost(_) => Ok(()),
        }
    }

    /// What the client sees after a request.
    pub(crate) fn observation<'a>(&'a self, report: &'a Report) -> Option<Observation<'a>> {
        match &self.running {
            Running::Episode(episode, _) => Some(episode.observation(report)),
            _ => None,
        }
    }

    /// What the client can ask about the episode at any time.
    pub(crate) fn state(&self) -> State<'_> {
        match &self.running {
            Running::Episode(episode, _) => episode.state(),
            _ => idle_state(self.scenario.common()),
        }
    }

    /// The tick that the episode has seen last, and its world.
    #[cfg(test)]
    pub(crate) fn present(&self) -> Option<(schemas::Tick, Option<schemas::WorldId>)> {
        match &self.running {
            Running::Episode(episode, world) => Some((episode.frame().tick, world.id())),
            _ => None,
        }
    }

    async fn advance(&mut self, action: &Action) -> Result<Report, SessionError> {
        let (episode, home) = self.running.episode()?;
        if home.is_shared() && episode.is_done() {
            return Ok(Report { reward: Some(0.0), ..Report::default() });
        }
        if episode.is_realtime() {
            let own = episode.plan(action).tick_count;
            let ticks = self.clock.ticks_before(own, Instant::now());
            if let Err(trouble) = self.clock.pass(ticks, episode, home, &self.context).await {
                return Err(self.troubled(trouble));
            }
        }
        let mut plan = episode.plan(action);
        plan.events.splice(0..0, self.clock.take_events());
        let work = Work {
            commands: std::mem::take(&mut plan.commands),
            tick_count: plan.tick_count,
            // Clients know a place that no road leads to as an error, and an error changes nothing.
            is_checked: action.kind == ActionKind::SetDestination,
        };
        match home.advance(&self.context, episode.frame(), work).await {
            Ok(Told { frame, replies, collisions, events, company, carla_world }) => {
                plan.events.extend(events);
                let report = episode.advance(action, plan, frame, &replies, &collisions);
                if episode.is_done() {
                    home.leave();
                }
                Ok(Report { company, carla_world, ..report })
            }
            Err(Trouble::Ended) => Ok(episode.end(DoneReason::WorldReset)),
            Err(trouble) => Err(self.troubled(trouble)),
        }
    }

    fn troubled(&mut self, trouble: Trouble) -> SessionError {
        match trouble {
            Trouble::Refused(refusal) => SessionError::Refused(refusal),
            Trouble::Absent(error) => SessionError::World(error),
            Trouble::World(error) if !ends_the_episode(error.code) => SessionError::World(error),
            Trouble::World(error) | Trouble::Gone(error) => self.lose(&error),
            // Of shared worlds, whose episodes end without an error.
            Trouble::Ended => SessionError::WorldLost("its world has begun anew".to_owned()),
        }
    }

    async fn capture(&mut self) -> Result<Report, SessionError> {
        let (episode, _) = self.running.episode()?;
        let camera = episode.camera();
        let picture = match self.context.may_draw(self.quotas, &camera) {
            Ok(()) => {
                let drawn = self.context.port.draw(episode.frame().clone(), vec![camera]);
                drawn.await.map_err(|error| error.to_string()).and_then(picture)
            }
            Err(why) => Err(why),
        };
        Ok(episode.captured(picture))
    }

    fn lose(&mut self, error: &Error) -> SessionError {
        tracing::warn!(target: "audit", tenant = %self.context.tenant, %error, "lose world");
        self.context.figures.lost.inc();
        self.context.maps.forget_names();
        self.running = Running::Lost(error.to_string());
        SessionError::WorldLost(error.to_string())
    }
}

impl Running {
    fn episode(&mut self) -> Result<(&mut Episode, &mut Home), SessionError> {
        match self {
            Self::Episode(episode, home) => Ok((episode, home)),
            Self::Lost(why) => Err(SessionError::WorldLost(why.clone())),
            // A step resets first, so that this is only met if the reset made no episode.
            Self::Nothing => Err(SessionError::WorldLost("it was never made".to_owned())),
        }
    }
}

/// Whether the world may be gone, or at another tick than the episode knows.
fn ends_the_episode(code: ErrorCode) -> bool {
    use ErrorCode::{InvalidMessage, TimedOut, UnknownWorld, Unreachable};
    use ErrorCode::{WorldQuarantined, WrongTick};
    let is_gone = matches!(code, UnknownWorld | WorldQuarantined | Unreachable);
    is_gone || matches!(code, WrongTick | TimedOut | InvalidMessage)
}

fn picture(images: Vec<Image>) -> Result<String, String> {
    use base64::Engine as _;
    let image = images.into_iter().next().ok_or("the renderer sent no picture")?;
    Ok(base64::engine::general_purpose::STANDARD.encode(image.data))
}

fn decode(frame: EncodedFrame) -> Result<SharedFrame, SessionError> {
    SharedFrame::decode(frame).map_err(SessionError::World)
}

fn invalid(text: &str) -> SessionError {
    SessionError::World(Error::new(ErrorCode::InvalidMessage, text))
}

/// 32 bits are enough for people to tell episodes apart, and every JSON reader keeps them.
fn random_seed() -> u64 {
    uuid::Uuid::new_v4().as_u128() as u64 & 0xFFFF_FFFF
}

fn random_id() -> String {
    uuid::Uuid::new_v4().to_string()
}

#[cfg(test)]
mod tests;
