//! One CARLA server: its clients, its episode, its clock. Calls are answered one after the other in
//! the order of their arrival, ticks happen between them.

mod cameras;
mod changeover;
mod clock;
mod held;
mod late;
mod listeners;
mod loading;
mod telling;
mod traffic;
mod tyres;
mod uploads;
mod worlds;

pub(crate) use cameras::check_camera;
pub(crate) use worlds::unknown_actor;

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::Arc;

use roads::MapLayer;
use schemas::Command;
use tokio::runtime;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;
use tokio::time::Instant;

use crate::calls;
use crate::config::WorldConfig;
use crate::dialect::{EpisodeSettings, LightState, WeatherParameters};
use crate::episode::Episode;
use crate::maps::Maps;
use crate::pictures::Shape;
use crate::rpc::{Connection, ConnectionId, Refusal, Request};
use crate::site::Site;
use crate::stream::{Hub, WORLD_OBSERVER};
use cameras::{Darkroom, Poses};
use changeover::Changeover;
use held::{HeldLoads, LOAD};
use late::LateAnswers;
use traffic::TrafficManagers;

/// Events that may wait; clients that send more are read more slowly.
pub(crate) const EVENTS_MAX: usize = 1_024;
/// Events that are handled between two looks at the clock.
const EVENTS_PER_LOOK: usize = 64;
/// What gravity measures at rest, in metres per second squared.
pub(crate) const GRAVITY_MPS2: f32 = 9.81;
/// Commands that wait for the next tick at most.
const PENDING_MAX: usize = 4_096;

/// What an endpoint hears.
pub(crate) enum Event {
    /// A client connected.
    Connected(ConnectionId, Whereabouts),
    /// A client is gone.
    Disconnected(ConnectionId),
    /// A client calls.
    Call(Connection, Request),
    /// A client has called and was answered already.
    Answered(ConnectionId),
    /// A stream has lost its last listener.
    Deserted(u32),
}

/// Where a client runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whereabouts {
    pub(crate) address: IpAddr,
    /// Whether that is this machine.
    pub(crate) is_here: bool,
}

/// A world that is gone.
pub(crate) struct Loss {
    /// What became of it.
    pub(crate) why: String,
    /// The last client that could know it; who comes later finds a new world.
    newest_witness: Option<ConnectionId>,
}

/// The state of one CARLA server.
pub(crate) struct Endpoint {
    pub(crate) site: Arc<dyn Site>,
    pub(crate) maps: Arc<Maps>,
    pub(crate) hub: Arc<Hub>,
    pub(crate) config: WorldConfig,
    /// Of calls; streams have the next one.
    pub(crate) port: u16,
    pub(crate) weather: WeatherParameters,
    /// Made at the first call that needs it.
    pub(crate) episode: Option<Episode>,
    /// Set when the world of the episode is gone.
    pub(crate) lost: Option<Loss>,
    pub(crate) episodes_begun: u64,
    /// Of the newest snapshot; never goes back.
    pub(crate) frame_number: u64,
    /// Wait for the next tick or flush.
    pub(crate) pending: Vec<Command>,
    /// Those that run in clients.
    pub(crate) traffic_managers: TrafficManagers,
    /// Street lights of the map, as clients set them.
    pub(crate) lights: Vec<LightState>,
    /// Whether clients have to ask for the lights again.
    pub(crate) lights_are_new: bool,
    /// Whether the lights burn by night only.
    pub(crate) lights_follow_the_sun: bool,
    /// What clients drew into the world.
    pub(crate) shapes: Arc<Vec<Shape>>,
    /// What inertial sensors measure at rest.
    pub(crate) imui_gravity_mps2: f32,
    /// How the episode runs.
    settings: EpisodeSettings,
    /// The same, for those who read them while the endpoint is busy.
    posted_settings: watch::Sender<EpisodeSettings>,
    clients: BTreeMap<ConnectionId, Whereabouts>,
    newest_client: Option<ConnectionId>,
    caller: Option<ConnectionId>,
    late: LateAnswers,
    changeover: Option<Changeover>,
    held: HeldLoads,
    streams_opened: u32,
    /// Streams whose listener is on the way: how many will have come then, until when it is
    /// awaited.
    expected: BTreeMap<u32, (u64, Instant)>,
    pictures: Option<JoinHandle<()>>,
    /// Where all were in the newest frame that clients have seen.
    poses: Poses,
    darkroom: Arc<Darkroom>,
    /// Where pictures are made ready, away from the calls.
    workers: runtime::Handle,
    started: Instant,
    last_tick: Instant,
    map_is_new: bool,
}

impl Endpoint {
    /// An endpoint without an episode.
    pub(crate) fn new(
        site: Arc<dyn Site>,
        maps: Arc<Maps>,
        config: WorldConfig,
        port: u16,
        workers: runtime::Handle,
    ) -> Self {
        let hub = Arc::new(Hub::new());
        hub.open(WORLD_OBSERVER, true);
        let now = Instant::now();
        Self {
            site,
            maps,
            hub,
            config,
            port,
            weather: WeatherParameters::of(&schemas::Weather::CLEAR_NOON),
            episode: None,
            lost: None,
            episodes_begun: 0,
            frame_number: 0,
            pending: Vec::new(),
            traffic_managers: TrafficManagers::default(),
            lights: Vec::new(),
            lights_are_new: false,
            lights_follow_the_sun: true,
            shapes: Arc::default(),
            imui_gravity_mps2: GRAVITY_MPS2,
            settings: EpisodeSettings::default(),
            posted_settings: watch::Sender::new(EpisodeSettings::default()),
            clients: BTreeMap::new(),
            newest_client: None,
            caller: None,
            late: LateAnswers::default(),
            changeover: None,
            held: HeldLoads::default(),
            streams_opened: WORLD_OBSERVER,
            expected: BTreeMap::new(),
            pictures: None,
            poses: Poses::default(),
            darkroom: Arc::default(),
            workers,
            started: now,
            last_tick: now,
            map_is_new: false,
        }
    }

    /// The port of the streams.
    pub(crate) fn stream_port(&self) -> u16 {
        self.port.wrapping_add(1)
    }

    /// How the episode runs.
    pub(crate) fn settings(&self) -> &EpisodeSettings {
        &self.settings
    }

    /// Takes over settings; others see them at once.
    pub(crate) fn settle(&mut self, settings: EpisodeSettings) {
        self.posted_settings.send_replace(settings.clone());
        self.settings = settings;
        self.queue_substeps();
    }

    /// Where the settings can be read without the endpoint.
    pub(crate) fn posted_settings(&self) -> watch::Receiver<EpisodeSettings> {
        self.posted_settings.subscribe()
    }

    /// The client whose call is being answered.
    pub(crate) fn caller(&self) -> Option<ConnectionId> {
        self.caller
    }

    /// The client's Traffic Managers take a step before its present call returns.
    pub(crate) fn expect_step(&mut self) {
        if let Some(client) = self.caller {
            self.traffic_managers.note_frame(client, Instant::now());
        }
    }

    /// Whether the client whose call is being answered runs on this machine.
    pub(crate) fn is_caller_here(&self) -> bool {
        let caller = self.caller.and_then(|caller| self.clients.get(&caller));
        caller.is_some_and(|client| client.is_here)
    }

    /// Serves until nobody can send events any more.
    pub(crate) async fn run(mut self, mut events: mpsc::Receiver<Event>) {
        loop {
            self.give_late_answers();
            self.hurry_changeover();
            self.do_held_load().await;
            if self.next_tick_at().is_some_and(|at| at <= Instant::now()) {
                self.tick_by_itself().await;
                continue;
            }
            if events.is_empty() {
                self.wake_late_managers();
            }
            let others = self.traffic_managers.next_due().into_iter().chain(self.late.next_due());
            let others = others.chain(self.changeover.as_ref().map(Changeover::due));
            let others = others.chain(self.next_load_due());
            let event = match self.next_tick_at().into_iter().chain(others).min() {
                Some(at) => tokio::select! {
                    event = events.recv() => event,
                    () = tokio::time::sleep_until(at) => continue,
                },
                None => events.recv().await,
            };
            let Some(event) = event else { return };
            self.handle(event).await;
            for _ in 1..EVENTS_PER_LOOK {
                let Ok(event) = events.try_recv() else { break };
                self.handle(event).await;
            }
        }
    }

    async fn handle(&mut self, event: Event) {
        match event {
            Event::Connected(client, whereabouts) => {
                if self.clients.is_empty() {
                    self.last_tick = Instant::now();
                }
                self.clients.insert(client, whereabouts);
                self.newest_client = self.newest_client.max(Some(client));
            }
            Event::Disconnected(client) => {
                self.clients.remove(&client);
                self.traffic_managers.forget(client);
                self.held.forget(client);
                self.changeover.take_if(|changeover| changeover.client() == client);
            }
            Event::Call(connection, request) => {
                self.caller = Some(connection.id);
                match request.method.as_str() {
                    "apply_batch" => self.traffic_managers.note_batch(connection.id),
                    _ => self.traffic_managers.note_call(connection.id, Instant::now()),
                }
                if request.method == "tick_cue" && self.settings.synchronous_mode {
                    self.answer_and_tick(&connection, &request).await;
                } else if let Some((connection, request)) = self.hold(connection, request) {
                    self.answer(connection, request).await;
                }
                self.caller = None;
            }
            Event::Answered(client) => {
                self.traffic_managers.note_call(client, Instant::now());
                self.note_read(client);
            }
            Event::Deserted(stream) => self.note_deserted(stream),
        }
    }

    async fn answer(&mut self, connection: Connection, request: Request) {
        self.note_changeover(connection.id, &request);
        let answer = calls::answer(self, &request).await;
        if request.method == LOAD && answer.is_ok() {
            self.note_load();
            if self.traffic_managers.count(connection.id) > 0 {
                return self.change_over(connection, request, answer).await;
            }
        }
        if let (Err(refusal), true) = (&answer, request.asynchronous) {
            tracing::debug!(method = request.method, %refusal, "a call nobody waits for");
        }
        self.answer_in_time(connection, request, answer);
    }

    /// The episode.
    ///
    /// # Errors
    /// Why there is none; a client gets one with `reload_world` or `load_world`.
    pub(crate) fn episode(&mut self) -> Result<&mut Episode, Refusal> {
        if let Some(Loss { why, .. }) = &self.lost {
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
        let is_late = |loss: &Loss| self.caller.is_some() && self.caller > loss.newest_witness;
        if self.episode.is_some() && !self.lost.as_ref().is_some_and(is_late) {
            return Ok(());
        }
        self.load("", MapLayer::ALL).await
    }

    /// Notes that the world of the episode is gone.
    pub(crate) fn note_loss(&mut self, why: impl std::fmt::Display) {
        let why = format!("the world is gone: {why}");
        tracing::warn!(port = self.port, why, "episode ended");
        self.lost = Some(Loss { why, newest_witness: self.newest_client });
    }

    /// Queues a command for the next tick or flush.
    ///
    /// # Errors
    /// Those of a flush, when too many wait.
    pub(crate) async fn queue(&mut self, command: Command) -> Result<(), Refusal> {
        self.episode()?;
        self.pending.push(command);
        if self.pending.len() >= PENDING_MAX {
            self.flush().await?;
        }
        Ok(())
    }
}
