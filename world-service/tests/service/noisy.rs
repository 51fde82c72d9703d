//! A world with much to do beside worlds with little.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bus::Channel;
use roads::LaneTypes;
use schemas::{
    Command, Reply, Request, ServiceKind, TickItem, TrafficCommand, Vec3, WalkerCommand, WorldId,
    keys, level_pose,
};

use crate::common::{Site, config, deadline, tenant, ticks};

const NOISY_MAP: &str = "Town05";
const CROWD: usize = 200;
const TICKS: u32 = 200;
const QUIET_WORLDS: u64 = 8;

async fn run_commands(
    site: &Site,
    world: WorldId,
    commands: Vec<Command>,
) -> Vec<schemas::CommandReply> {
    let key = keys::world(&tenant(), world);
    match site.client.request(&key, &Request::RunCommands { world, commands }, deadline()).await {
        Ok(Reply::CommandReplies(replies)) => replies,
        other => panic!("{other:?}"),
    }
}

/// A world with 200 vehicles of traffic and 200 people on their way.
async fn noisy_world(site: &Site) -> WorldId {
    let create = Request::CreateWorld {
        map: NOISY_MAP.to_owned(),
        seed: 1,
        dt_secs: 0.05,
        commands: vec![Command::Traffic(TrafficCommand::Spawn {
            count: CROWD as u32,
            behaviour: None,
        })],
        lease: None,
        traffic: true,
        first_actor: schemas::ActorId::FIRST,
    };
    let Ok(Reply::WorldCreated { world, .. }) = site.ask(&create).await else { panic!("refused") };
    let text = roads::town::build(NOISY_MAP).unwrap();
    let map = roads::Map::parse(NOISY_MAP, &text).unwrap();
    let beside = map.spread_places().iter().filter_map(|place| {
        let walk = map.nearest(place.translation.vector.into(), LaneTypes::SIDEWALK)?;
        let foot_m: Vec3 = map.pose(&walk).translation.vector.cast();
        Some(level_pose(foot_m + Vec3::z() * 0.95, 0.0))
    });
    let spawns = beside.map(|pose| Command::spawn("walker.pedestrian.0001", pose, Vec3::zeros()));
    let spawned = run_commands(site, world, spawns.collect()).await;
    let walkers: Vec<_> = spawned.into_iter().flatten().flatten().take(CROWD).collect();
    assert_eq!(walkers.len(), CROWD);
    let walk = |actor| {
        let speed_mps = Some(1.4);
        Command::Walker(WalkerCommand::Agent {
            actor,
            goal_m: None,
            speed_mps,
            crossing_share: 0.0,
        })
    };
    let begun = run_commands(site, world, walkers.into_iter().map(walk).collect()).await;
    assert!(begun.iter().all(Result::is_ok), "{begun:?}");
    world
}

async fn lane(site: &Site) -> Channel {
    let host = config().id;
    site.client.channel(&keys::batch_tick(&host), (ServiceKind::World, &host)).await.unwrap()
}

async fn step(lane: &Channel, item: TickItem) -> Duration {
    let asked = Instant::now();
    match lane.request(&Request::TickWorlds(vec![item]), deadline()).await {
        Ok(Reply::Ticked(mut results)) => drop(results.remove(0).outcome.unwrap()),
        other => panic!("{other:?}"),
    }
    asked.elapsed()
}

/// Says that it is busy, until it is dropped: in a panic too, or nobody would ever end.
struct UntilDropped(Arc<AtomicBool>);

impl Drop for UntilDropped {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// How long each step of the quiet worlds took while `busy` says so.
async fn steps_while(
    site: &Arc<Site>,
    worlds: &[WorldId],
    busy: &Arc<AtomicBool>,
) -> Vec<Vec<Duration>> {
    let asking = worlds.iter().map(|world| {
        let (site, world, busy) = (Arc::clone(site), *world, Arc::clone(busy));
        tokio::spawn(async move {
            let lane = lane(&site).await;
            let mut steps = Vec::new();
            while busy.load(Ordering::Relaxed) {
                steps.push(step(&lane, ticks(world, 1)).await);
            }
            steps
        })
    });
    let mut steps = Vec::new();
    for asked in asking.collect::<Vec<_>>() {
        steps.push(asked.await.unwrap());
    }
    steps
}

fn p99(steps: &[Vec<Duration>]) -> Duration {
    let mut all = steps.concat();
    all.sort();
    all[all.len() * 99 / 100]
}

#[tokio::test(flavor = "multi_thread")]
async fn eight_worlds_go_on_while_200_vehicles_and_200_people_do_200_ticks() {
    let site = Arc::new(Site::open(config()).await);
    let noisy = noisy_world(&site).await;
    let mut quiet = Vec::new();
    for seed in 0..QUIET_WORLDS {
        quiet.push(site.create(seed, None).await.unwrap());
    }
    let noisy_lane = lane(&site).await;
    let alone_secs = step(&noisy_lane, ticks(noisy, TICKS)).await;

    let busy = Arc::new(AtomicBool::new(true));
    let stop = {
        let busy = Arc::clone(&busy);
        tokio::spawn(async move {
            tokio::time::sleep(alone_secs).await;
            busy.store(false, Ordering::Relaxed);
        })
    };
    let before = steps_while(&site, &quiet, &busy).await;
    stop.await.unwrap();

    busy.store(true, Ordering::Relaxed);
    let long = {
        let busy = UntilDropped(Arc::clone(&busy));
        tokio::spawn(async move {
            let took = step(&noisy_lane, ticks(noisy, TICKS)).await;
            drop(busy);
            took
        })
    };
    let beside = steps_while(&site, &quiet, &busy).await;
    let long = long.await.unwrap();
    let least = beside.iter().map(Vec::len).min().unwrap();
    println!(
        "200 ticks alone {alone_secs:?}, beside eight {long:?}; p99 of a quiet step {:?} before, {:?} \
         beside; fewest steps beside {least}",
        p99(&before),
        p99(&beside)
    );
    // Before, whoever shared a thread with the long request did one step in all that time.
    assert!(least >= 50, "{least} steps in {long:?}");
}
