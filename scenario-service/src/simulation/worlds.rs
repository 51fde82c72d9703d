//! Worlds behind a bus that loses, delays and doubles, of a service that dies.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use schemas::{
    Camera, Error, ErrorCode, Image, MapRef, SharedFrame, SplitMix64, TickItem, TickResult, WorldId,
};
use tokio::sync::oneshot;
use worlds::NewWorld;

use super::clock::Clock;
use crate::testing::ToyWorlds;
use crate::world_port::{Answer, CreatedWorld, WorldPort};

/// The port's deadline, whatever is asked.
pub(super) const DEADLINE_MILLIS: u64 = 10_000;
/// How late a question may be carried out after nobody waits for its answer any more.
pub(super) const LATE_MILLIS: u64 = 15_000;

/// What becomes of a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Answered,
    /// In time, and only just.
    Slow,
    /// Nobody hears the question.
    Lost,
    /// Carried out, and the answer is lost.
    Unanswered,
    /// Carried out after its deadline.
    Late,
    /// Carried out twice; either answer may be the first.
    Doubled,
    /// The answer has fewer parts than it should.
    Short,
}

/// One in so many questions meets one of these.
const FATES: [Fate; 6] =
    [Fate::Slow, Fate::Lost, Fate::Unanswered, Fate::Late, Fate::Doubled, Fate::Short];
const MISFORTUNE: u64 = 12;

/// Toy worlds, and what lies between them and their users.
pub(super) struct UnreliableWorlds {
    pub(super) toys: Arc<ToyWorlds>,
    clock: Clock,
    dice: Mutex<SplitMix64>,
    /// Nothing goes wrong any more.
    is_well: AtomicBool,
    is_down: Arc<AtomicBool>,
    /// How often each of [`FATES`] was met.
    pub(super) met: [AtomicUsize; FATES.len()],
}

impl UnreliableWorlds {
    pub(super) fn new(seed: u64, clock: Clock) -> Self {
        Self {
            toys: Arc::default(),
            clock,
            dice: Mutex::new(SplitMix64::new(seed)),
            is_well: AtomicBool::default(),
            is_down: Arc::default(),
            met: Default::default(),
        }
    }

    /// The service dies with all its worlds, and another takes its place after a while.
    pub(super) fn die(&self, millis: u64) {
        self.toys.crash();
        self.is_down.store(true, Ordering::Relaxed);
        let is_down = Arc::clone(&self.is_down);
        self.clock.after(millis, move || is_down.store(false, Ordering::Relaxed));
    }

    pub(super) fn heal(&self) {
        self.is_well.store(true, Ordering::Relaxed);
    }

    fn fate(&self) -> (Fate, u64) {
        let mut dice = self.dice.lock().unwrap();
        let millis = 1 + dice.next_u64() % 20;
        if self.is_well.load(Ordering::Relaxed) || !dice.next_u64().is_multiple_of(MISFORTUNE) {
            return (Fate::Answered, millis);
        }
        let index = (dice.next_u64() % FATES.len() as u64) as usize;
        self.met[index].fetch_add(1, Ordering::Relaxed);
        (FATES[index], millis)
    }

    /// Asks, as fate will have it; `shorten` takes a part of the answer away.
    fn ask<T: Send + 'static>(
        &self,
        act: impl Fn(&ToyWorlds) -> Result<T, Error> + Send + Sync + 'static,
        shorten: fn(T) -> T,
    ) -> Answer<'_, T> {
        let (fate, millis) = self.fate();
        let (answer, answered) = oneshot::channel();
        let slot = Arc::new(Mutex::new(Some(answer)));
        let give = move |slot: &Mutex<Option<oneshot::Sender<_>>>, result| {
            if let Some(answer) = slot.lock().unwrap().take() {
                // Whoever asked may have gone.
                let _ = answer.send(result);
            }
        };
        let (toys, is_down) = (Arc::clone(&self.toys), Arc::clone(&self.is_down));
        let act = Arc::new(move || match is_down.load(Ordering::Relaxed) {
            true => Err(Error::new(ErrorCode::Unreachable, "no world service is up")),
            false => act(&toys),
        });
        let at_deadline = Arc::clone(&slot);
        self.clock.after(DEADLINE_MILLIS, move || {
            give(&at_deadline, Err(Error::new(ErrorCode::TimedOut, "no answer in time")));
        });
        let (is_told, delays_millis) = match fate {
            Fate::Answered | Fate::Short => (true, vec![millis]),
            Fate::Slow => (true, vec![DEADLINE_MILLIS - millis]),
            Fate::Lost => (false, vec![]),
            Fate::Unanswered => (false, vec![millis]),
            Fate::Late => (false, vec![DEADLINE_MILLIS + LATE_MILLIS - millis]),
            Fate::Doubled => (true, vec![millis, 2 * millis]),
        };
        // Of two that are carried out either may be the one whose answer arrives.
        let told = if millis % 2 == 0 { 0 } else { delays_millis.len().saturating_sub(1) };
        for (index, delay_millis) in delays_millis.into_iter().enumerate() {
            let (act, slot) = (Arc::clone(&act), Arc::clone(&slot));
            self.clock.after(delay_millis, move || {
                let result = act();
                if is_told && index == told {
                    let is_short = fate == Fate::Short;
                    give(&slot, if is_short { result.map(shorten) } else { result });
                }
            });
        }
        Box::pin(async move { answered.await.unwrap() })
    }
}

fn whole<T>(answer: T) -> T {
    answer
}

fn without_last<T>(mut answer: Vec<T>) -> Vec<T> {
    answer.pop();
    answer
}

impl WorldPort for UnreliableWorlds {
    fn create(&self, new: NewWorld) -> Answer<'_, CreatedWorld> {
        self.ask(move |toys| toys.make(&new), whole)
    }

    fn destroy(&self, world: WorldId) -> Answer<'_, ()> {
        self.ask(move |toys| toys.end(world), whole)
    }

    fn fork(&self, world: WorldId) -> Answer<'_, WorldId> {
        self.ask(move |toys| toys.copy(world), whole)
    }

    fn snapshot(&self, world: WorldId) -> Answer<'_, Vec<u8>> {
        self.ask(move |toys| toys.save(world), whole)
    }

    fn restore(&self, snapshot: Vec<u8>) -> Answer<'_, CreatedWorld> {
        self.ask(move |toys| toys.load(&snapshot), whole)
    }

    fn owned(&self) -> Answer<'_, Vec<WorldId>> {
        self.ask(|toys| Ok(toys.ids()), without_last)
    }

    fn tick(&self, items: Vec<TickItem>) -> Answer<'_, Vec<TickResult>> {
        let result = |toys: &ToyWorlds, item: &TickItem| TickResult {
            world: item.world,
            outcome: toys.tick_one(item),
        };
        let tick =
            move |toys: &ToyWorlds| Ok(items.iter().map(|item| result(toys, item)).collect());
        self.ask(tick, without_last)
    }

    fn draw(&self, frame: SharedFrame, cameras: Vec<Camera>) -> Answer<'_, Vec<Image>> {
        let draw = move |_: &ToyWorlds| {
            let image = |camera: &Camera| Image {
                camera: camera.id,
                width_px: camera.width_px,
                height_px: camera.height_px,
                kind: camera.kind,
                encoding: camera.encoding,
                data: frame.state_hash.to_le_bytes().to_vec(),
            };
            Ok(cameras.iter().map(image).collect())
        };
        self.ask(draw, without_last)
    }

    fn maps(&self) -> Answer<'_, Vec<MapRef>> {
        let list = |_: &ToyWorlds| {
            let map = crate::testing::map();
            Ok(vec![MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() }])
        };
        self.ask(list, whole)
    }

    fn map_text(&self, _: String) -> Answer<'_, Vec<u8>> {
        unreachable!("the only map is known")
    }
}
