//! Group commit for ticks: many sessions share one round trip to a world service.
//!
//! A step that finds no round trip under way is sent at once. Steps that come while one is under
//! way wait for it and then go out together. Each world service has queues of its own, so that who
//! has a world on one does not wait for another that is slow or stands still. Its worlds are
//! divided among a few as it divides them among its threads, by their ids: who asks one thread need
//! not wait for another.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemas::limits::WORLDS_PER_BATCH_MAX;
use schemas::{Error, ErrorCode, TickItem, TickOutcome, TickResult, WorldId};
use tokio::sync::oneshot;

use crate::world_port::WorldPort;

/// Requests of more ticks than this go alone: nobody else's step is to wait for them.
const TOGETHER_TICKS_MAX: u32 = 10;
/// Round trips under way at once to one service: more would be small and wait for the same threads.
const QUEUES: u64 = 2;

type Waiter = oneshot::Sender<Result<TickOutcome, Error>>;

/// Sends the ticks of all sessions. Cheap to clone.
#[derive(Clone)]
pub(crate) struct Ticker {
    shared: Arc<Shared>,
}

struct Shared {
    port: Arc<dyn WorldPort>,
    /// What waits for each round trip that is under way.
    under_way: Mutex<BTreeMap<QueueName, Queue>>,
}

/// The number of a world service, and which of its queues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct QueueName(u32, u64);

/// Bounded by the number of sessions, each of which waits for its only step.
#[derive(Default)]
struct Queue {
    items: Vec<TickItem>,
    waiters: Vec<Waiter>,
}

/// One of the queues.
#[derive(Clone)]
struct WorldQueue {
    shared: Arc<Shared>,
    name: QueueName,
}

/// Sees to it that the queue goes on, even if the session that holds it is cancelled.
struct QueueRelease<'a>(&'a WorldQueue);

impl Ticker {
    /// A ticker of one port.
    pub(crate) fn new(port: Arc<dyn WorldPort>) -> Self {
        Self { shared: Arc::new(Shared { port, under_way: Mutex::default() }) }
    }

    /// Carries out one item, alone or together with others: alone where it takes long, or waits for
    /// others who share the clock of its world.
    ///
    /// # Errors
    /// Those of the port, and of the item's own world.
    pub(crate) async fn tick(&self, item: TickItem) -> Result<TickOutcome, Error> {
        if item.tick_count > TOGETHER_TICKS_MAX || item.participant.is_some() {
            return self.shared.alone(item).await;
        }
        self.queue(item.world).tick(item).await
    }

    /// Items that wait for the round trip before theirs.
    pub(crate) fn waiting(&self) -> usize {
        self.shared.lock().values().map(|queue| queue.items.len()).sum()
    }

    /// Whether nothing waits or is under way.
    #[cfg(test)]
    pub(crate) fn is_idle(&self) -> bool {
        self.shared.lock().is_empty()
    }

    fn queue(&self, world: WorldId) -> WorldQueue {
        let name = QueueName(world.host(), world.get() % QUEUES);
        WorldQueue { shared: Arc::clone(&self.shared), name }
    }
}

impl Shared {
    async fn alone(&self, item: TickItem) -> Result<TickOutcome, Error> {
        match self.port.tick(vec![item]).await?.pop() {
            Some(result) => result.outcome,
            None => Err(short_answer()),
        }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<QueueName, Queue>> {
        // Nothing panics while it holds the lock.
        self.under_way.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl WorldQueue {
    async fn tick(&self, item: TickItem) -> Result<TickOutcome, Error> {
        let (mine, answer) = match self.shared.lock().entry(self.name) {
            Entry::Occupied(mut waiting) => {
                let (sender, receiver) = oneshot::channel();
                waiting.get_mut().items.push(item);
                waiting.get_mut().waiters.push(sender);
                (None, Some(receiver))
            }
            Entry::Vacant(idle) => {
                idle.insert(Queue::default());
                (Some(item), None)
            }
        };
        if let Some(item) = mine {
            let release = QueueRelease(self);
            let outcome = self.shared.alone(item).await;
            drop(release);
            return outcome;
        }
        match answer {
            Some(answer) => answer.await.unwrap_or_else(|_| Err(short_answer())),
            None => Err(short_answer()),
        }
    }

    /// What waits, up to one batch; releases the queue when nothing does.
    fn next_batch(&self) -> Option<(Vec<TickItem>, Vec<Waiter>)> {
        let mut under_way = self.shared.lock();
        let queue = under_way.get_mut(&self.name)?;
        if queue.items.is_empty() {
            under_way.remove(&self.name);
            return None;
        }
        let rest = queue.items.len().min(WORLDS_PER_BATCH_MAX);
        let later = (queue.items.split_off(rest), queue.waiters.split_off(rest));
        let items = std::mem::replace(&mut queue.items, later.0);
        Some((items, std::mem::replace(&mut queue.waiters, later.1)))
    }

    async fn drain(self, first: (Vec<TickItem>, Vec<Waiter>)) {
        let mut batch = Some(first);
        while let Some((items, waiters)) = batch {
            match self.shared.port.tick(items).await {
                Ok(results) => dispatch(results, waiters),
                Err(error) => {
                    for waiter in waiters {
                        // A session that went away does not want its answer.
                        let _ = waiter.send(Err(error.clone()));
                    }
                }
            }
            batch = self.next_batch();
        }
    }
}

impl Drop for QueueRelease<'_> {
    fn drop(&mut self) {
        if let Some(batch) = self.0.next_batch() {
            tokio::spawn(self.0.clone().drain(batch));
        }
    }
}

/// Results come in the order of their items; a waiter without one learns that by its closed
/// channel.
fn dispatch(results: Vec<TickResult>, waiters: Vec<Waiter>) {
    for (result, waiter) in results.into_iter().zip(waiters) {
        // A session that went away does not want its answer.
        let _ = waiter.send(result.outcome);
    }
}

fn short_answer() -> Error {
    Error::new(ErrorCode::InvalidMessage, "the world service answered with too few results")
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use schemas::{Camera, EncodedFrame, Image, MapRef, SharedFrame, WorldId};
    use worlds::NewWorld;

    use super::*;
    use crate::world_port::{Answer, CreatedWorld};

    /// The number of a world service that never answers.
    const STOPPED: u32 = 9;

    /// Answers a batch after a while and counts them; world 13 does not exist.
    #[derive(Default)]
    struct Slow {
        batches: AtomicUsize,
        largest: AtomicUsize,
    }

    impl WorldPort for Slow {
        fn create(&self, _: NewWorld) -> Answer<'_, CreatedWorld> {
            unreachable!("a ticker creates nothing")
        }

        fn destroy(&self, _: WorldId) -> Answer<'_, ()> {
            unreachable!("a ticker destroys nothing")
        }

        fn fork(&self, _: WorldId) -> Answer<'_, WorldId> {
            unreachable!("a ticker forks nothing")
        }

        fn snapshot(&self, _: WorldId) -> Answer<'_, Vec<u8>> {
            unreachable!("a ticker keeps no states")
        }

        fn restore(&self, _: Vec<u8>) -> Answer<'_, CreatedWorld> {
            unreachable!("a ticker restores nothing")
        }

        fn owned(&self) -> Answer<'_, Vec<WorldId>> {
            unreachable!("a ticker asks for no list")
        }

        fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>> {
            self.batches.fetch_add(1, Ordering::Relaxed);
            self.largest.fetch_max(items.len(), Ordering::Relaxed);
            Box::pin(async move {
                if items.iter().any(|item| item.world.host() == STOPPED) {
                    return std::future::pending().await;
                }
                tokio::time::sleep(Duration::from_millis(20)).await;
                let answer = |item: TickItem| {
                    let frame = EncodedFrame(item.world.get().to_le_bytes().to_vec());
                    let outcome = TickOutcome::new(frame);
                    let gone = Error::new(ErrorCode::UnknownWorld, "no such world");
                    let known = item.world.get() != 13;
                    TickResult {
                        world: item.world,
                        outcome: if known { Ok(outcome) } else { Err(gone) },
                    }
                };
                Ok(items.into_iter().map(answer).collect())
            })
        }

        fn draw(&self, _: SharedFrame, _: Vec<Camera>) -> Answer<'_, Vec<Image>> {
            unreachable!("a ticker draws nothing")
        }

        fn maps(&self) -> Answer<'_, Vec<MapRef>> {
            unreachable!("a ticker needs no maps")
        }

        fn map_text(&self, _: String) -> Answer<'_, Vec<u8>> {
            unreachable!("a ticker needs no maps")
        }
    }

    fn item(world: u64) -> TickItem {
        TickItem::new(WorldId::new(world).unwrap(), 1)
    }

    #[tokio::test]
    async fn steps_that_wait_for_a_round_trip_go_out_together_and_each_gets_its_own_answer() {
        let port = Arc::new(Slow::default());
        let ticker = Ticker::new(Arc::clone(&port) as Arc<dyn WorldPort>);
        let steps = (1..=50).map(|world| {
            let ticker = ticker.clone();
            tokio::spawn(async move { (world, ticker.tick(item(world)).await) })
        });
        for step in steps.collect::<Vec<_>>() {
            let (world, outcome) = step.await.unwrap();
            match outcome {
                Ok(outcome) => assert_eq!(outcome.frame.0, world.to_le_bytes()),
                Err(error) => assert_eq!((world, error.code), (13, ErrorCode::UnknownWorld)),
            }
        }
        assert_eq!(port.batches.load(Ordering::Relaxed), 2 * QUEUES as usize);
        assert_eq!(port.largest.load(Ordering::Relaxed), 24);
    }

    #[tokio::test]
    async fn who_asks_another_thread_of_the_world_service_does_not_wait() {
        let port = Arc::new(Slow::default());
        let ticker = Ticker::new(Arc::clone(&port) as Arc<dyn WorldPort>);
        let steps = [1, 2].map(|world| {
            let ticker = ticker.clone();
            tokio::spawn(async move { ticker.tick(item(world)).await })
        });
        let asked = || port.batches.load(Ordering::Relaxed);
        while asked() < 2 && !steps[0].is_finished() {
            tokio::task::yield_now().await;
        }
        assert_eq!((asked(), steps[0].is_finished()), (2, false));
    }

    #[tokio::test]
    async fn who_asks_for_many_ticks_goes_alone_and_nobody_waits_for_that() {
        let port = Arc::new(Slow::default());
        let ticker = Ticker::new(Arc::clone(&port) as Arc<dyn WorldPort>);
        let long = tokio::spawn({
            let ticker = ticker.clone();
            let item = TickItem { tick_count: TOGETHER_TICKS_MAX + 1, ..item(1) };
            async move { ticker.tick(item).await }
        });
        let asked = || port.batches.load(Ordering::Relaxed);
        while asked() < 1 {
            tokio::task::yield_now().await;
        }
        let short = tokio::spawn(async move { ticker.tick(item(3)).await });
        while asked() < 2 && !long.is_finished() {
            tokio::task::yield_now().await;
        }
        assert_eq!((asked(), long.is_finished()), (2, false), "the same queue, and not behind it");
        assert!(short.await.unwrap().is_ok() && long.await.unwrap().is_ok());
    }

    #[tokio::test]
    async fn a_cancelled_step_does_not_hold_up_those_behind_it() {
        let ticker = Ticker::new(Arc::new(Slow::default()));
        let first = tokio::spawn({
            let ticker = ticker.clone();
            async move { ticker.tick(item(1)).await }
        });
        while ticker.is_idle() {
            tokio::task::yield_now().await;
        }
        let second = tokio::spawn({
            let ticker = ticker.clone();
            async move { ticker.tick(item(3)).await }
        });
        while ticker.waiting() == 0 {
            tokio::task::yield_now().await;
        }
        first.abort();
        let answer = tokio::time::timeout(Duration::from_secs(5), second).await;
        assert!(answer.unwrap().unwrap().is_ok());
        assert!(ticker.tick(item(5)).await.is_ok());
    }
    #[tokio::test]
    async fn nobody_waits_for_a_world_service_that_stands_still_but_who_has_a_world_there() {
        let ticker = Ticker::new(Arc::new(Slow::default()));
        let ask = |world: WorldId| {
            let ticker = ticker.clone();
            tokio::spawn(async move { ticker.tick(TickItem::new(world, 1)).await })
        };
        let stopped: Vec<_> = (1..=4).map(|count| ask(WorldId::of_host(STOPPED, count))).collect();
        while ticker.waiting() < 2 {
            tokio::task::yield_now().await;
        }
        let quick: Vec<_> = (1..=8).map(|count| ask(WorldId::of_host(1, count))).collect();
        for step in quick {
            let answer = tokio::time::timeout(Duration::from_secs(5), step).await;
            assert!(answer.expect("it waits for another service").unwrap().is_ok());
        }
        assert!(stopped.iter().all(|step| !step.is_finished()));
        assert_eq!(ticker.waiting(), 2, "the stopped service has a queue for each of its threads");
        stopped.iter().for_each(tokio::task::JoinHandle::abort);
    }
}
