//! What does the bus cost a tick? One world, and 64 worlds in one round trip.
//!
//! Unit of work: one tick of a world with a car and three pedestrians. Client and service are two
//! sessions of this process over loopback TCP. Printed are medians over rounds in which every way is
//! measured in turn, and the two ratios that are promised.

use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use bus::{Bus, BusConfig, Endpoint};
use schemas::{Command, Reply, Request, Tenant, TickItem, Vec3, WorldId, keys, level_pose};
use world::{Town, World, WorldConfig};
use world_service::Config;

const MAP: &str = "Town10HD_Opt";
const ROUNDS: usize = 5;
const TRIPS: usize = 1_000;
const BATCH_WORLDS: usize = 64;
const BATCH_TICKS: u32 = 20;

#[tokio::main]
async fn main() {
    let service = world_service::start(Config {
        listen: vec![Endpoint::loopback(0)],
        connect: Vec::new(),
        id: "world".parse().unwrap(),
        shard_count: std::thread::available_parallelism().unwrap(),
        maps: None,
        worlds_max: 256,
    })
    .await
    .unwrap();
    let client = Bus::open(BusConfig::connecting(service.listening()[0].clone())).await.unwrap();
    let echo = Bus::open(BusConfig::connecting(service.listening()[0].clone())).await.unwrap();
    let site = Site::new(client, &echo).await;

    let (mut own, mut bare, mut over_bus) = (Vec::new(), Vec::new(), Vec::new());
    let (mut own_batch, mut batch, mut batch_of_one) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        own.push(site.own_ticks());
        bare.push(site.bare_queries().await);
        over_bus.push(site.bus_ticks().await);
        own_batch.push(site.own_batches());
        batch.push(site.bus_batches(BATCH_TICKS).await / BATCH_TICKS);
        batch_of_one.push(site.bus_batches(1).await);
    }
    let [own, bare, over_bus, own_batch, batch, batch_of_one] =
        [own, bare, over_bus, own_batch, batch, batch_of_one].map(middle);
    println!("one tick inside the process     {:8.1} µs", micros(own));
    println!("a bare query round trip         {:8.1} µs", micros(bare));
    println!("one tick over the bus           {:8.1} µs", micros(over_bus));
    println!("  = {:.2} × (query + tick)", over_bus.as_secs_f64() / (bare + own).as_secs_f64());
    println!(
        "64 worlds, one tick each, inside the process on all cores {:8.1} µs",
        micros(own_batch)
    );
    for (what, time) in [("1 tick", batch_of_one), ("20 ticks", batch)] {
        println!(
            "64 worlds, {what} each, one round trip: {:8.1} µs a tick = {:.0} % of the in-process rate",
            micros(time),
            100.0 * own_batch.as_secs_f64() / time.as_secs_f64()
        );
    }
    service.stop().await;
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

fn middle(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

struct Site {
    client: Bus,
    tenant: Tenant,
    worlds: Vec<WorldId>,
    town: Arc<Town>,
    _echo: bus::Serving,
}

impl Site {
    async fn new(client: Bus, echo: &Bus) -> Self {
        let tenant: Tenant = "local".parse().unwrap();
        let text = roads::town::build(MAP).unwrap();
        let town = Arc::new(Town::new(Arc::new(roads::Map::parse(MAP, &text).unwrap())));
        let mut worlds = Vec::new();
        for seed in 0..BATCH_WORLDS as u64 {
            let create = Request::CreateWorld {
                map: MAP.to_owned(),
                seed,
                dt_secs: 0.05,
                commands: cast(),
                lease: None,
            };
            let reply =
                client.request(&keys::worlds(&tenant), &create, Duration::from_secs(20)).await;
            let Ok(Reply::WorldCreated { world, .. }) = reply else { panic!("{reply:?}") };
            worlds.push(world);
        }
        // Answers from the bus's thread, with as many bytes as a tick.
        let answer = schemas::wire::encode_reply(&Reply::Snapshot(vec![1; 1_500]));
        let serving =
            echo.serve("bench/echo", move |incoming| incoming.reply_bytes(answer.clone())).await;
        Self { client, tenant, worlds, town, _echo: serving.unwrap() }
    }

    fn own_world(&self, seed: u64) -> World {
        let id = WorldId::new(1).unwrap();
        let map = Arc::clone(&self.town);
        let mut world = World::new(WorldConfig { id, epoch: 1, seed, dt_secs: 0.05, map }).unwrap();
        for command in cast() {
            world.apply(&command).unwrap();
        }
        world
    }

    fn own_ticks(&self) -> Duration {
        let mut world = self.own_world(0);
        let mut times = Vec::with_capacity(TRIPS);
        for _ in 0..TRIPS {
            let begun = Instant::now();
            world.tick().unwrap();
            std::hint::black_box(schemas::wire::encode_frame(&world.frame()));
            times.push(begun.elapsed());
        }
        middle(times)
    }

    /// Time of one tick of 64 worlds spread over all cores.
    fn own_batches(&self) -> Duration {
        let threads = std::thread::available_parallelism().unwrap().get();
        let (sender, times) = mpsc::sync_channel(threads);
        std::thread::scope(|scope| {
            for index in 0..threads {
                let sender = sender.clone();
                scope.spawn(move || {
                    let own = (index..BATCH_WORLDS).step_by(threads);
                    let mut worlds: Vec<World> =
                        own.map(|seed| self.own_world(seed as u64)).collect();
                    let begun = Instant::now();
                    for _ in 0..200 {
                        for world in &mut worlds {
                            world.tick().unwrap();
                        }
                    }
                    sender.send(begun.elapsed() / 200).unwrap();
                });
            }
        });
        drop(sender);
        times.iter().max().unwrap()
    }

    async fn bare_queries(&self) -> Duration {
        let mut times = Vec::with_capacity(TRIPS);
        for _ in 0..TRIPS {
            let begun = Instant::now();
            let answer =
                self.client.request_bytes("bench/echo", vec![1; 200], Duration::from_secs(5)).await;
            times.push(begun.elapsed());
            assert!(answer.is_ok(), "{answer:?}");
        }
        middle(times)
    }

    async fn bus_ticks(&self) -> Duration {
        let world = self.worlds[0];
        let key = keys::world(&self.tenant, world);
        let request = Request::TickWorlds(vec![tick(world, 1)]);
        let mut times = Vec::with_capacity(TRIPS);
        for _ in 0..TRIPS {
            let begun = Instant::now();
            let reply = self.client.request(&key, &request, Duration::from_secs(5)).await;
            times.push(begun.elapsed());
            assert!(matches!(reply, Ok(Reply::Ticked(_))), "{reply:?}");
        }
        middle(times)
    }

    async fn bus_batches(&self, tick_count: u32) -> Duration {
        let key = keys::batch_tick(&"world".parse().unwrap());
        let items = self.worlds.iter().map(|world| tick(*world, tick_count)).collect();
        let request = Request::TickWorlds(items);
        let mut times = Vec::new();
        for _ in 0..200 / tick_count {
            let begun = Instant::now();
            let reply = self.client.request(&key, &request, Duration::from_secs(5)).await;
            times.push(begun.elapsed());
            assert!(matches!(reply, Ok(Reply::Ticked(_))), "{reply:?}");
        }
        middle(times)
    }
}

fn tick(world: WorldId, tick_count: u32) -> TickItem {
    TickItem { world, tick_count, commands: Vec::new(), expected_tick: None }
}

/// A car on its lane at 10 m/s, and three pedestrians beside it.
fn cast() -> Vec<Command> {
    let text = roads::town::build(MAP).unwrap();
    let map = roads::Map::parse(MAP, &text).unwrap();
    let spawn = map.spawn_points()[0].cast::<f32>();
    let yaw_rad = schemas::yaw_rad(&spawn);
    let forward = Vec3::new(yaw_rad.cos(), yaw_rad.sin(), 0.0);
    let mut commands = vec![Command::SpawnActor {
        blueprint: "vehicle.lincoln.mkz".to_owned(),
        world_from_actor: level_pose(spawn.translation.vector, yaw_rad),
        linear_velocity_mps: forward * 10.0,
    }];
    for index in 0..3 {
        let left = Vec3::new(-forward.y, forward.x, 0.0);
        let place_m = spawn.translation.vector - forward * 20.0 + left * (1.5 * index as f32);
        commands.push(Command::SpawnActor {
            blueprint: "walker.pedestrian.0001".to_owned(),
            world_from_actor: level_pose(place_m + Vec3::z(), 0.0),
            linear_velocity_mps: Vec3::zeros(),
        });
    }
    commands
}
