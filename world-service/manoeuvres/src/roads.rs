//! Our drivers on any road: who leaves it, tips over or hits somebody.

mod edge;
mod start;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use agents::Held;
use roads::Map;
use schemas::{ActorId, ActorKind, AgentStatus, Error, ErrorCode, Frame, Vec3};
use world::{Broken, World};

use crate::Result;
use edge::beyond_edge_m;
use start::Stage;

const DT_SECS: f64 = 0.05;
const TICKS_PER_SEC: u32 = 20;
/// Where vehicles are is looked at so often, in ticks.
const LOOK_TICKS: u32 = 4;
/// Farther beyond the edge than this a vehicle has left the road, in metres.
const LEFT_M: f64 = 0.5;
/// Slower than this a vehicle stands, and after so many seconds it is stuck.
const STANDING_MPS: f32 = 0.2;
const STUCK_SECS: u32 = 120;
/// Tilted by more than 60° a vehicle lies.
const LYING: f32 = 0.5;

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drivers {
    /// The world's own traffic.
    Traffic,
    /// Normal navigation agents without a destination.
    Agents,
    /// Normal navigation agents, each on its way to one place after the other.
    Routes,
    /// Pilots that keep a lane and a speed, as `maintain_speed` does: each in a world of its own,
    /// as they look out for nobody.
    Pilots,
    /// The world's own traffic on motorcycles and bicycles.
    Riders,
}

impl Drivers {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Traffic, Self::Agents, Self::Routes, Self::Pilots, Self::Riders];

    /// As tables name them.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Traffic => "traffic",
            Self::Agents => "agents",
            Self::Routes => "routes",
            Self::Pilots => "pilots",
            Self::Riders => "riders",
        }
    }
}

/// What is to be driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trial {
    /// Who drives.
    pub drivers: Drivers,
    /// Vehicles, as far as there is room.
    pub count: u32,
    /// Simulated time; pilots share it.
    pub minutes: u32,
    /// Whether the roads are as wet as they get.
    pub wet: bool,
}

/// A vehicle that stood for the last two minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stuck {
    /// Which.
    pub id: ActorId,
    /// Where.
    pub at_m: Vec3,
    /// For how long, in seconds.
    pub secs: u32,
    /// What its driver waits for; none for a pilot.
    pub held: Option<Held>,
    /// What its agent is about.
    pub status: Option<AgentStatus>,
}

/// What came of a drive.
#[derive(Clone, Debug, Default, PartialEq)]
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
    /// Pairs of vehicles, or of a vehicle and something else, that touched.
    pub collided: usize,
    /// Rules of the road that were broken.
    pub broken: u32,
    /// Vehicles that stood for the last two minutes.
    pub stuck: Vec<Stuck>,
    /// Of all vehicles over all time.
    pub mean_mps: f64,
}

/// Lets vehicles drive on a map, with its lights and signs.
///
/// # Errors
/// `Unsupported` for a map without room for a single car; a world that diverged.
pub fn drive(map: &Arc<Map>, trial: &Trial) -> Result<Drive> {
    if trial.drivers != Drivers::Pilots {
        return watch(Stage::new(map, trial, 0)?, map, trial.minutes * 60);
    }
    let mut all = Drive::default();
    for number in 0..trial.count as usize {
        let stage = match Stage::new(map, trial, number) {
            Ok(stage) => stage,
            Err(error) if error.code == ErrorCode::Unsupported => continue,
            Err(error) => return Err(error),
        };
        all = all.and(watch(stage, map, (trial.minutes * 60 / trial.count).max(1))?);
    }
    if all.vehicles == 0 {
        return Err(Error::new(ErrorCode::Unsupported, "the map has no lane with room for a car"));
    }
    Ok(all)
}

impl Drive {
    /// Both together.
    fn and(self, other: Self) -> Self {
        let [own, new] = [&self, &other].map(|drive| (drive.worst_m, drive.worst_at_m));
        let (worst_m, worst_at_m) = if new.0 > own.0 { new } else { own };
        let (own, new) = (f64::from(self.vehicles), f64::from(other.vehicles));
        Self {
            vehicles: self.vehicles + other.vehicles,
            worst_m,
            worst_at_m,
            left: self.left + other.left,
            tipped: self.tipped + other.tipped,
            collided: self.collided + other.collided,
            broken: self.broken + other.broken,
            stuck: self.stuck.into_iter().chain(other.stuck).collect(),
            mean_mps: (self.mean_mps * own + other.mean_mps * new) / (own + new).max(1.0),
        }
    }
}

/// What is noted of each vehicle on the way.
#[derive(Default)]
struct Notes {
    left: BTreeSet<ActorId>,
    tipped: BTreeSet<ActorId>,
    collided: BTreeSet<(ActorId, Option<ActorId>)>,
    /// When it last moved, in ticks.
    moved_at: BTreeMap<ActorId, u32>,
    sum_mps: f64,
    samples: u32,
}

impl Notes {
    fn look(&mut self, map: &Map, frame: &Frame, tick: u32, found: &mut Drive) {
        for vehicle in frame.actors.iter().filter(|actor| actor.kind == ActorKind::Vehicle) {
            let beyond_m = beyond_edge_m(map, vehicle);
            if beyond_m > found.worst_m {
                let at_m = vehicle.world_from_actor.translation.vector;
                (found.worst_m, found.worst_at_m) = (beyond_m, at_m);
            }
            if beyond_m > LEFT_M {
                self.left.insert(vehicle.id);
            }
            if (vehicle.world_from_actor.rotation * Vec3::z()).z < LYING {
                self.tipped.insert(vehicle.id);
            }
            let mps = vehicle.linear_velocity_mps.norm();
            (self.sum_mps, self.samples) = (self.sum_mps + f64::from(mps), self.samples + 1);
            // Who stands from the beginning has stood for all of the drive.
            let at = self.moved_at.entry(vehicle.id).or_insert(tick - LOOK_TICKS);
            if mps > STANDING_MPS {
                *at = tick;
            }
        }
    }
}

fn watch(mut stage: Stage, map: &Map, secs: u32) -> Result<Drive> {
    let mut found = Drive { vehicles: stage.vehicles, ..Drive::default() };
    let mut notes = Notes::default();
    let ticks = secs * TICKS_PER_SEC;
    for tick in 1..=ticks {
        if tick % TICKS_PER_SEC == 1 {
            stage.send()?;
        }
        stage.world.tick()?;
        let hits = stage.world.collisions().iter();
        notes.collided.extend(hits.map(|hit| (hit.actor, hit.other)));
        if tick.is_multiple_of(LOOK_TICKS) {
            notes.look(map, &stage.world.frame(), tick, &mut found);
        }
    }
    found.stuck = stuck(&stage.world, &notes, ticks);
    found.broken = broken(&stage.world);
    (found.left, found.tipped) = (notes.left.len(), notes.tipped.len());
    found.collided = notes.collided.len();
    found.mean_mps = notes.sum_mps / f64::from(notes.samples.max(1));
    Ok(found)
}

/// Who has stood for long, and what each of them waits for.
fn stuck(world: &World, notes: &Notes, ticks: u32) -> Vec<Stuck> {
    let held: BTreeMap<ActorId, Held> = world.held().collect();
    let frame = world.frame();
    let told = |(id, at): (&ActorId, &u32)| {
        let secs = (ticks - at) / TICKS_PER_SEC;
        let at_m = frame.actor(*id)?.world_from_actor.translation.vector;
        let agent = frame.agents.iter().find(|agent| agent.actor == *id && agent.driving);
        let (held, status) = (held.get(id).copied(), agent.map(|agent| agent.status));
        (secs >= STUCK_SECS).then_some(Stuck { id: *id, at_m, secs, held, status })
    };
    notes.moved_at.iter().filter_map(told).collect()
}

fn broken(world: &World) -> u32 {
    let all = |broken: &Broken| {
        broken.red_lights + broken.stop_signs + broken.right_of_way + broken.crossings
    };
    world.rules_broken().map(|(_, broken)| all(&broken)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_leaves_the_roads_of_our_towns_dry_or_wet() {
        let text = roads::town::build("Town02_Opt").unwrap();
        let map = Arc::new(Map::parse("Town02_Opt", &text).unwrap());
        for wet in [false, true] {
            for drivers in Drivers::ALL {
                let found = drive(&map, &Trial { drivers, count: 10, minutes: 1, wet }).unwrap();
                assert_eq!((found.vehicles, found.left, found.tipped), (10, 0, 0), "{found:?}");
                assert!(found.worst_m < LEFT_M && found.mean_mps > 0.5, "{found:?}");
            }
        }
    }
}
