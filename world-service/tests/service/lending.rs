//! Who comes by the shortcut lends a thread to the shard of the world to be ticked.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use bus::Channel;
use schemas::{Reply, Request, ServiceKind, Tick, TickItem, WorldId, keys};
use world::World;
use world_service::service::{Dispatcher, Ids, Job};

use crate::common::{Site, config, deadline, decoded, tenant, ticks};

const SHARDS: usize = 2;

/// A dispatcher to shards at which nobody works, and their inboxes.
fn dispatcher() -> (Dispatcher<World>, Vec<Receiver<Job<World>>>) {
    let (senders, inboxes) = (0..SHARDS).map(|_| sync_channel(4)).unzip();
    (Dispatcher::new(senders), inboxes)
}

fn world_of(shard: usize) -> WorldId {
    let mut ids = (1..).filter_map(WorldId::new);
    ids.find(|id| Ids::shard_of(*id, SHARDS) == shard).unwrap()
}

/// The shards that were offered work, when `takes` says whether the offer is taken.
fn offered(dispatcher: &Dispatcher<World>, worlds: &[WorldId], takes: bool) -> Option<usize> {
    let mut offered = None;
    let items = worlds.iter().map(|world| ticks(*world, 1)).collect();
    dispatcher.tick(None, items, Box::new(|_| ()), |shard, job| {
        offered = Some(shard);
        (!takes).then_some(job)
    });
    offered
}

#[test]
fn work_of_one_shard_is_offered_and_of_several_is_handed_out() {
    let (dispatcher, inboxes) = dispatcher();
    let [left, right] = [world_of(0), world_of(1)];
    let handed_out =
        || -> Vec<usize> { inboxes.iter().map(|inbox| inbox.try_iter().count()).collect() };
    assert_eq!(offered(&dispatcher, &[right, right], true), Some(1));
    assert_eq!(handed_out(), [0, 0]);
    assert_eq!(offered(&dispatcher, &[right], false), Some(1));
    assert_eq!(handed_out(), [0, 1], "an offer that is not taken is handed out");
    assert_eq!(offered(&dispatcher, &[left, right], true), None);
    assert_eq!(handed_out(), [1, 1]);
}

async fn channel(site: &Site) -> Channel {
    let host = config().id;
    site.client.channel(&keys::batch_tick(&host), (ServiceKind::World, &host)).await.unwrap()
}

async fn tick(channel: &Channel, item: TickItem) -> Tick {
    match channel.request(&Request::TickWorlds(vec![item]), deadline()).await {
        Ok(Reply::Ticked(mut results)) => decoded(&results.remove(0).outcome.unwrap().frame).tick,
        other => panic!("{other:?}"),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_waits_on_a_lent_thread_is_answered_when_the_missing_ones_lease_ends() {
    const LEASE: Duration = Duration::from_millis(300);
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    for participant in ["alive", "dead"] {
        let share = Request::ShareClock {
            world,
            participant: participant.parse().unwrap(),
            lease_millis: LEASE.as_millis() as u32,
            stands_for: None,
        };
        let key = keys::world(&tenant(), world);
        assert_eq!(site.client.request(&key, &share, deadline()).await, Ok(Reply::Done));
    }
    let channel = channel(&site).await;
    let asked = Instant::now();
    let item = TickItem { participant: Some("alive".parse().unwrap()), ..ticks(world, 1) };
    assert_eq!(tick(&channel, item).await, Tick(1));
    assert!(asked.elapsed() >= LEASE, "{:?}", asked.elapsed());
}

/// Two worlds of one shard and one of the other, each asked by a channel of its own.
#[tokio::test(flavor = "multi_thread")]
async fn askers_who_meet_at_a_shard_get_every_tick_once() {
    const TICKS: u64 = 300;
    let site = Arc::new(Site::open(config()).await);
    let mut worlds = Vec::new();
    for seed in 0..3 {
        worlds.push(site.create(seed, None).await.unwrap());
    }
    let shards: Vec<_> = worlds.iter().map(|world| Ids::shard_of(*world, SHARDS)).collect();
    assert!(shards.contains(&0) && shards.contains(&1), "{shards:?}");
    let asking = worlds.iter().map(|world| {
        let (site, world) = (Arc::clone(&site), *world);
        tokio::spawn(async move {
            let channel = channel(&site).await;
            for count in 1..=TICKS {
                assert_eq!(tick(&channel, ticks(world, 1)).await, Tick(count));
            }
        })
    });
    let asking: Vec<_> = asking.collect();
    for _ in 0..50 {
        assert_eq!(site.list().await.len(), worlds.len());
    }
    for asked in asking {
        asked.await.unwrap();
    }
}
