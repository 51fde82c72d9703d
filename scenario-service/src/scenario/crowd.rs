//! Other traffic of an episode: cars that drive, and pedestrians that walk or stand about.

use roads::{LaneTypes, Map};
use schemas::{SplitMix64, Translation3, Vec3, level_pose};

use super::lanes::Lanes;
use super::spawn::WALKER_CENTRE_M;
use super::{Driver, Placement};

/// Cars keep at least this much apart at the start, from each other and from the ego.
const APART_M: f32 = 10.0;
/// Pedestrians keep this much apart from everything.
const WALKER_APART_M: f32 = 1.5;
/// Places tried for a pedestrian.
const TRIES: usize = 10;
/// A pedestrian stands no farther than this from the road it was looked for at.
const BESIDE_ROAD_M: f64 = 15.0;
/// Cars that are as wide as a lane allows and drive on two axles.
const CARS: [&str; 8] = [
    "vehicle.audi.tt",
    "vehicle.citroen.c3",
    "vehicle.ford.mustang",
    "vehicle.mini.cooper_s",
    "vehicle.nissan.micra",
    "vehicle.seat.leon",
    "vehicle.tesla.model3",
    "vehicle.toyota.prius",
];
const WALKERS: u64 = 49;

/// Up to `count` cars on free spawn points of the map, each in the world's own traffic.
pub(crate) fn cars(
    lanes: Lanes<'_>,
    count: u32,
    ego: &Placement,
    rng: &mut SplitMix64,
) -> Vec<Placement> {
    let mut free: Vec<_> = lanes.spawn_places().map(|place| lanes.pose(place)).collect();
    let mut taken_m = vec![position_m(ego)];
    let mut cars = Vec::new();
    while (cars.len() as u32) < count && !free.is_empty() {
        let pose = free.swap_remove((rng.next_u64() % free.len() as u64) as usize);
        let at_m = pose.translation.vector;
        if taken_m.iter().any(|other| (other - at_m).norm() < APART_M) {
            continue;
        }
        taken_m.push(at_m);
        let blueprint = rng.choose(&CARS).copied().unwrap_or(CARS[0]);
        cars.push(Placement {
            blueprint: blueprint.to_owned(),
            world_from_actor: pose,
            linear_velocity_mps: Vec3::zeros(),
            driver: Some(Driver::Traffic),
        });
    }
    cars
}

/// Up to `count` pedestrians on the map's sidewalks, none in the way of those already there.
pub(crate) fn pedestrians(
    map: &Map,
    count: u32,
    others: &[Placement],
    driver: Option<Driver>,
    rng: &mut SplitMix64,
) -> Vec<Placement> {
    let roads: Vec<_> = map.spread_places().to_vec();
    let mut found: Vec<Placement> = Vec::new();
    for _ in 0..count {
        for _ in 0..TRIES {
            let Some(near) = rng.choose(&roads) else { return found };
            // Somewhere along the road, not only beside the spawn points themselves.
            let along_m = (rng.next_u64() % 41) as f64 - 20.0;
            let near_m = near.translation.vector + near.rotation * Vec3::x().cast() * along_m;
            let Some(place) = map.nearest(near_m.into(), LaneTypes::SIDEWALK) else { return found };
            let pose = map.pose(&place);
            if (pose.translation.vector - near_m).norm() > BESIDE_ROAD_M {
                continue;
            }
            let foot_m = pose.translation.vector.cast::<f32>();
            let at_m =
                (Translation3::from(foot_m) * Translation3::new(0.0, 0.0, WALKER_CENTRE_M)).vector;
            let in_the_way = |other: &Placement| (position_m(other) - at_m).norm() < WALKER_APART_M;
            let is_car = |other: &Placement| other.blueprint.starts_with("vehicle.");
            let near_car =
                |other: &Placement| is_car(other) && (position_m(other) - at_m).norm() < 4.0;
            if blocked(map, at_m) || found.iter().any(in_the_way) || others.iter().any(near_car) {
                continue;
            }
            let yaw_rad = (rng.next_u64() % 360) as f32 * std::f32::consts::PI / 180.0;
            found.push(Placement {
                blueprint: format!("walker.pedestrian.{:04}", 1 + rng.next_u64() % WALKERS),
                world_from_actor: level_pose(at_m, yaw_rad),
                linear_velocity_mps: Vec3::zeros(),
                driver,
            });
            break;
        }
    }
    found
}

fn position_m(placement: &Placement) -> Vec3 {
    placement.world_from_actor.translation.vector
}

/// Whether something of the map stands there or close by.
fn blocked(map: &Map, at_m: Vec3) -> bool {
    let at_m = Translation3::from(at_m.cast::<f64>());
    map.scenery().iter().any(|solid| {
        let offset_m = (solid.pose.inverse() * at_m).translation.vector;
        let reach_m = solid.half_extent_m.add_scalar(f64::from(WALKER_APART_M));
        offset_m.x.abs() < reach_m.x && offset_m.y.abs() < reach_m.y
    })
}
