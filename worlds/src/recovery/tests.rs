//! Worlds that are made again, of toys.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use schemas::wire::encode_frame;
use schemas::{MapRef, Tick};

use super::*;

/// Worlds whose state is a number, which every command and tick changes.
#[derive(Default)]
struct Toys {
    worlds: Mutex<BTreeMap<WorldId, (u64, u64)>>,
    made: AtomicUsize,
    /// How many attempts to make one fail, and how.
    failures: Mutex<Vec<ErrorCode>>,
    /// How many questions for one are lost before.
    lost: AtomicUsize,
}

impl Toys {
    fn frame(world: WorldId, (tick, hash): (u64, u64)) -> EncodedFrame {
        let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
        let empty = Frame::empty(world, map);
        encode_frame(&Frame { tick: Tick(tick), state_hash: hash, ..empty })
    }

    /// How a world is after the same things were done in it.
    fn seen(&self, world: WorldId) -> SharedFrame {
        let state = self.worlds.lock().unwrap()[&world];
        SharedFrame::decode(Self::frame(world, state)).unwrap()
    }
}

impl Maker for Toys {
    type World = WorldId;

    async fn make(&self, state: &State) -> Result<(EncodedFrame, WorldId), Error> {
        let is_lost = |left: usize| left.checked_sub(1);
        if self.lost.fetch_update(Ordering::Relaxed, Ordering::Relaxed, is_lost).is_ok() {
            return std::future::pending().await;
        }
        if let Some(code) = self.failures.lock().unwrap().pop() {
            return Err(Error::new(code, "a toy"));
        }
        let world = WorldId::of_host(1, self.made.fetch_add(1, Ordering::Relaxed) as u64 + 1);
        let state = match state {
            State::New(new) => (0, new.seed),
            State::Snapshot(bytes) => (u64::from(bytes[0]), u64::from(bytes[1])),
        };
        self.worlds.lock().unwrap().insert(world, state);
        Ok((Self::frame(world, state), world))
    }

    fn id(world: &WorldId) -> WorldId {
        *world
    }

    async fn tick(&self, item: TickItem) -> Result<EncodedFrame, Error> {
        let mut worlds = self.worlds.lock().unwrap();
        let (tick, hash) = worlds.get_mut(&item.world).unwrap();
        assert_eq!(item.expected_tick, Some(Tick(*tick)));
        for command in &item.commands {
            let Command::DestroyActor { actor } = command else { panic!("a toy") };
            *hash = hash.wrapping_mul(31) + u64::from(actor.get());
        }
        for _ in 0..item.tick_count {
            *tick += 1;
            *hash = hash.wrapping_mul(37) + item.dt_secs.map_or(1, f64::to_bits);
        }
        Ok(Self::frame(item.world, (*tick, *hash)))
    }
}

fn commands(actors: &[u32]) -> Vec<Command> {
    let destroy = |actor: &u32| Command::DestroyActor { actor: ActorId::new(*actor).unwrap() };
    actors.iter().map(destroy).collect()
}

fn new_world() -> State {
    State::New(NewWorld {
        map: "Town".to_owned(),
        seed: 7,
        dt_secs: 0.05,
        commands: Vec::new(),
        traffic: false,
        first_actor: ActorId::FIRST,
    })
}

fn budget() -> Arc<Budget> {
    Budget::new(1 << 20)
}

/// A world in which something was done, and what was kept of that.
async fn drive(toys: &Toys, state: State) -> (WorldId, Recovery) {
    let (_, world) = toys.make(&state).await.unwrap();
    let mut recovery = Recovery::new(state, &budget()).unwrap();
    let done: [(&[u32], u32, Option<f64>); 3] =
        [(&[1, 2], 1, None), (&[], 3, Some(0.1)), (&[3], 0, None)];
    for (actors, tick_count, dt_secs) in done {
        let expected_tick = Some(toys.seen(world).tick);
        let item = TickItem {
            commands: commands(actors),
            expected_tick,
            dt_secs,
            ..TickItem::new(world, tick_count)
        };
        toys.tick(item).await.unwrap();
        assert!(recovery.note(commands(actors), tick_count, dt_secs));
    }
    (world, recovery)
}

#[tokio::test]
async fn a_world_is_made_again_with_all_that_was_done_in_it() {
    for state in [new_world(), State::Snapshot(vec![9, 4])] {
        let toys = Toys::default();
        let (world, recovery) = drive(&toys, state).await;
        let seen = toys.seen(world);
        let Remade::Whole(again) = recovery.remake(&toys, Seen::Alone(&seen)).await else {
            panic!("not made")
        };
        assert_ne!(again, world);
        assert!(is_same(&toys.seen(again), &seen));
    }
}

#[tokio::test]
async fn a_world_that_went_another_way_is_not_used() {
    let toys = Toys::default();
    let (world, mut recovery) = drive(&toys, new_world()).await;
    let seen = toys.seen(world);
    assert!(recovery.note(commands(&[4]), 0, None));
    let remade = recovery.remake(&toys, Seen::Alone(&seen)).await;
    assert!(matches!(remade, Remade::Never(_)), "{remade:?}");
    // Others may have led it there.
    let remade = recovery.remake(&toys, Seen::WithOthers(&seen)).await;
    assert!(matches!(remade, Remade::Whole(_)), "{remade:?}");
    assert!(recovery.note(Vec::new(), 1, None));
    let remade = recovery.remake(&toys, Seen::WithOthers(&seen)).await;
    assert!(matches!(remade, Remade::Never(_)), "another tick: {remade:?}");
}

#[tokio::test]
async fn services_that_come_and_go_are_tried_again_and_full_ones_later() {
    let toys = Toys::default();
    let (world, recovery) = drive(&toys, new_world()).await;
    let seen = toys.seen(world);
    let remade = async |failures: &[ErrorCode]| {
        *toys.failures.lock().unwrap() = failures.to_vec();
        recovery.remake(&toys, Seen::Alone(&seen)).await
    };
    use ErrorCode::{Capacity, InvalidMessage, TimedOut, Unreachable};
    assert!(matches!(remade(&[Unreachable, TimedOut]).await, Remade::Whole(_)));
    assert!(matches!(remade(&[Unreachable; 3]).await, Remade::Later(_)));
    assert!(matches!(remade(&[Capacity]).await, Remade::Later(_)));
    assert!(matches!(remade(&[InvalidMessage]).await, Remade::Never(_)));
}

/// However many ticks would have to be repeated after it: that would be 13 s.
#[tokio::test]
async fn a_question_that_is_lost_takes_only_its_own_time() {
    let toys = Toys::default();
    let (world, mut recovery) = drive(&toys, new_world()).await;
    let item = TickItem { expected_tick: None, ..TickItem::new(world, 1) };
    for _ in 0..RECOVERY_TICKS - 4 {
        let expected_tick = Some(toys.seen(world).tick);
        toys.tick(TickItem { expected_tick, ..item.clone() }).await.unwrap();
        assert!(recovery.note(Vec::new(), 1, None));
    }
    let seen = toys.seen(world);
    toys.lost.store(1, Ordering::Relaxed);
    let remade =
        tokio::time::timeout(3 * PATIENCE[0], recovery.remake(&toys, Seen::Alone(&seen))).await;
    assert!(matches!(remade, Ok(Remade::Whole(_))), "{remade:?}");
}

#[test]
fn what_is_kept_stays_within_the_budget_and_is_given_back() {
    let budget = Budget::new(2_000);
    let snapshot = || State::Snapshot(vec![0; 1_000]);
    let first = Recovery::new(snapshot(), &budget);
    assert!(first.is_some() && Recovery::new(snapshot(), &budget).is_none());
    let mut first = first.unwrap();
    while first.note(Vec::new(), 1, None) {}
    assert!(budget.used() <= 2_000);
    drop(first);
    assert_eq!(budget.used(), 0);
    assert!(Recovery::new(snapshot(), &Budget::new(0)).is_none());
}

#[test]
fn what_commands_hold_is_counted() {
    let text = "x".repeat(1_000);
    let sensor = ActorId::FIRST;
    let send = vec![Command::Sensor(SensorCommand::SendV2x { sensor, text })];
    let mut recovery = Recovery::new(State::Snapshot(Vec::new()), &budget()).unwrap();
    let times = RECOVERY_BYTES / 1_000;
    for _ in 0..times {
        assert!(recovery.note(send.clone(), 0, None));
    }
    assert!(recovery.is_long_with(&[], 0));
}

#[test]
fn a_new_state_is_due_after_many_ticks() {
    let mut recovery = Recovery::new(State::Snapshot(Vec::new()), &budget()).unwrap();
    assert!(!recovery.is_long_with(&[], RECOVERY_TICKS - 1));
    assert!(recovery.note(Vec::new(), RECOVERY_TICKS - 1, None));
    assert!(recovery.is_long_with(&[], 1));
    recovery.miss();
    assert!(!recovery.is_long_with(&[], 1) && recovery.is_long_with(&[], RECOVERY_TICKS + 1));
}
