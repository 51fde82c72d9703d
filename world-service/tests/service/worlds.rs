//! Worlds over a real bus: made, ticked, copied, listed, ended.

use crate::common::{MAP, Site, config, create, deadline, decoded, tenant, ticks};
use schemas::{Error, ErrorCode, Reply, Request, Tick, TickItem, WorldId, keys};

#[tokio::test(flavor = "multi_thread")]
async fn a_world_is_made_ticked_listed_and_ended() {
    let site = Site::open(config()).await;
    let Ok(Reply::WorldCreated { world, frame, replies }) = site.ask(&create(7, None)).await else {
        panic!("not created")
    };
    let first = decoded(&frame);
    assert_eq!((first.world, first.tick, first.seed), (world, Tick(0), 7));
    assert_eq!(first.map.name, MAP);
    assert_eq!(replies, [Ok(Some(first.actors[0].id))]);

    let outcome = site.tick(ticks(world, 10)).await.unwrap();
    let tenth = decoded(&outcome.frame);
    assert_eq!(tenth.tick, Tick(10));
    let moved_m = tenth.actors[0].world_from_actor.translation.vector
        - first.actors[0].world_from_actor.translation.vector;
    assert!(moved_m.norm() > 2.0, "the car drove {moved_m:?} in half a second");

    let [listed] = <[_; 1]>::try_from(site.list().await).unwrap();
    assert_eq!((listed.world, listed.tick, listed.actor_count), (world, Tick(10), 1));

    assert_eq!(site.ask(&Request::DestroyWorld { world }).await, Ok(Reply::Done));
    assert!(site.list().await.is_empty());
    let gone = site.tick(ticks(world, 1)).await.unwrap_err();
    assert_eq!(gone.code, ErrorCode::UnknownWorld, "{gone}");
    site.service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn equal_worlds_give_equal_frames_however_their_ticks_are_interleaved() {
    let site = Site::open(config()).await;
    let (alone, mixed) = (site.create(7, None).await.unwrap(), site.create(7, None).await.unwrap());
    let hash_of_30_at_once = decoded(&site.tick(ticks(alone, 30)).await.unwrap().frame).state_hash;
    let other = site.create(8, None).await.unwrap();
    for _ in 0..10 {
        site.tick(ticks(mixed, 3)).await.unwrap();
        site.tick(ticks(other, 1)).await.unwrap();
    }
    let hash = decoded(&site.tick(ticks(mixed, 0)).await.unwrap().frame).state_hash;
    assert_eq!(hash, hash_of_30_at_once);
}

/// State hashes of twelve worlds that a service with so many threads ticks together.
async fn hashes_with_threads(threads: usize) -> Vec<u64> {
    let shard_count = threads.try_into().unwrap();
    let site = Site::open(world_service::Config { shard_count, ..config() }).await;
    let mut worlds = Vec::new();
    for seed in 0..12 {
        worlds.push(site.create(seed % 4, None).await.unwrap());
    }
    let key = keys::batch_tick(&config().id);
    for _ in 0..5 {
        let items = worlds.iter().map(|world| ticks(*world, 4)).collect();
        site.client.request(&key, &Request::TickWorlds(items), deadline()).await.unwrap();
    }
    let mut hashes = Vec::new();
    for world in worlds {
        hashes.push(decoded(&site.tick(ticks(world, 0)).await.unwrap().frame).state_hash);
    }
    hashes
}

#[tokio::test(flavor = "multi_thread")]
async fn one_and_eight_threads_give_the_same_worlds() {
    let one = hashes_with_threads(1).await;
    assert_eq!(one, hashes_with_threads(8).await);
    assert!(one[0] == one[4] && one[0] != one[1], "seeds decide, and nothing else: {one:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_ticks_many_worlds_and_reports_each() {
    let site = Site::open(config()).await;
    let mut items = Vec::new();
    for seed in 0..8 {
        items.push(ticks(site.create(seed, None).await.unwrap(), 2));
    }
    let unknown = WorldId::new(1).unwrap();
    items.insert(3, ticks(unknown, 1));
    let worlds: Vec<WorldId> = items.iter().map(|item| item.world).collect();
    let key = keys::batch_tick(&config().id);
    let reply = site.client.request(&key, &Request::TickWorlds(items), deadline()).await;
    let Ok(Reply::Ticked(results)) = reply else { panic!("{reply:?}") };
    assert_eq!(results.iter().map(|result| result.world).collect::<Vec<_>>(), worlds);
    for (index, result) in results.iter().enumerate() {
        match (&result.outcome, index) {
            (Err(error), 3) => assert_eq!(error.code, ErrorCode::UnknownWorld),
            (Ok(outcome), _) => assert_eq!(decoded(&outcome.frame).tick, Tick(2)),
            (Err(error), _) => panic!("{error}"),
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_repeated_tick_with_an_expected_tick_is_harmless() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let step = TickItem { expected_tick: Some(Tick(0)), ..ticks(world, 5) };
    let first = site.tick(step.clone()).await.unwrap();
    let again = site.tick(step).await.unwrap_err();
    assert_eq!(again.code, ErrorCode::WrongTick);
    assert_eq!((again.wanted.as_str(), again.found.as_str()), ("tick 0", "tick 5"));
    let present = site.tick(ticks(world, 0)).await.unwrap();
    assert_eq!(present.frame, first.frame);
}

#[tokio::test(flavor = "multi_thread")]
async fn restored_and_forked_worlds_continue_bit_for_bit() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    site.tick(ticks(world, 20)).await.unwrap();
    let snapshot = site.snapshot(world).await;
    let Ok(Reply::WorldCreated { world: restored, .. }) =
        site.ask(&Request::RestoreWorld { snapshot, lease: None }).await
    else {
        panic!("not restored")
    };
    let Ok(Reply::Forked(forks)) =
        site.ask(&Request::ForkWorld { world, count: 3, lease: None }).await
    else {
        panic!("not forked")
    };
    assert_eq!(forks.len(), 3);
    let original = decoded(&site.tick(ticks(world, 20)).await.unwrap().frame);
    for copy in forks.into_iter().chain([restored]) {
        let frame = decoded(&site.tick(ticks(copy, 20)).await.unwrap().frame);
        assert_eq!((frame.tick, frame.state_hash), (original.tick, original.state_hash));
        assert_eq!(frame.world, copy);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_snapshot_is_refused_and_makes_no_world() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let mut snapshot = site.snapshot(world).await;
    let middle = snapshot.len() / 2;
    snapshot[middle] ^= 1;
    for snapshot in [snapshot, Vec::new(), vec![0; 1_000_000]] {
        let refused = site.ask(&Request::RestoreWorld { snapshot, lease: None }).await;
        assert!(refused.is_err(), "{refused:?}");
    }
    assert_eq!(site.list().await.len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_world_too_many_is_refused_and_frees_up_when_another_ends() {
    let site = Site::open(world_service::Config { worlds_max: 2, ..config() }).await;
    let first = site.create(1, None).await.unwrap();
    site.create(2, None).await.unwrap();
    let error = site.create(3, None).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::Capacity, "{error}");
    let forked = site.ask(&Request::ForkWorld { world: first, count: 1, lease: None }).await;
    assert_eq!(forked.unwrap_err().code, ErrorCode::Capacity);
    site.ask(&Request::DestroyWorld { world: first }).await.unwrap();
    site.create(3, None).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_command_makes_no_world_and_gives_its_seat_back() {
    let site = Site::open(world_service::Config { worlds_max: 1, ..config() }).await;
    let Request::CreateWorld { map, mut commands, .. } = create(1, None) else { unreachable!() };
    // The second car would stand in the first.
    commands.push(commands[0].clone());
    let request = Request::CreateWorld {
        map,
        seed: 1,
        dt_secs: 0.05,
        commands,
        lease: None,
        traffic: false,
        first_actor: schemas::ActorId::FIRST,
    };
    let error = site.ask(&request).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::SpawnBlocked, "{error}");
    assert!(error.message.contains("command 2 of 2"), "{error}");
    assert!(site.list().await.is_empty());
    site.create(1, None).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn values_outside_their_domain_are_refused_with_the_domain() {
    let site = Site::open(config()).await;
    let with = |map: &str, dt_secs| Request::CreateWorld {
        map: map.to_owned(),
        seed: 1,
        dt_secs,
        commands: Vec::new(),
        lease: None,
        traffic: false,
        first_actor: schemas::ActorId::FIRST,
    };
    let unknown_map = site.ask(&with("Town99", 0.05)).await.unwrap_err();
    assert_eq!(unknown_map.code, ErrorCode::UnknownMap);
    assert!(unknown_map.wanted.contains(MAP), "{unknown_map}");
    assert_eq!(site.ask(&with(MAP, 5.0)).await.unwrap_err().code, ErrorCode::InvalidArgument);
}

#[tokio::test(flavor = "multi_thread")]
async fn worlds_of_another_tenant_do_not_exist() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let other = "other".parse().unwrap();
    let ask = async |key: &str, request: Request| -> Result<Reply, Error> {
        site.client.request(key, &request, deadline()).await
    };
    let tick = Request::TickWorlds(vec![ticks(world, 1)]);
    let reply = ask(&keys::world(&other, world), tick).await;
    let Ok(Reply::Ticked(results)) = reply else { panic!("{reply:?}") };
    assert_eq!(results[0].outcome.as_ref().unwrap_err().code, ErrorCode::UnknownWorld);
    let error = ask(&keys::worlds(&other), Request::DestroyWorld { world }).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::UnknownWorld);
    assert_eq!(
        ask(&keys::worlds(&other), Request::ListWorlds).await,
        Ok(Reply::Worlds(Vec::new()))
    );
    assert_eq!(site.list().await.len(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_on_the_wrong_key_are_refused() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let other = WorldId::of_host(world.host(), 5);
    let tick = Request::TickWorlds(vec![ticks(world, 1)]);
    let wrong_world = keys::world(&tenant(), other);
    let error = site.client.request(&wrong_world, &tick, deadline()).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::InvalidArgument, "{error}");
    let batch = keys::batch_tick(&config().id);
    let error = site.client.request(&batch, &Request::ListWorlds, deadline()).await.unwrap_err();
    assert_eq!(error.code, ErrorCode::InvalidArgument, "{error}");
    let error = site.client.request("causeway/*/worlds", &Request::ListWorlds, deadline()).await;
    assert!(error.is_err(), "a wildcard tenant was answered: {error:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_map_travels_by_its_digest() {
    let site = Site::open(config()).await;
    let Ok(Reply::Maps(maps)) = site.ask(&Request::ListMaps).await else { panic!("no maps") };
    let map = maps.iter().find(|map| map.name == MAP).unwrap();
    let text = site.client.asset(&map.digest, deadline()).await.unwrap();
    assert_eq!(text, roads::town::build(MAP).unwrap().into_bytes());
    let unknown = site.client.asset(&"0".repeat(64), deadline()).await;
    assert_eq!(unknown.unwrap_err().code, ErrorCode::UnknownAsset);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_subscriber_gets_the_frame_of_every_tick() {
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let frames = site.client.subscribe_frames(&tenant(), Some(world)).await.unwrap();
    let next = async |within| tokio::time::timeout(within, frames.next()).await.ok().flatten();
    crate::common::until("the subscription is known", || async {
        site.tick(ticks(world, 1)).await.unwrap();
        next(std::time::Duration::from_millis(50)).await.is_some()
    })
    .await;
    let answered = site.tick(ticks(world, 3)).await.unwrap();
    // Frames of the ticks before may come late.
    let mut seen = Vec::new();
    loop {
        let published = next(deadline()).await.expect("a frame of every tick");
        seen.push(decoded(&published.frame).tick.0);
        if published.frame == answered.frame {
            break;
        }
    }
    let last = decoded(&answered.frame).tick.0;
    assert!(seen.ends_with(&[last - 2, last - 1, last]), "{seen:?}");
}
