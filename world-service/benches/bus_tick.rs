//! What does the bus cost a tick? One world, and 64 worlds in one round trip.
//!
//! Unit of work: one tick of a world with a car and three pedestrians. Client and service are two
//! sessions of this process over loopback TCP; ticks take the fast channel. Run it with the runtime
//! settings of `causeway up`: ZENOH_RUNTIME as in `bus::RUNTIME`. Printed are medians over rounds
//! in which every way is measured in turn, and the two ratios that are promised.
#![allow(clippy::unwrap_used, reason = "a bench that cannot run stops")]

use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use bus::{Bus, BusAddress, BusConfig, Channel};
use monitoring::Monitor;
use schemas::{
    ActorId, Command, Reply, Request, ServiceKind, Tenant, TickItem, Vec3, WorldId, keys,
    level_pose,
};
use world::{Town, World, WorldConfig};
use world_service::Config;

const MAP: &str = "Town10HD_Opt";
const ROUNDS: usize = 5;
const TICKS: usize = 500;
const WORLDS: u64 = 64;
const BATCH_TICKS: u32 = 200;
const DEADLINE: Duration = Duration::from_secs(20);

#[tokio::main]
async fn main() {
    // A task, as those who ask are in the services: `main` would have to be woken besides.
    tokio::spawn(measure()).await.unwrap();
}

async fn measure() {
    let config = Config {
        listen: vec![BusAddress::loopback(0)],
        connect: Vec::new(),
        identity: None,
        id: "world".parse().unwrap(),
        shard_count: std::thread::available_parallelism().unwrap(),
        maps: None,
        journals: None,
        worlds_max: 256,
    };
    let service = world_service::start(config, &Monitor::default()).await.unwrap();
    let client = Bus::open(BusConfig::connecting(service.listening()[0].clone())).await.unwrap();
    let host = "world".parse().unwrap();
    let key = keys::batch_tick(&host);
    let channel = client.channel(&key, (ServiceKind::World, &host)).await.unwrap();
    let site = Site::new(client, channel);
    let echo = Echo::open().await;

    let (mut own, mut bare, mut over_bus) = (Vec::new(), Vec::new(), Vec::new());
    let (mut own_batch, mut own_round) = (Vec::new(), Vec::new());
    let (mut batch_of_20, mut batch_of_1) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        own.push(site.own_ticks());
        bare.push(echo.queries().await);
        over_bus.push(site.bus_ticks().await);
        own_batch.push(site.own_batches());
        own_round.push(site.own_rounds());
        batch_of_20.push(site.bus_batches(20).await);
        batch_of_1.push(site.bus_batches(1).await);
    }
    let [own, bare, over_bus] = [own, bare, over_bus].map(middle);
    let [own_batch, own_round, batch_of_20, batch_of_1] =
        [own_batch, own_round, batch_of_20, batch_of_1].map(middle);
    println!("one tick inside the process         {:8.1} µs", micros(own));
    println!("a bare query round trip             {:8.1} µs", micros(bare));
    println!("one tick over the bus               {:8.1} µs", micros(over_bus));
    let ratio = (over_bus.saturating_sub(own)).as_secs_f64() / bare.as_secs_f64();
    println!("  without the tick itself           {ratio:8.2} × the bare query");
    println!("64 worlds on all cores, each one tick:");
    println!("  inside the process                {:8.1} µs", micros(own_batch));
    for (name, time) in [
        ("there, threads waiting for each  ", own_round),
        ("in round trips of  1 ticks each  ", batch_of_1),
        ("in round trips of 20 ticks each  ", batch_of_20),
    ] {
        let percent = 100.0 * own_batch.as_secs_f64() / time.as_secs_f64();
        println!("  {name} {:8.1} µs, {percent:.0} % of the rate", micros(time));
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

/// A service that answers from the bus's thread, with as many bytes as a tick.
struct Echo {
    client: Bus,
    _service: Bus,
    _serving: bus::Serving,
}

impl Echo {
    async fn open() -> Self {
        let service = Bus::open(BusConfig::listening(BusAddress::loopback(0))).await.unwrap();
        let client =
            Bus::open(BusConfig::connecting(service.listening()[0].clone())).await.unwrap();
        let answer = schemas::wire::encode_reply(&Reply::Snapshot(vec![1; 1_500]));
        let serving =
            service.serve("bench/echo", move |incoming| incoming.reply_bytes(answer.clone()));
        let serving = serving.await.unwrap();
        Self { client, _service: service, _serving: serving }
    }

    async fn queries(&self) -> Duration {
        let mut times = Vec::with_capacity(TICKS);
        for _ in 0..TICKS {
            let begun = Instant::now();
            let answer = self.client.request_bytes("bench/echo", vec![1; 200], DEADLINE).await;
            times.push(begun.elapsed());
            assert!(answer.is_ok(), "{answer:?}");
        }
        middle(times)
    }
}

/// The service's side and its equal inside this process. Every measurement begins with new worlds,
/// as one whose car has come to rest costs less.
struct Site {
    client: Bus,
    channel: Channel,
    tenant: Tenant,
    town: Arc<Town>,
    cast: Vec<Command>,
}

impl Site {
    fn new(client: Bus, channel: Channel) -> Self {
        let text = roads::town::build(MAP).unwrap();
        let map = Arc::new(roads::Map::parse(MAP, &text).unwrap());
        let (cast, town) = (cast(&map), Arc::new(Town::new(map)));
        Self { client, channel, tenant: "local".parse().unwrap(), town, cast }
    }

    async fn create(&self, seed: u64) -> WorldId {
        let create = Request::CreateWorld {
            map: MAP.to_owned(),
            seed,
            dt_secs: 0.05,
            commands: self.cast.clone(),
            lease: None,
            traffic: false,
            first_actor: ActorId::FIRST,
        };
        match self.client.request(&keys::worlds(&self.tenant), &create, DEADLINE).await {
            Ok(Reply::WorldCreated { world, .. }) => world,
            other => panic!("{other:?}"),
        }
    }

    async fn destroy(&self, world: WorldId) {
        let destroy = Request::DestroyWorld { world };
        let key = keys::worlds(&self.tenant);
        assert_eq!(self.client.request(&key, &destroy, DEADLINE).await, Ok(Reply::Done));
    }

    fn own_world(&self, seed: u64) -> World {
        let id = WorldId::new(1).unwrap();
        let map = Arc::clone(&self.town);
        let mut world = World::new(WorldConfig { id, epoch: 1, seed, dt_secs: 0.05, map }).unwrap();
        for command in &self.cast {
            world.apply(command).unwrap();
        }
        world
    }

    fn own_ticks(&self) -> Duration {
        let mut world = self.own_world(0);
        let mut times = Vec::with_capacity(TICKS);
        for _ in 0..TICKS {
            let begun = Instant::now();
            world.tick().unwrap();
            std::hint::black_box(schemas::wire::encode_frame(&world.frame()));
            times.push(begun.elapsed());
        }
        middle(times)
    }

    async fn bus_ticks(&self) -> Duration {
        let world = self.create(0).await;
        let request = Request::TickWorlds(vec![tick(world, 1)]);
        let mut times = Vec::with_capacity(TICKS);
        for _ in 0..TICKS {
            let begun = Instant::now();
            let reply = self.channel.request(&request, DEADLINE).await;
            times.push(begun.elapsed());
            assert!(matches!(reply, Ok(Reply::Ticked(_))), "{reply:?}");
        }
        self.destroy(world).await;
        middle(times)
    }

    /// Mean time in which 64 worlds, spread over all cores, are all one tick further.
    fn own_batches(&self) -> Duration {
        let threads = std::thread::available_parallelism().unwrap().get();
        let mut worlds: Vec<World> = (0..WORLDS).map(|seed| self.own_world(seed)).collect();
        let begun = Instant::now();
        std::thread::scope(|scope| {
            for part in worlds.chunks_mut(WORLDS as usize / threads) {
                scope.spawn(move || {
                    for _ in 0..BATCH_TICKS {
                        part.iter_mut().for_each(|world| world.tick().unwrap());
                    }
                });
            }
        });
        begun.elapsed() / BATCH_TICKS
    }

    /// The same, but every tick is handed to threads that wait for it, and waited for: what the
    /// machine takes of a round trip before a bus does.
    fn own_rounds(&self) -> Duration {
        let threads = std::thread::available_parallelism().unwrap().get();
        let mut worlds: Vec<World> = (0..WORLDS).map(|seed| self.own_world(seed)).collect();
        std::thread::scope(|scope| {
            let (done, all_done) = mpsc::channel();
            let parts = worlds.chunks_mut(WORLDS as usize / threads);
            let orders: Vec<mpsc::Sender<()>> = parts
                .map(|part| {
                    let (order, ordered) = mpsc::channel();
                    let done = done.clone();
                    scope.spawn(move || {
                        for () in ordered {
                            part.iter_mut().for_each(|world| world.tick().unwrap());
                            done.send(()).unwrap();
                        }
                    });
                    order
                })
                .collect();
            let begun = Instant::now();
            for _ in 0..BATCH_TICKS {
                orders.iter().for_each(|order| order.send(()).unwrap());
                all_done.iter().take(orders.len()).count();
            }
            begun.elapsed() / BATCH_TICKS
        })
    }

    async fn bus_batches(&self, tick_count: u32) -> Duration {
        let mut worlds = Vec::new();
        for seed in 0..WORLDS {
            worlds.push(self.create(seed).await);
        }
        let items = worlds.iter().map(|world| tick(*world, tick_count)).collect();
        let request = Request::TickWorlds(items);
        let begun = Instant::now();
        for _ in 0..BATCH_TICKS / tick_count {
            let reply = self.channel.request(&request, DEADLINE).await;
            assert!(matches!(reply, Ok(Reply::Ticked(_))), "{reply:?}");
        }
        let time = begun.elapsed() / BATCH_TICKS;
        for world in worlds {
            self.destroy(world).await;
        }
        time
    }
}

fn tick(world: WorldId, tick_count: u32) -> TickItem {
    TickItem::new(world, tick_count)
}

/// A car on its lane at 10 m/s, and three pedestrians behind it.
fn cast(map: &roads::Map) -> Vec<Command> {
    let spawn = map.spawn_points()[0].cast::<f32>();
    let yaw_rad = schemas::yaw_rad(&spawn);
    let forward = Vec3::new(yaw_rad.cos(), yaw_rad.sin(), 0.0);
    let left = Vec3::new(-forward.y, forward.x, 0.0);
    let start = level_pose(spawn.translation.vector, yaw_rad);
    let mut commands = vec![Command::spawn("vehicle.lincoln.mkz", start, forward * 10.0)];
    commands.extend((0..3).map(|index| {
        let place_m = spawn.translation.vector - forward * 20.0 + left * (1.5 * index as f32);
        let pose = level_pose(place_m + Vec3::z(), 0.0);
        Command::spawn("walker.pedestrian.0001", pose, Vec3::zeros())
    }));
    commands
}
