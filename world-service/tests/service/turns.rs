//! Requests of many ticks let other worlds of their shard in between.

use std::sync::mpsc::Receiver;
use std::time::Duration;

use schemas::{ErrorCode, Reply, Tick, TickItem, TickOutcome, WorldId};
use world_service::service::{Gather, Job, WorldWork};

use crate::common::{decoded, tenant, ticks};
use crate::shard::{Bench, answer};

fn outcome(replies: &Receiver<Reply>) -> Option<Result<TickOutcome, schemas::Error>> {
    match replies.try_recv().ok()? {
        Reply::Ticked(mut results) => Some(results.remove(0).outcome),
        other => panic!("{other:?}"),
    }
}

fn tick_of(replies: &Receiver<Reply>) -> Option<Tick> {
    outcome(replies).map(|outcome| decoded(&outcome.unwrap().frame).tick)
}

fn go_on(bench: &mut Bench, turns: usize) {
    for _ in 0..turns {
        bench.shard.go_on(bench.now, &bench.outlet);
    }
}

#[test]
fn other_worlds_are_served_between_the_ticks_of_a_long_request() {
    let mut bench = Bench::new();
    let (noisy, quiet) = (bench.create(1, None), bench.create(2, None));
    let long = bench.begin_ticks(ticks(noisy, 200));
    for count in 1..=199 {
        go_on(&mut bench, 1);
        let step = bench.begin_ticks(ticks(quiet, 1));
        assert_eq!(tick_of(&step), Some(Tick(count)), "answered at once");
        assert!(long.try_recv().is_err(), "after {count} ticks");
    }
    go_on(&mut bench, 1);
    assert_eq!(tick_of(&long), Some(Tick(200)));
    assert!(!bench.shard.is_running());
}

#[test]
fn two_long_requests_take_turns() {
    let mut bench = Bench::new();
    let (longer, shorter) = (bench.create(1, None), bench.create(2, None));
    let (long, short) =
        (bench.begin_ticks(ticks(longer, 50)), bench.begin_ticks(ticks(shorter, 5)));
    go_on(&mut bench, 10);
    assert_eq!(tick_of(&short), Some(Tick(5)));
    assert!(long.try_recv().is_err());
}

#[test]
fn what_comes_for_a_world_under_way_is_done_after_it_and_in_order() {
    let mut bench = Bench::new();
    let world = bench.create(1, None);
    let first = bench.begin_ticks(ticks(world, 3));
    let second = bench.begin_ticks(TickItem { expected_tick: Some(Tick(3)), ..ticks(world, 2) });
    let third = bench.begin_ticks(ticks(world, 1));
    let (sender, last) = std::sync::mpsc::sync_channel(1);
    let destroy =
        Job::World { tenant: tenant(), world, work: WorldWork::Destroy, answer: answer(sender) };
    bench.shard.handle(bench.now, destroy, &bench.outlet);
    assert!(first.try_recv().is_err() && last.try_recv().is_err());
    go_on(&mut bench, 3);
    assert_eq!(tick_of(&first), Some(Tick(3)));
    assert!(third.try_recv().is_err());
    go_on(&mut bench, 2);
    assert_eq!((tick_of(&second), tick_of(&third)), (Some(Tick(5)), Some(Tick(6))));
    assert_eq!(last.try_recv(), Ok(Reply::Done));
}

#[test]
fn a_world_that_ends_under_way_tells_all_who_wait() {
    let mut bench = Bench::new();
    let owner = "s".parse().unwrap();
    let world = bench.create(1, Some(schemas::Lease { owner, millis: 0 }));
    let (first, second) = (bench.begin_ticks(ticks(world, 9)), bench.begin_ticks(ticks(world, 1)));
    go_on(&mut bench, 2);
    bench.shard.expire_leases(bench.now, &bench.outlet);
    for waiting in [&first, &second] {
        let error = outcome(waiting).expect("it is told").unwrap_err();
        assert_eq!(error.code, ErrorCode::UnknownWorld);
    }
    go_on(&mut bench, 1);
    assert!(!bench.shard.is_running());
}

#[test]
fn ticks_one_by_one_give_the_frames_of_single_requests() {
    let alone = {
        let mut bench = Bench::new();
        let world = bench.create(7, None);
        (0..20).for_each(|_| drop(bench.tick(ticks(world, 1)).unwrap()));
        bench.tick(ticks(world, 0)).unwrap().frame
    };
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    assert_eq!(decoded(&bench.tick(ticks(world, 20)).unwrap().frame), {
        let mut frame = decoded(&alone);
        frame.world = world;
        frame
    });
}

/// Two worlds, one of which has had two ticks, which were slow.
fn slow_and_quiet() -> (Bench, WorldId, WorldId) {
    let mut bench = Bench::with_slow(Duration::ZERO);
    let (slow, quiet) = (bench.create(1, None), bench.create(2, None));
    for _ in 0..2 {
        assert!(tick_of(&bench.begin_ticks(ticks(slow, 1))).is_some(), "not known to be slow");
    }
    (bench, slow, quiet)
}

fn list(bench: &mut Bench) -> Vec<(WorldId, Tick)> {
    let listed = bench.begin(|answer| Job::List {
        tenant: tenant(),
        index: 0,
        gather: Gather::new(1, answer, |mut parts: Vec<Vec<_>>| Reply::Worlds(parts.remove(0))),
    });
    let Ok(Reply::Worlds(mut infos)) = listed.try_recv() else { panic!("no list") };
    infos.sort_by_key(|info| info.world);
    infos.into_iter().map(|info| (info.world, info.tick)).collect()
}

#[test]
fn a_slow_tick_is_done_elsewhere_while_others_are_served() {
    let (mut bench, slow, quiet) = slow_and_quiet();
    let third = bench.begin_ticks(ticks(slow, 1));
    assert!(bench.shard.is_slow_next() && third.try_recv().is_err());
    let mut turn = bench.shard.take_turn().unwrap();
    assert!(bench.shard.take_turn().is_none(), "one at a time");
    assert_eq!(tick_of(&bench.begin_ticks(ticks(quiet, 1))), Some(Tick(1)), "answered at once");
    assert_eq!(list(&mut bench), [(slow, Tick(2)), (quiet, Tick(1))]);

    let fourth = bench.begin_ticks(TickItem { expected_tick: Some(Tick(3)), ..ticks(slow, 1) });
    let ended = bench.begin(|answer| Job::World {
        tenant: tenant(),
        world: slow,
        work: WorldWork::Destroy,
        answer,
    });
    turn.go_on(&bench.outlet);
    assert_eq!(tick_of(&third), Some(Tick(3)));
    assert!(fourth.try_recv().is_err() && ended.try_recv().is_err());
    bench.shard.give_back(bench.now, turn, &bench.outlet);
    assert!(ended.try_recv().is_err(), "before the fourth tick");
    go_on(&mut bench, 1);
    assert_eq!(tick_of(&fourth), Some(Tick(4)));
    assert_eq!(ended.try_recv(), Ok(Reply::Done));
    assert_eq!(list(&mut bench), [(quiet, Tick(1))]);
}

#[test]
fn strangers_find_no_world_that_has_its_turn_elsewhere() {
    let (mut bench, slow, _) = slow_and_quiet();
    let _third = bench.begin_ticks(ticks(slow, 1));
    let _turn = bench.shard.take_turn().unwrap();
    let foreign = bench.begin(|answer| Job::World {
        tenant: "stranger".parse().unwrap(),
        world: slow,
        work: WorldWork::Destroy,
        answer,
    });
    let Ok(Reply::Error(error)) = foreign.try_recv() else { panic!("no refusal") };
    assert_eq!(error.code, ErrorCode::UnknownWorld);
}

#[test]
fn a_lease_that_ends_during_a_slow_tick_ends_the_world_after_it() {
    let mut bench = Bench::with_slow(Duration::ZERO);
    let owner = "s".parse().unwrap();
    let world = bench.create(1, Some(schemas::Lease { owner, millis: 1_000 }));
    let request = bench.begin_ticks(ticks(world, 5));
    let mut turn = bench.shard.take_turn().unwrap();
    let end = bench.now + Duration::from_secs(1);
    bench.shard.expire_leases(end, &bench.outlet);
    turn.go_on(&bench.outlet);
    bench.shard.give_back(end, turn, &bench.outlet);
    bench.shard.expire_leases(end, &bench.outlet);
    assert!(list(&mut bench).is_empty());
    assert_eq!(outcome(&request).unwrap().unwrap_err().code, ErrorCode::UnknownWorld);
}
