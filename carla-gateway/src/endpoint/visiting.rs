//! A world of a session at the OpenEnv face into which the clients of this endpoint came. It goes on
//! when the session steps, and in synchronous mode only when clients have ticked as well.
//!
//! Somebody has to wait for its ticks, for as long as the session likes, while calls are answered:
//! a task of its own, which tells the server what came of each.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use schemas::{ActorId, Command, Error, ErrorCode, Request, ServiceId, SharedFrame};
use schemas::{TickItem, TickOutcome, WorldId, limits};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;
use tokio::time::Instant;

use super::Endpoint;
use super::worlds::{first_result, refused};
use crate::dialect::EpisodeSettings;
use crate::rpc::{Answer, Payload, Refusal};
use crate::site::Site;

/// How long a session waits for clients in synchronous mode that do not tick.
const LEASE_MILLIS: u32 = 5_000;
/// Before a place in a clock is asked for again that was lost.
const PAUSE: Duration = Duration::from_millis(50);
/// Ticks in synchronous mode by which CARLA's client looks whether a step that it has set is the one
/// that it gets, where its newest frame has another one.
const TRIAL_TICKS: u8 = 2;
/// Orders that the task has not seen yet, at most.
const ORDERS_MAX: usize = 16;

/// What came of a tick of a world that clients visit.
#[derive(Debug)]
pub(crate) struct VisitedTick {
    world: WorldId,
    outcome: Result<TickOutcome, Error>,
}

#[cfg(test)]
impl VisitedTick {
    /// Of no world.
    pub(crate) fn nothing() -> Self {
        let error = Error::new(ErrorCode::UnknownWorld, "a test");
        Self { world: WorldId::of_host(0, 1), outcome: Err(error) }
    }
}

/// What the task is to do.
#[derive(Debug)]
enum Order {
    /// Ask for a tick.
    Tick,
    /// Do not ask for those of before any more, and say when that is so.
    Pause(oneshot::Sender<()>),
}

/// Clients are in the world of a session.
pub(super) struct Visit {
    clock: Clock,
    orders: mpsc::Sender<Order>,
    /// Actors that clients brought, and that go with them.
    brought: BTreeSet<ActorId>,
    /// Frames that are to show clients what their settings lead to, without a tick of the world.
    trial_frames: u8,
    /// Until then the task may still ask for ticks of before.
    pausing: Option<oneshot::Receiver<()>>,
    task: JoinHandle<()>,
}

/// The clock of the world, and the part that the endpoint takes in it.
#[derive(Clone)]
struct Clock {
    site: Arc<dyn Site>,
    world: WorldId,
    participant: ServiceId,
}

impl Visit {
    /// Takes part in the clock.
    ///
    /// # Errors
    /// There is no such world, or it is not open.
    async fn begin(clock: Clock, told: mpsc::Sender<VisitedTick>) -> Result<Self, Error> {
        clock.share(LEASE_MILLIS).await?;
        let (orders, received) = mpsc::channel(ORDERS_MAX);
        let task = tokio::spawn(clock.clone().follow(received, told));
        let (brought, trial_frames, pausing) = (BTreeSet::new(), 0, None);
        Ok(Self { clock, orders, brought, trial_frames, pausing, task })
    }

    fn order(&self, order: Order) {
        if let Err(error) = self.orders.try_send(order) {
            tracing::debug!(%error, "the world of a session has ended");
        }
    }

    /// These actors are in the world now, and clients brought some of them.
    pub(super) fn note(&mut self, frame: &SharedFrame, brought: impl Iterator<Item = ActorId>) {
        let before = self.brought.len();
        self.brought.extend(brought);
        if self.brought.len() > before {
            self.brought.retain(|actor| frame.actor(*actor).is_some());
        }
    }

    /// Takes what clients brought along, and leaves the world to its session.
    pub(super) async fn end(self) {
        self.task.abort();
        let Clock { site, world, .. } = &self.clock;
        let actors: Vec<ActorId> = self.brought.iter().copied().collect();
        for some in actors.chunks(limits::COMMANDS_PER_REQUEST_MAX) {
            let commands = some.iter().map(|actor| Command::DestroyActor { actor: *actor });
            let item = TickItem { commands: commands.collect(), ..TickItem::new(*world, 0) };
            if let Err(error) = site.ask(Request::TickWorlds(vec![item])).await {
                tracing::debug!(%error, "the world of a session has ended");
            }
        }
        if let Err(error) = self.clock.share(0).await {
            tracing::debug!(%error, "the world of a session has ended");
        }
    }
}

impl Drop for Visit {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Clock {
    async fn share(&self, lease_millis: u32) -> Result<(), Error> {
        let (world, participant) = (self.world, self.participant.clone());
        let request = Request::ShareClock { world, participant, lease_millis };
        self.site.ask(request).await.map(drop)
    }

    /// Asks for ticks as it is told to.
    async fn follow(self, mut orders: mpsc::Receiver<Order>, told: mpsc::Sender<VisitedTick>) {
        let mut owed = 0_usize;
        loop {
            if owed == 0 {
                match orders.recv().await {
                    None => return,
                    Some(Order::Tick) => owed = 1,
                    // Nobody listens any more where it fails.
                    Some(Order::Pause(done)) => _ = done.send(()),
                }
                continue;
            }
            let mut asked = pin!(self.next_tick());
            let told_or_paused = loop {
                tokio::select! {
                    outcome = &mut asked => break Ok(outcome),
                    order = orders.recv() => match order {
                        None => return,
                        Some(Order::Tick) => owed += 1,
                        Some(Order::Pause(done)) => break Err(done),
                    }
                }
            };
            let outcome = match told_or_paused {
                Ok(outcome) => outcome,
                Err(done) => {
                    owed = 0;
                    self.take_back().await;
                    // As above.
                    _ = done.send(());
                    continue;
                }
            };
            owed -= 1;
            let is_over = outcome.is_err();
            let tick = VisitedTick { world: self.world, outcome };
            if told.send(tick).await.is_err() || is_over {
                return;
            }
        }
    }

    /// What the next tick gives, whenever the session steps.
    async fn next_tick(&self) -> Result<TickOutcome, Error> {
        loop {
            let participant = Some(self.participant.clone());
            let item = TickItem { participant, ..TickItem::new(self.world, 1) };
            let ticked = self.site.ask(Request::TickWorlds(vec![item])).await;
            match ticked.and_then(first_result) {
                // Nobody steps at the moment.
                Err(error) if error.code == ErrorCode::TimedOut => {}
                // It was waited for in vain.
                Err(error) if error.code == ErrorCode::InvalidArgument => {
                    tokio::time::sleep(PAUSE).await;
                    self.share(LEASE_MILLIS).await?;
                }
                told => return told,
            }
        }
    }

    /// Asks for no tick any more, and is waited for as before.
    async fn take_back(&self) {
        for lease_millis in [0, LEASE_MILLIS] {
            if let Err(error) = self.share(lease_millis).await {
                tracing::debug!(%error, "the world of a session has ended");
            }
        }
    }
}

impl Endpoint {
    /// Comes into the world of a session. The old world goes only when this one is known to be there.
    ///
    /// # Errors
    /// There is no such world, or it is not open; the old episode goes on.
    pub(super) async fn visit(&mut self, world: WorldId) -> Result<(), Refusal> {
        let clock = self.clock_of(world);
        let told = self.visited.0.clone();
        let visit = Visit::begin(clock, told).await.map_err(|error| not_open(error, world))?;
        match self.look_into(world).await {
            Ok((map, frame)) => {
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
    pub(crate) fn check_step(&mut self, wanted: Option<f64>) -> Result<(), Refusal> {
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

    /// A client that has set a step looks for it in the frames that follow. In a visited world these
    /// are frames in which it stands: the session knows nothing of them.
    pub(crate) async fn begin_trial(&mut self) {
        let Some(visit) = &mut self.visit else { return };
        visit.trial_frames = 0;
        // One with another step first: how many frames the client looks at depends on it.
        self.show_standstill().await;
        let frames = if self.settings.synchronous_mode { TRIAL_TICKS } else { 1 };
        if let Some(visit) = &mut self.visit {
            visit.trial_frames = frames;
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
    fn follow_on(&self) {
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
        if let Some(visit) = &self.visit {
            visit.order(Order::Tick);
        }
        Ok(())
    }

    /// What a call has changed reaches a visited world before it is answered: nobody here knows when
    /// its next tick comes.
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
        if !is_here {
            return Ok(Payload::Void);
        }
        let shown = match tick.outcome {
            Ok(outcome) => self.show_tick_of_session(outcome).await,
            Err(error) => Err(self.refusal_of(&error)),
        };
        if let Err(error) = shown {
            tracing::info!(port = self.port, %error, "a visited world does not tick");
            self.show_standstill().await;
        }
        Ok(Payload::Void)
    }

    async fn show_tick_of_session(&mut self, mut outcome: TickOutcome) -> Result<(), Refusal> {
        self.follow_on();
        self.get_ready().await?;
        self.present.brief.last_tick = Instant::now();
        let frame = SharedFrame::decode(std::mem::take(&mut outcome.frame));
        let frame = frame.map_err(|error| refused(&error))?;
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
