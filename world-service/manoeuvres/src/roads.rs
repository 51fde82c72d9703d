//! Our drivers on any road: who leaves it, tips over or hits somebody.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use agents::Network;
use nalgebra::{Point3, Vector3};
use roads::{LaneTypes, Map, Waypoint};
use schemas::{
    ActorId, ActorKind, ActorState, AgentBehaviour, AgentCommand, AgentOptions, Command, Error,
    ErrorCode, Pose, TrafficCommand, Vec3, WorldId,
};
use world::{Town, World, WorldConfig};

use crate::Result;

const DT_SECS: f64 = 0.05;
const TICKS_PER_SEC: u32 = 20;
/// Where vehicles are is looked at so often, in ticks.
const LOOK_TICKS: u32 = 4;
/// Farther beyond the edge than this a vehicle has left the road, in metres.
const LEFT_M: f64 = 0.5;
/// Slower than this a vehicle stands, and after so many seconds it is stuck.
const STANDING_MPS: f32 = 0.2;
const STUCK_SECS: u32 = 120;
/// First and last step along a lane in search of the place nearest to a vehicle.
const SEARCH_M: f64 = 4.0;
const SEARCH_M_MIN: f64 = 0.01;
/// Tilted by more than 60° a vehicle lies.
const LYING: f32 = 0.5;

/// Way between places at which two-wheelers begin.
const PLACES_M: f32 = 20.0;
/// Motorcycles and bicycles by turns.
const TWO_WHEELERS: [&str; 5] = [
    "vehicle.kawasaki.ninja",
    "vehicle.diamondback.century",
    "vehicle.vespa.zx125",
    "vehicle.gazelle.omafiets",
    "vehicle.harley-davidson.low_rider",
];

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drivers {
    /// The world's own traffic.
    Traffic,
    /// Normal navigation agents without a destination.
    Agents,
    /// The world's own traffic on motorcycles and bicycles.
    Riders,
}

impl Drivers {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Traffic, Self::Agents, Self::Riders];

    /// As tables name them.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Traffic => "traffic",
            Self::Agents => "agents",
            Self::Riders => "riders",
        }
    }
}

/// What came of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// How many there was room for.
    pub vehicles: u32,
    /// How far the middle of a vehicle was beyond the edge of all driving lanes at worst.
    pub worst_m: f64,
    /// Where that was.
    pub worst_at_m: Vec3,
    /// Vehicles that were more than half a metre beyond it.
    pub left: usize,
    /// Vehicles that lay at some time.
    pub tipped: usize,
    /// Contacts of vehicles with anything.
    pub contacts: u32,
    /// Red lights and stop signs that were run.
    pub broken: u32,
    /// Vehicles that stood for the last two minutes.
    pub stuck: usize,
    /// Of all vehicles over all time.
    pub mean_mps: f64,
}

/// Drives up to `count` cars on a map for some minutes, with its lights and signs.
///
/// # Errors
/// `Unsupported` for a map without room for a single car; a world that diverged.
pub fn drive(map: &Arc<Map>, drivers: Drivers, count: u32, minutes: u32) -> Result<Drive> {
    let (mut world, vehicles) = begin(map, drivers, count)?;
    let mut found = Drive {
        vehicles,
        worst_m: 0.0,
        worst_at_m: Vec3::zeros(),
        left: 0,
        tipped: 0,
        contacts: 0,
        broken: 0,
        stuck: 0,
        mean_mps: 0.0,
    };
    let (mut left, mut tipped) = (BTreeSet::new(), BTreeSet::new());
    let mut moved_at: BTreeMap<ActorId, u32> = BTreeMap::new();
    let (mut sum_mps, mut samples) = (0.0, 0u32);
    let ticks = minutes * 60 * TICKS_PER_SEC;
    for tick in 1..=ticks {
        world.tick()?;
        found.contacts += world.collisions().iter().filter(|hit| hit.started).count() as u32;
        if !tick.is_multiple_of(LOOK_TICKS) {
            continue;
        }
        let frame = world.frame();
        for vehicle in frame.actors.iter().filter(|actor| actor.kind == ActorKind::Vehicle) {
            let beyond_m = beyond_edge_m(map, vehicle);
            if beyond_m > found.worst_m {
                let at_m = vehicle.world_from_actor.translation.vector;
                (found.worst_m, found.worst_at_m) = (beyond_m, at_m);
            }
            if beyond_m > LEFT_M {
                left.insert(vehicle.id);
            }
            if (vehicle.world_from_actor.rotation * Vec3::z()).z < LYING {
                tipped.insert(vehicle.id);
            }
            let mps = vehicle.linear_velocity_mps.norm();
            (sum_mps, samples) = (sum_mps + f64::from(mps), samples + 1);
            // Who stands from the beginning has stood for all of the drive.
            let at = moved_at.entry(vehicle.id).or_insert(tick - LOOK_TICKS);
            if mps > STANDING_MPS {
                *at = tick;
            }
        }
    }
    let is_stuck = |at: &&u32| ticks - **at >= STUCK_SECS * TICKS_PER_SEC;
    found.stuck = moved_at.values().filter(is_stuck).count();
    let broken = world.rules_broken().map(|(_, broken)| broken.red_lights + broken.stop_signs);
    found.broken = broken.sum();
    (found.left, found.tipped) = (left.len(), tipped.len());
    found.mean_mps = sum_mps / f64::from(samples.max(1));
    Ok(found)
}

/// A world with as many cars as there is room for.
fn begin(map: &Arc<Map>, drivers: Drivers, count: u32) -> Result<(World, u32)> {
    let internal = |text: &str| Error::new(ErrorCode::Internal, text);
    let id = WorldId::new(1).ok_or_else(|| internal("no world has the id 0"))?;
    let places = Network::new(map).places(PLACES_M);
    let map = Arc::new(Town::new(Arc::clone(map)));
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map };
    let mut world = World::with_traffic(config)?;
    let vehicles = match drivers {
        Drivers::Riders => ride(&mut world, &places, count)?,
        Drivers::Traffic | Drivers::Agents => (1..=count).rev().find(|count| {
            let (count, behaviour) = (*count, None);
            world.apply(&Command::Traffic(TrafficCommand::Spawn { count, behaviour })).is_ok()
        }),
    };
    let vehicles = vehicles.ok_or_else(|| {
        Error::new(ErrorCode::Unsupported, "the map has no lane with room for a car")
    })?;
    if drivers == Drivers::Agents {
        let of = |actor: &ActorState| (actor.kind == ActorKind::Vehicle).then_some(actor.id);
        let cars: Vec<ActorId> = world.frame().actors.iter().filter_map(of).collect();
        for actor in cars {
            let behaviour = AgentBehaviour::Normal;
            let options = AgentOptions { behaviour, ..AgentOptions::default() };
            let keep_route = false;
            world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route }))?;
            world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true }))?;
        }
    }
    Ok((world, vehicles))
}

/// Puts two-wheelers on places over all of the map; how many, if there was room for any.
fn ride(world: &mut World, places: &[Pose], count: u32) -> Result<Option<u32>> {
    let (mut rode, mut kinds) = (0, TWO_WHEELERS.iter().cycle());
    let step = (places.len() / count.max(1) as usize).max(1);
    for pose in places.iter().step_by(step).take(count as usize) {
        let kind = kinds.next().copied().unwrap_or(TWO_WHEELERS[0]);
        match world.apply(&Command::spawn(kind, *pose, Vec3::zeros())) {
            Ok(Some(actor)) => {
                let behaviour = AgentBehaviour::Normal;
                world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour }))?;
                rode += 1;
            }
            Ok(None) => {}
            Err(error) if error.code == ErrorCode::SpawnBlocked => {}
            Err(error) => return Err(error),
        }
    }
    Ok((rode > 0).then_some(rode))
}

/// How far the middle of a vehicle is beyond the edge or the end of the nearest driving lane.
fn beyond_edge_m(map: &Map, vehicle: &ActorState) -> f64 {
    beyond_m(map, nalgebra::convert(vehicle.world_from_actor.translation.vector))
}

fn beyond_m(map: &Map, here: Vector3<f64>) -> f64 {
    let Some(mut lane) = map.nearest(Point3::from(here), LaneTypes::DRIVING) else {
        return f64::INFINITY;
    };
    let mut least_m = away_m(map, &lane, here);
    // The map's search takes bends for chords, as CARLA's does: the place that it names may be
    // metres off along the lane.
    let mut step_m = SEARCH_M;
    while least_m > SEARCH_M_MIN && step_m > SEARCH_M_MIN {
        let around = [map.next(&lane, step_m), map.previous(&lane, step_m)].into_iter().flatten();
        let nearer = around.map(|place| (away_m(map, &place, here), place));
        match nearer.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
            Some((found_m, place)) if found_m < least_m => (least_m, lane) = (found_m, place),
            _ => step_m /= 2.0,
        }
    }
    least_m
}

/// How far a point is beyond the edge of a lane, or along from this place on it.
fn away_m(map: &Map, lane: &Waypoint, here: Vector3<f64>) -> f64 {
    let away_m = map.pose(lane).inverse().transform_point(&Point3::from(here));
    let beside_m = (away_m.y.abs() - map.lane(lane).width_m / 2.0).max(0.0);
    beside_m.hypot(away_m.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_leaves_the_roads_of_our_towns() {
        let text = roads::town::build("Town02_Opt").unwrap();
        let map = Arc::new(Map::parse("Town02_Opt", &text).unwrap());
        for drivers in Drivers::ALL {
            let found = drive(&map, drivers, 10, 1).unwrap();
            assert_eq!((found.vehicles, found.left, found.tipped), (10, 0, 0), "{found:?}");
            assert!(found.worst_m < LEFT_M && found.mean_mps > 0.5, "{found:?}");
        }
    }

    /// A lane 12 m outside of a road that turns half around a circle of 2 m.
    #[test]
    fn the_middle_of_a_lane_is_on_the_road_in_every_bend() {
        let text = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="arc" version="1" north="0" south="0" east="0" west="0"/>
  <road name="arc" length="6.2" id="1" junction="-1">
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="6.2"><arc curvature="0.5"/></geometry>
    </planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="shoulder" level="false">
        <width sOffset="0" a="10" b="0" c="0" d="0"/></lane>
      <lane id="-2" type="driving" level="false">
        <width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;
        let map = Map::parse("arc", text).unwrap();
        let (entry, exit) = map.driving_lanes()[0];
        for share in 0..=20 {
            let s = entry.s + (exit.s - entry.s) * f64::from(share) / 20.0;
            let place = map.pose(&Waypoint { s, ..entry });
            let found_m = beyond_m(&map, place.translation.vector);
            assert!(found_m < 0.1, "{share}: {found_m} m");
            let beside = place.transform_point(&Point3::new(0.0, -2.5, 0.0));
            let found_m = beyond_m(&map, beside.coords);
            assert!((found_m - 1.0).abs() < 0.1, "{share}: {found_m} m of 1");
        }
    }
}
