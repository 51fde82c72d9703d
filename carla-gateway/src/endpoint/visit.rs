//! The part that an endpoint takes in the clock of a session's world.
//!
//! Somebody has to wait for its ticks, for as long as the session likes, while calls are answered:
//! a task of its own, which tells the server what came of each.

use std::collections::BTreeSet;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use schemas::{ActorId, Command, Error, ErrorCode, Request, ServiceId, SharedFrame};
use schemas::{TickItem, TickOutcome, WorldId, limits};
use tokio::sync::{mpsc, oneshot};
use tokio::task::JoinHandle;

use super::deeds::Deeds;
use super::worlds::first_result;
use crate::site::Site;
use crate::visited::VisitedTick;

/// How long a session waits for clients in synchronous mode that do not tick.
const LEASE_MILLIS: u32 = 5_000;
/// Before a place in a clock is asked for again that was lost.
const PAUSE: Duration = Duration::from_millis(50);
/// Orders that the task has not seen yet, at most.
const ORDERS_MAX: usize = 16;

/// What the task is to do.
#[derive(Debug)]
pub(super) enum Order {
    /// Ask for a tick.
    Tick,
    /// Do not ask for those of before any more, and say when that is so.
    Pause(oneshot::Sender<()>),
}

/// Clients are in the world of a session.
pub(super) struct Visit {
    pub(super) clock: Clock,
    /// The first of the worlds that it goes on from.
    pub(super) root: WorldId,
    /// What clients have done there.
    pub(super) deeds: Deeds,
    /// Clients in synchronous mode have ticked, and the world has not yet.
    pub(super) owes_tick: bool,
    orders: mpsc::Sender<Order>,
    /// Actors that clients brought, and that go with them.
    brought: BTreeSet<ActorId>,
    /// Frames that are to show clients what their settings lead to, without a tick of the world.
    pub(super) trial_frames: u8,
    /// Until then the task may still ask for ticks of before.
    pub(super) pausing: Option<oneshot::Receiver<()>>,
    task: JoinHandle<()>,
}

/// The clock of the world, and the part that the endpoint takes in it.
#[derive(Clone)]
pub(super) struct Clock {
    pub(super) site: Arc<dyn Site>,
    pub(super) world: WorldId,
    pub(super) participant: ServiceId,
}

impl Visit {
    /// Takes part in the clock.
    ///
    /// # Errors
    /// There is no such world, or it is not open.
    pub(super) async fn begin(
        clock: Clock,
        root: WorldId,
        told: mpsc::Sender<VisitedTick>,
    ) -> Result<Self, Error> {
        clock.share(LEASE_MILLIS).await?;
        let (orders, task) = clock.start(told);
        Ok(Self {
            clock,
            root,
            deeds: Deeds::default(),
            owes_tick: false,
            orders,
            brought: BTreeSet::new(),
            trial_frames: 0,
            pausing: None,
            task,
        })
    }

    /// Goes on in another world, in whose clock it takes part already.
    pub(super) fn go_on(&mut self, clock: Clock, deeds: Deeds, told: mpsc::Sender<VisitedTick>) {
        self.task.abort();
        (self.orders, self.task) = clock.start(told);
        (self.clock, self.deeds) = (clock, deeds);
    }

    pub(super) fn order(&self, order: Order) {
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
        let request = Request::ShareClock { world, participant, lease_millis, stands_for: None };
        self.site.ask(request).await.map(drop)
    }

    /// The clock of another world, in which it takes part from now on.
    ///
    /// # Errors
    /// There is no such world any more.
    pub(super) async fn of(&self, world: WorldId) -> Result<Self, Error> {
        let clock = Self { world, ..self.clone() };
        clock.share(LEASE_MILLIS).await?;
        Ok(clock)
    }

    fn start(&self, told: mpsc::Sender<VisitedTick>) -> (mpsc::Sender<Order>, JoinHandle<()>) {
        let (orders, received) = mpsc::channel(ORDERS_MAX);
        (orders, tokio::spawn(self.clone().follow(received, told)))
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
