//! Several clients tick one world: it goes on once, when all have asked.

use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use schemas::{
    ErrorCode, Lease, Reply, Request, ServiceId, Tick, TickItem, TickOutcome, WorldId, keys,
};
use world_service::service::{Gather, Job, WorldWork};

use crate::common::{Site, car, config, connect, deadline, decoded, tenant, ticks};
use crate::shard::{Bench, answer};

const LEASE: Duration = Duration::from_millis(300);

fn name(text: &str) -> ServiceId {
    text.parse().unwrap()
}

fn step(world: WorldId, participant: &str) -> TickItem {
    TickItem { participant: Some(name(participant)), ..ticks(world, 1) }
}

fn share(bench: &mut Bench, world: WorldId, participant: &str, lease: Option<Duration>) -> Reply {
    share_as(bench, (world, None), participant, lease)
}

/// The same, in a world that stands for another one.
fn share_as(
    bench: &mut Bench,
    (world, stands_for): (WorldId, Option<WorldId>),
    participant: &str,
    lease: Option<Duration>,
) -> Reply {
    bench.work(world, WorldWork::Share { participant: name(participant), lease, stands_for })
}

/// Asks for a tick that may have to wait.
fn ask(bench: &mut Bench, item: TickItem) -> Receiver<Reply> {
    let (sender, replies) = sync_channel(1);
    let gather = Gather::new(1, answer(sender), Reply::Ticked);
    let job = Job::Tick { tenant: Some(tenant()), items: vec![(0, item)], gather };
    bench.shard.handle(bench.now, job, &bench.outlet);
    replies
}

fn outcome(replies: &Receiver<Reply>) -> Result<TickOutcome, schemas::Error> {
    match replies.try_recv().expect("it is answered") {
        Reply::Ticked(mut results) => results.remove(0).outcome,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_shared_world_goes_on_once_when_all_have_asked() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    for participant in ["left", "right"] {
        assert_eq!(share(&mut bench, world, participant, Some(LEASE)), Reply::Done);
    }
    let first = ask(&mut bench, TickItem { commands: vec![car()], ..step(world, "right") });
    assert!(first.try_recv().is_err(), "left is missing");
    let second = ask(&mut bench, step(world, "left"));
    let (first, second) = (outcome(&first).unwrap(), outcome(&second).unwrap());
    assert_eq!(first.frame, second.frame);
    assert_eq!(decoded(&first.frame).tick, Tick(1));
    assert_eq!((first.replies.len(), second.replies.len()), (1, 0), "each has its own replies");
}

#[test]
fn who_has_no_part_in_a_shared_clock_cannot_tick() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    assert_eq!(bench.tick(step(world, "left")).unwrap_err().code, ErrorCode::InvalidArgument);
    share(&mut bench, world, "left", Some(LEASE));
    for item in [ticks(world, 1), step(world, "stranger")] {
        assert_eq!(bench.tick(item).unwrap_err().code, ErrorCode::InvalidArgument);
    }
    let two = TickItem { tick_count: 2, ..step(world, "left") };
    assert_eq!(bench.tick(two).unwrap_err().code, ErrorCode::InvalidArgument);
    assert_eq!(decoded(&bench.tick(step(world, "left")).unwrap().frame).tick, Tick(1));
    share(&mut bench, world, "left", None);
    assert_eq!(decoded(&bench.tick(ticks(world, 1)).unwrap().frame).tick, Tick(2));
}

#[test]
fn commands_without_a_tick_wait_for_nobody() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    for participant in ["left", "right"] {
        share(&mut bench, world, participant, Some(LEASE));
    }
    let waiting = ask(&mut bench, step(world, "right"));
    for item in [ticks(world, 0), TickItem { tick_count: 0, ..step(world, "stranger") }] {
        let told = bench.tick(TickItem { commands: vec![car()], ..item }).unwrap();
        assert_eq!((decoded(&told.frame).tick, told.replies.len()), (Tick(0), 1));
    }
    assert!(waiting.try_recv().is_err(), "left is missing");
    let told = bench.tick(step(world, "left")).unwrap();
    assert_eq!(decoded(&told.frame).tick, Tick(1));
    assert!(outcome(&waiting).is_ok());
}

#[test]
fn a_world_is_shared_with_its_owner_or_not_at_all() {
    let mut bench = Bench::new();
    let lease = Lease { owner: name("face"), millis: 60_000 };
    let world = bench.create(7, Some(lease));
    let refused = share(&mut bench, world, "guest", Some(LEASE));
    let Reply::Error(error) = refused else { panic!("{refused:?}") };
    assert_eq!(error.code, ErrorCode::InvalidArgument);
    assert!(bench.tick(ticks(world, 1)).is_ok(), "the owner's clock is as it was");
    for participant in ["face", "guest"] {
        assert_eq!(share(&mut bench, world, participant, Some(LEASE)), Reply::Done);
    }
}

#[test]
fn the_owner_hears_of_its_guests_and_they_do_not_hear_of_each_other() {
    let mut bench = Bench::new();
    let world = bench.create(7, Some(Lease { owner: name("face"), millis: 60_000 }));
    share(&mut bench, world, "face", Some(LEASE));
    assert!(bench.tick(step(world, "face")).unwrap().guests.is_empty());
    for guest in ["one", "other"] {
        share(&mut bench, world, guest, Some(LEASE));
    }
    let waiting = ["other", "one"].map(|guest| ask(&mut bench, step(world, guest)));
    let told = bench.tick(step(world, "face")).unwrap();
    assert_eq!(told.guests, [name("one"), name("other")]);
    for guest in waiting {
        assert!(outcome(&guest).unwrap().guests.is_empty());
    }
}

#[test]
fn the_owner_hears_once_that_others_had_something_done() {
    let mut bench = Bench::new();
    let world = bench.create(7, Some(Lease { owner: name("face"), millis: 60_000 }));
    share(&mut bench, world, "face", Some(LEASE));
    let hears = |bench: &mut Bench| bench.tick(step(world, "face")).unwrap().is_changed_by_others;
    let own = TickItem { commands: vec![car()], ..step(world, "face") };
    for item in [TickItem { tick_count: 0, ..own.clone() }, own] {
        assert!(!bench.tick(item).unwrap().is_changed_by_others, "its own commands");
    }
    // Who has no part in the clock any more, and who says no name.
    for participant in [Some(name("gone")), None] {
        let told = bench.tick(TickItem { participant, commands: vec![car()], ..ticks(world, 0) });
        assert!(!told.unwrap().is_changed_by_others, "others are told nothing");
        assert!(hears(&mut bench));
        assert!(!hears(&mut bench));
    }
    bench.work(world, WorldWork::Commands(vec![car()]));
    let without_time = TickItem { tick_count: 0, ..step(world, "face") };
    assert!(bench.tick(without_time).unwrap().is_changed_by_others);
    share(&mut bench, world, "guest", Some(LEASE));
    for (commands, is_told) in [(vec![], false), (vec![car()], true)] {
        let guest = ask(&mut bench, TickItem { commands, ..step(world, "guest") });
        assert_eq!(hears(&mut bench), is_told);
        assert!(!outcome(&guest).unwrap().is_changed_by_others);
    }
}

#[test]
fn a_world_tells_which_one_it_stands_for() {
    let mut bench = Bench::new();
    let (world, before) = (bench.create(7, None), WorldId::of_host(9, 4));
    let told =
        |bench: &mut Bench| bench.list().iter().map(|info| info.stands_for).collect::<Vec<_>>();
    assert_eq!(told(&mut bench), [None]);
    share_as(&mut bench, (world, Some(before)), "face", Some(LEASE));
    share(&mut bench, world, "guest", Some(LEASE));
    assert_eq!(told(&mut bench), [Some(before)], "guests do not change it");
}

#[test]
fn who_has_waited_for_long_is_told_so_and_takes_part_still() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    share(&mut bench, world, "slow", Some(Duration::from_hours(1)));
    share(&mut bench, world, "guest", Some(LEASE));
    let waiting = ask(&mut bench, step(world, "guest"));
    let end = bench.shard.next_end().unwrap();
    bench.shard.expire_leases(end, &bench.outlet);
    assert_eq!(outcome(&waiting).unwrap_err().code, ErrorCode::TimedOut);
    let waiting = ask(&mut bench, step(world, "guest"));
    bench.tick(step(world, "slow")).unwrap();
    assert_eq!(decoded(&outcome(&waiting).unwrap().frame).tick, Tick(1));
}

#[test]
fn a_dead_participant_stops_the_world_for_its_lease_and_no_longer() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    share(&mut bench, world, "alive", Some(LEASE));
    share(&mut bench, world, "dead", Some(LEASE));
    let waiting = ask(&mut bench, step(world, "alive"));
    let end = bench.now + LEASE;
    assert_eq!(bench.shard.next_end(), Some(end));
    bench.shard.expire_leases(end - Duration::from_millis(1), &bench.outlet);
    assert!(waiting.try_recv().is_err(), "the lease is not over");
    bench.shard.expire_leases(end, &bench.outlet);
    assert_eq!(decoded(&outcome(&waiting).unwrap().frame).tick, Tick(1));
    assert_eq!(bench.shard.next_end(), None);
    // It goes on at full speed without it, and the dead one must ask to be taken in again.
    assert!(bench.tick(step(world, "alive")).is_ok());
    assert_eq!(bench.tick(step(world, "dead")).unwrap_err().code, ErrorCode::InvalidArgument);
}

#[test]
fn who_leaves_is_waited_for_no_more_and_an_ended_world_tells_who_waits() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    share(&mut bench, world, "left", Some(LEASE));
    share(&mut bench, world, "right", Some(LEASE));
    let waiting = ask(&mut bench, step(world, "left"));
    assert_eq!(share(&mut bench, world, "right", None), Reply::Done);
    assert!(outcome(&waiting).is_ok());
    share(&mut bench, world, "right", Some(LEASE));
    let waiting = ask(&mut bench, step(world, "left"));
    assert_eq!(bench.work(world, WorldWork::Destroy), Reply::Done);
    assert_eq!(outcome(&waiting).unwrap_err().code, ErrorCode::UnknownWorld);
}

#[tokio::test(flavor = "multi_thread")]
async fn over_the_bus_a_killed_client_holds_the_others_up_for_its_lease() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let key = keys::world(&tenant(), world);
    for participant in ["alive", "dead"] {
        let share = Request::ShareClock {
            world,
            participant: name(participant),
            lease_millis: 2_000,
            stands_for: None,
        };
        assert_eq!(site.client.request(&key, &share, deadline()).await, Ok(Reply::Done));
    }
    let dying = connect(&site.service).await;
    let request = |participant| Request::TickWorlds(vec![step(world, participant)]);
    let (both, from_dying) = (request("alive"), request("dead"));
    let (one, other) = tokio::join!(
        site.client.request(&key, &both, deadline()),
        dying.request(&key, &from_dying, deadline())
    );
    assert!(one.is_ok() && other.is_ok());
    dying.close().await;
    let asked = std::time::Instant::now();
    let outcome = site.tick(step(world, "alive")).await.unwrap();
    assert_eq!(decoded(&outcome.frame).tick, Tick(2));
    assert!(asked.elapsed() >= Duration::from_secs(2), "{:?}", asked.elapsed());
    let asked = std::time::Instant::now();
    site.tick(step(world, "alive")).await.unwrap();
    assert!(asked.elapsed() < Duration::from_secs(2), "{:?}", asked.elapsed());
}
