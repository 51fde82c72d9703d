//! How long does a ray of a lidar take in a town with 50 vehicles?
//!
//! One iteration is a tick's scan of 64 channels at 1.3 million points per second; the time of a
//! tick of the same world without the lidar is measured beside it, to be subtracted.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench fails loudly")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use schemas::{
    ActorId, Attachment, AttachmentKind, Attribute, Command, Pose, SensorCommand, Vec3, WorldId,
};
use world::{Town, World, WorldConfig};

const POINTS_PER_SECOND: u32 = 1_300_000;
const DT_SECS: f64 = 0.05;
/// Rounded to whole points per channel.
const RAYS_PER_TICK: u64 = 64 * 1_016;

fn town_with_vehicles(count: usize) -> (World, ActorId) {
    let text = roads::town::build("Town10HD_Opt").unwrap();
    let roads = roads::Map::parse("Town10HD_Opt", &text).unwrap();
    let points: Vec<Pose> =
        roads.spawn_points().iter().map(|&point| nalgebra::convert(point)).collect();
    let map = Arc::new(Town::new(Arc::new(roads)));
    let id = WorldId::new(1).unwrap();
    let mut world =
        World::new(WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map }).unwrap();
    let cars: Vec<ActorId> = points
        .iter()
        .filter_map(|&point| {
            let spawn = Command::spawn("vehicle.lincoln.mkz", point, Vec3::zeros());
            world.apply(&spawn).ok().flatten()
        })
        .take(count)
        .collect();
    assert_eq!(cars.len(), count);
    // Cars that have fallen asleep leave the time to the rays.
    for _ in 0..100 {
        world.tick().unwrap();
    }
    (world, cars[count / 2])
}

fn with_lidar(world: &World, car: ActorId, range_m: &str) -> World {
    let mut world = world.fork(world.id());
    let points = POINTS_PER_SECOND.to_string();
    let attributes =
        [("channels", "64"), ("points_per_second", points.as_str()), ("range", range_m)];
    let sensor = world.apply(&Command::SpawnActor {
        blueprint: "sensor.lidar.ray_cast_semantic".to_owned(),
        reference_from_actor: Pose::translation(0.0, 0.0, 2.4),
        linear_velocity_mps: Vec3::zeros(),
        attributes: attributes
            .map(|(id, value)| Attribute { id: id.to_owned(), value: value.to_owned() })
            .to_vec(),
        attachment: Some(Attachment { parent: car, kind: AttachmentKind::Rigid }),
        id: None,
    });
    let sensor = sensor.unwrap().unwrap();
    world.apply(&Command::Sensor(SensorCommand::Listen { sensor, on: true })).unwrap();
    world.tick().unwrap();
    world
}

fn rays(criterion: &mut Criterion) {
    let (world, car) = town_with_vehicles(50);
    let mut group = criterion.benchmark_group("rays");
    group.sample_size(10);
    group.throughput(Throughput::Elements(RAYS_PER_TICK));
    for range_m in ["10", "50", "100"] {
        let mut world = with_lidar(&world, car, range_m);
        group.bench_function(format!("scan of {range_m} m"), |bencher| {
            bencher.iter(|| {
                world.tick().unwrap();
                black_box(world.sensors().len())
            });
        });
    }
    let mut world = world.fork(world.id());
    group.bench_function("tick without a lidar", |bencher| {
        bencher.iter(|| world.tick().unwrap());
    });
    group.finish();
}

criterion_group!(benches, rays);
criterion_main!(benches);
