//! Shards without bus, threads or clock: quarantine, leases, harmless retries.

use std::cell::RefCell;
use std::io::Write;
use std::sync::{Arc, Mutex, mpsc};
use std::time::{Duration, Instant};

use schemas::{ActorId, Collision, Command, CommandReply, EncodedFrame, Error, ErrorCode, Frame};
use schemas::{
    Lease, MapRef, Reply, SensorDatum, Tenant, Tick, TickItem, TickOutcome, WorldId, WorldInfo,
};
use world::{Town, World};
use world_service::journal::{Scribe, Writer};
use world_service::service::{
    Answer, Gather, Hosted, Ids, Job, NewJournal, NewWorld, Outlet, Question, Seats, Shard,
    Simulation, WorldWork,
};

use crate::common::{MAP, car, decoded, tenant, ticks};

/// A real world that breaks on demand.
pub(crate) struct Fragile {
    world: World,
    breaks: Option<Break>,
}

#[derive(Clone, Copy)]
enum Break {
    Panics,
    Diverges,
}

/// The command that makes the next tick break.
fn break_by(how: Break) -> Command {
    let actor = ActorId::new(u32::MAX - how as u32).unwrap();
    Command::DestroyActor { actor }
}

impl Simulation for Fragile {
    type Town = Town;

    fn create(new: NewWorld<Town>) -> Result<Self, Error> {
        Ok(Self { world: Simulation::create(new)?, breaks: None })
    }

    fn restore(
        snapshot: &[u8],
        id: WorldId,
        epoch: u64,
        town_of: &dyn Fn(&MapRef) -> Option<Arc<Town>>,
    ) -> Result<Self, Error> {
        Ok(Self { world: Simulation::restore(snapshot, id, epoch, town_of)?, breaks: None })
    }

    fn snapshot(&self) -> Vec<u8> {
        self.world.snapshot()
    }

    fn fork(&self, id: WorldId) -> Self {
        Self { world: self.world.fork(id), breaks: self.breaks }
    }

    fn apply(&mut self, command: &Command) -> CommandReply {
        for how in [Break::Panics, Break::Diverges] {
            if *command == break_by(how) {
                self.breaks = Some(how);
                return Ok(None);
            }
        }
        self.world.apply(command)
    }

    fn tick(&mut self, dt_secs: Option<f64>) -> Result<(), Error> {
        match self.breaks {
            None => Simulation::tick(&mut self.world, dt_secs),
            Some(Break::Panics) => panic!("a wheel came off"),
            Some(Break::Diverges) => Err(Error::new(ErrorCode::WorldQuarantined, "not a number")),
        }
    }

    fn frame(&self) -> Frame {
        self.world.frame()
    }

    fn tick_number(&self) -> Tick {
        self.world.tick_number()
    }

    fn collisions(&self) -> &[Collision] {
        self.world.collisions()
    }

    fn sensors(&self) -> &[SensorDatum] {
        self.world.sensors()
    }

    fn cameras_due(&self) -> &[ActorId] {
        self.world.cameras_due()
    }

    fn answer(&self, question: &Question) -> Result<Reply, Error> {
        self.world.answer(question)
    }

    fn actor_count(&self) -> usize {
        self.world.actor_count()
    }

    fn map(&self) -> &MapRef {
        self.world.map_ref()
    }

    fn map_text(&self) -> &str {
        self.world.map_text()
    }
}

/// Nobody listens; forks and journals are kept.
#[derive(Default)]
pub(crate) struct Nobody {
    adopted: RefCell<Vec<(WorldId, Hosted<Fragile>)>>,
    pub(crate) journal: Shared,
}

/// A file in memory.
#[derive(Clone, Default)]
pub(crate) struct Shared(pub(crate) Arc<Mutex<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Outlet<Fragile> for Nobody {
    fn has_listeners(&self) -> bool {
        false
    }

    fn publish(&self, _: &Tenant, _: WorldId, _: &EncodedFrame) {}

    fn journal(&self, wanted: NewJournal<'_>) -> Result<(String, Box<dyn Scribe>), Error> {
        let writer = Writer::begin(self.journal.clone(), 1 << 30, &wanted.head).unwrap();
        Ok((wanted.name.unwrap_or_default().to_owned(), Box::new(writer)))
    }

    fn adopt(&self, id: WorldId, world: Hosted<Fragile>) {
        self.adopted.borrow_mut().push((id, world));
    }
}

/// One shard, its ids, and a clock that only moves when told.
pub(crate) struct Bench {
    pub(crate) shard: Shard<Fragile>,
    pub(crate) outlet: Nobody,
    ids: Arc<Ids>,
    seats: Seats,
    town: Arc<Town>,
    pub(crate) now: Instant,
}

/// Passes replies on.
pub(crate) fn answer(sender: mpsc::SyncSender<Reply>) -> Answer {
    Box::new(move |reply| sender.send(reply).unwrap())
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with_slow(Duration::MAX)
    }

    /// With a shard for which ticks are slow that take longer.
    pub(crate) fn with_slow(slow: Duration) -> Self {
        let text = roads::town::build(MAP).unwrap();
        let town = Arc::new(Town::new(Arc::new(roads::Map::parse(MAP, &text).unwrap())));
        let (ids, seats) = (Arc::new(Ids::new(1)), Seats::new(16));
        let shard = Shard::new(Arc::clone(&ids), seats.clone(), slow);
        Self { shard, outlet: Nobody::default(), ids, seats, town, now: Instant::now() }
    }

    fn answered(&mut self, job: impl FnOnce(Answer) -> Job<Fragile>) -> Reply {
        let replies = self.begin(job);
        while self.shard.is_running() {
            self.shard.go_on(self.now, &self.outlet);
        }
        for (id, world) in self.outlet.adopted.take() {
            self.shard.adopt(self.now, id, world);
        }
        replies.try_recv().expect("every job is answered")
    }

    /// Hands a job in, and does no tick of those that are done one by one.
    pub(crate) fn begin(
        &mut self,
        job: impl FnOnce(Answer) -> Job<Fragile>,
    ) -> mpsc::Receiver<Reply> {
        let (sender, replies) = mpsc::sync_channel(1);
        self.shard.handle(self.now, job(answer(sender)), &self.outlet);
        replies
    }

    /// Hands in a request for ticks.
    pub(crate) fn begin_ticks(&mut self, item: TickItem) -> mpsc::Receiver<Reply> {
        self.begin(|answer| Job::Tick {
            tenant: Some(tenant()),
            items: vec![(0, item)],
            gather: Gather::new(1, answer, Reply::Ticked),
        })
    }

    pub(crate) fn create(&mut self, seed: u64, lease: Option<Lease>) -> WorldId {
        let new = NewWorld {
            id: self.ids.next(),
            epoch: 1,
            seed,
            dt_secs: 0.05,
            town: Arc::clone(&self.town),
            traffic: false,
            first_actor: ActorId::FIRST,
        };
        let seat = self.seats.take(1).unwrap().pop().unwrap();
        let create = |answer| Job::Create {
            new,
            tenant: tenant(),
            commands: vec![car()],
            lease,
            seat,
            answer,
        };
        match self.answered(create) {
            Reply::WorldCreated { world, .. } => world,
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn tick(&mut self, item: TickItem) -> Result<TickOutcome, Error> {
        let tick = |answer| Job::Tick {
            tenant: Some(tenant()),
            items: vec![(0, item)],
            gather: Gather::new(1, answer, Reply::Ticked),
        };
        match self.answered(tick) {
            Reply::Ticked(mut results) => results.remove(0).outcome,
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn work(&mut self, world: WorldId, work: WorldWork) -> Reply {
        self.answered(|answer| Job::World { tenant: tenant(), world, work, answer })
    }

    pub(crate) fn list(&mut self) -> Vec<WorldInfo> {
        let finish = |parts: Vec<Vec<WorldInfo>>| Reply::Worlds(parts.concat());
        let list = |answer| Job::List {
            tenant: tenant(),
            index: 0,
            gather: Gather::new(1, answer, finish),
        };
        match self.answered(list) {
            Reply::Worlds(worlds) => worlds,
            other => panic!("{other:?}"),
        }
    }

    fn hashes_of_20_ticks(&mut self, world: WorldId) -> Vec<u64> {
        (0..20).map(|_| decoded(&self.tick(ticks(world, 1)).unwrap().frame).state_hash).collect()
    }
}

#[test]
fn a_broken_world_is_put_aside_and_its_neighbours_go_on_bit_for_bit() {
    let quiet = {
        let mut bench = Bench::new();
        let world = bench.create(7, None);
        bench.hashes_of_20_ticks(world)
    };
    for (how, reason) in [(Break::Panics, "a wheel came off"), (Break::Diverges, "not a number")] {
        let mut bench = Bench::new();
        let (before, broken, after) =
            (bench.create(7, None), bench.create(7, None), bench.create(7, None));
        bench.tick(ticks(broken, 3)).unwrap();
        let fatal = TickItem { commands: vec![break_by(how)], ..ticks(broken, 1) };
        let error = bench.tick(fatal).unwrap_err();
        assert_eq!(error.code, ErrorCode::WorldQuarantined, "{error}");
        assert!(error.message.contains(reason), "{error}");
        assert_eq!(bench.hashes_of_20_ticks(before), quiet);
        assert_eq!(bench.hashes_of_20_ticks(after), quiet);

        let listed = bench.list().into_iter().find(|info| info.world == broken).unwrap();
        assert!(listed.quarantined.unwrap().contains(reason));
        assert_eq!((listed.tick, listed.actor_count), (Tick(3), 1));
        for work in [WorldWork::Snapshot, WorldWork::Commands(Vec::new())] {
            let Reply::Error(error) = bench.work(broken, work) else { panic!("done") };
            assert_eq!(error.code, ErrorCode::WorldQuarantined);
        }
        assert_eq!(bench.work(broken, WorldWork::Destroy), Reply::Done);
        assert_eq!(bench.list().len(), 2);
    }
}

#[test]
fn a_repeated_tick_with_an_expected_tick_is_done_once() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    let step = TickItem { expected_tick: Some(Tick(0)), ..ticks(world, 1) };
    let once = bench.tick(step.clone()).unwrap();
    assert_eq!(bench.tick(step).unwrap_err().code, ErrorCode::WrongTick);
    assert_eq!(bench.tick(ticks(world, 0)).unwrap().frame, once.frame);
}

#[test]
fn a_tick_may_have_its_own_length_and_a_wrong_one_changes_nothing() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    let longer = TickItem { dt_secs: Some(0.1), ..ticks(world, 2) };
    let frame = decoded(&bench.tick(longer).unwrap().frame);
    assert_eq!((frame.dt_secs, frame.sim_secs), (0.1, 0.2));
    for dt_secs in [0.0, 0.5, f64::NAN] {
        let wrong = TickItem { dt_secs: Some(dt_secs), commands: vec![car()], ..ticks(world, 1) };
        assert_eq!(bench.tick(wrong).unwrap_err().code, ErrorCode::InvalidArgument);
    }
    assert_eq!(decoded(&bench.tick(ticks(world, 0)).unwrap().frame), frame);
}

#[test]
fn a_lease_runs_from_the_owners_end_and_stops_when_it_is_back() {
    let mut bench = Bench::new();
    let owner = |bench: &mut Bench, is_up| {
        let job = Job::Owner { id: "s".parse().unwrap(), is_up, now: bench.now };
        bench.shard.handle(bench.now, job, &bench.outlet);
    };
    owner(&mut bench, true);
    bench.create(1, Some(Lease { owner: "s".parse().unwrap(), millis: 1_000 }));
    assert_eq!(bench.shard.next_end(), None, "the owner is up");
    owner(&mut bench, false);
    let end = bench.now + Duration::from_millis(1_000);
    assert_eq!(bench.shard.next_end(), Some(end));
    bench.shard.expire_leases(end - Duration::from_millis(1), &bench.outlet);
    assert_eq!(bench.list().len(), 1);
    owner(&mut bench, true);
    bench.shard.expire_leases(end, &bench.outlet);
    assert_eq!(bench.list().len(), 1, "the owner came back in time");
    owner(&mut bench, false);
    bench.shard.expire_leases(end, &bench.outlet);
    assert!(bench.list().is_empty());
}

#[test]
fn forks_take_seats_and_give_them_back() {
    let mut bench = Bench::new();
    let world = bench.create(1, None);
    let fork = |count| WorldWork::Fork { count, lease: None };
    let Reply::Error(error) = bench.work(world, fork(16)) else {
        panic!("forked beyond the seats")
    };
    assert_eq!(error.code, ErrorCode::Capacity);
    let Reply::Forked(forks) = bench.work(world, fork(15)) else { panic!("not forked") };
    for fork in forks {
        assert_eq!(bench.work(fork, WorldWork::Destroy), Reply::Done);
    }
    assert!(bench.seats.take(15).is_ok());
}
