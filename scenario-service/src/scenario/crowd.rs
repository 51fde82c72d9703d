//! Other traffic of an episode: cars that drive or are parked, and pedestrians that walk or stand
//! about.

use roads::{LaneType, LaneTypes, Map, Waypoint};
use schemas::{Pose, SplitMix64, Translation3, Vec3, level_pose};

use super::lanes::Lanes;
use super::spawn::{WALKER_CENTRE_M, walker_blueprint};
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
/// Those with blue lights.
const EMERGENCY: [&str; 3] =
    ["vehicle.dodge.charger_police", "vehicle.dodge.charger_police_2020", "vehicle.ford.ambulance"];
/// A parked car stands where its lane is so wide, as far before and behind its middle.
const PARKED_WIDTH_M: f64 = 2.0;
const PARKED_HALF_M: f64 = 4.0;
/// A parking lane farther from a place on the road than this is another road's.
const PARKED_BESIDE_M: f64 = 12.0;

/// Up to `count` cars, the first `urgent` of them with blue lights, on spawn points of the map that
/// are free of `others`, each in the world's own traffic.
pub(crate) fn cars(
    lanes: Lanes<'_>,
    (count, urgent): (u32, u32),
    others: &[Placement],
    rng: &mut SplitMix64,
) -> Vec<Placement> {
    let mut free: Vec<_> = lanes.spawn_places().map(|place| lanes.pose(place)).collect();
    let mut taken_m: Vec<Vec3> = others.iter().map(position_m).collect();
    let mut cars: Vec<Placement> = Vec::new();
    while (cars.len() as u32) < count && !free.is_empty() {
        let pose = free.swap_remove((rng.next_u64() % free.len() as u64) as usize);
        let at_m = pose.translation.vector;
        if taken_m.iter().any(|other| (other - at_m).norm() < APART_M) {
            continue;
        }
        taken_m.push(at_m);
        let is_urgent = (cars.len() as u32) < urgent;
        let (models, driver) = match is_urgent {
            true => (&EMERGENCY[..], Driver::Emergency),
            false => (&CARS[..], Driver::Traffic),
        };
        cars.push(car(models, pose, Some(driver), rng));
    }
    cars
}

/// Up to `count` cars on parking lanes of the map, none where others are.
pub(crate) fn parked(
    map: &Map,
    count: u32,
    (ego, others): (&Placement, &[Placement]),
    driver: Option<&Driver>,
    rng: &mut SplitMix64,
) -> Vec<Placement> {
    let roads = map.spread_places();
    let mut found: Vec<Placement> = Vec::new();
    for _ in 0..count as usize * TRIES {
        if found.len() == count as usize {
            break;
        }
        let Some(near) = rng.choose(roads) else { break };
        let near_m = near.translation.vector + near.rotation * Vec3::x().cast() * along_m(rng);
        let Some(place) = map.nearest(near_m.into(), LaneType::Parking.into()) else { break };
        let pose = map.pose(&place);
        let at_m = pose.translation.vector.cast::<f32>();
        let taken = |other: &Placement| (position_m(other) - at_m).norm() < APART_M;
        let beside = (pose.translation.vector - near_m).norm() < PARKED_BESIDE_M;
        let is_taken = taken(ego) || others.iter().chain(&found).any(taken);
        if beside && !is_taken && is_wide(map, place) && !blocked(map, at_m) {
            found.push(car(&CARS, pose.cast(), driver.cloned(), rng));
        }
    }
    found
}

/// Whether a lane is as wide as a parked car around a place.
fn is_wide(map: &Map, place: Waypoint) -> bool {
    [-PARKED_HALF_M, 0.0, PARKED_HALF_M].into_iter().all(|along_m| {
        let there = map.waypoint(place.road, place.lane, place.s + along_m);
        there.is_some_and(|there| map.lane(&there).width_m >= PARKED_WIDTH_M)
    })
}

/// One of some models at rest.
fn car(
    models: &[&str],
    world_from_actor: Pose,
    driver: Option<Driver>,
    rng: &mut SplitMix64,
) -> Placement {
    let blueprint = one_of(models, rng);
    Placement { blueprint, world_from_actor, linear_velocity_mps: Vec3::zeros(), driver }
}

/// A car that drives anywhere.
pub(super) fn car_blueprint(rng: &mut SplitMix64) -> String {
    one_of(&CARS, rng)
}

fn one_of(models: &[&str], rng: &mut SplitMix64) -> String {
    rng.choose(models).copied().unwrap_or(CARS[0]).to_owned()
}

/// Somewhere along a road, not only beside the spawn points themselves.
fn along_m(rng: &mut SplitMix64) -> f64 {
    (rng.next_u64() % 41) as f64 - 20.0
}

/// Up to `count` pedestrians on the map's sidewalks, none in the way of those already there.
pub(crate) fn pedestrians(
    map: &Map,
    count: u32,
    others: &[Placement],
    driver: Option<&Driver>,
    rng: &mut SplitMix64,
) -> Vec<Placement> {
    let roads: Vec<_> = map.spread_places().to_vec();
    let mut found: Vec<Placement> = Vec::new();
    for _ in 0..count {
        for _ in 0..TRIES {
            let Some(near) = rng.choose(&roads) else { return found };
            let near_m = near.translation.vector + near.rotation * Vec3::x().cast() * along_m(rng);
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
                blueprint: walker_blueprint(rng),
                world_from_actor: level_pose(at_m, yaw_rad),
                linear_velocity_mps: Vec3::zeros(),
                driver: driver.cloned(),
            });
            break;
        }
    }
    found
}

fn position_m(placement: &Placement) -> Vec3 {
    placement.world_from_actor.translation.vector
}

/// Whether something of the map, or the post of a light or sign, stands there or close by.
pub(super) fn blocked(map: &Map, at_m: Vec3) -> bool {
    let at_m = Translation3::from(at_m.cast::<f64>());
    let reaches = |offset_m: f64, half_m: f64| offset_m.abs() < half_m + f64::from(WALKER_APART_M);
    let is_solid = map.scenery().iter().any(|solid| {
        let offset_m = (solid.pose.inverse() * at_m).translation.vector;
        reaches(offset_m.x, solid.half_extent_m.x) && reaches(offset_m.y, solid.half_extent_m.y)
    });
    is_solid
        || map.posts().iter().any(|post| {
            let offset_m = (post.foot.inverse() * at_m).translation.vector;
            reaches(offset_m.x, post.radius_m) && reaches(offset_m.y, post.radius_m)
        })
}
