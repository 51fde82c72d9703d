//! Worlds with drivers in them, and where those who have a destination go.

use std::sync::Arc;

use agents::Network;
use roads::Map;
use schemas::{
    ActorId, ActorKind, ActorState, AgentBehaviour, AgentCommand, AgentOptions, AgentStatus,
    Command, Error, ErrorCode, PilotMode, Pose, TrafficCommand, Vec3, VehicleCommand, Weather,
    WorldId,
};
use world::{Town, World, WorldConfig};

use super::{DT_SECS, Drivers, Trial};
use crate::Result;

/// Way between places at which vehicles are put.
const PLACES_M: f32 = 20.0;
/// Motorcycles and bicycles by turns.
const TWO_WHEELERS: [&str; 5] = [
    "vehicle.kawasaki.ninja",
    "vehicle.diamondback.century",
    "vehicle.vespa.zx125",
    "vehicle.gazelle.omafiets",
    "vehicle.harley-davidson.low_rider",
];
const CAR: &str = "vehicle.lincoln.mkz";
/// As fast as `maintain_speed` is asked to drive.
const PILOT_MPS: f32 = 50.0 / 3.6;
/// Places that are tried as destinations, and how far apart they are in the list.
const TRIES: usize = 8;
const STRIDE: usize = 37;

/// A world with its drivers.
pub(super) struct Stage {
    pub(super) world: World,
    pub(super) vehicles: u32,
    places: Vec<Pose>,
    /// Destinations given so far.
    sent: usize,
    drivers: Drivers,
}

impl Stage {
    /// A world with as many cars as there is room for; that of pilots has one, who begins at the
    /// place with this number.
    pub(super) fn new(map: &Arc<Map>, trial: &Trial, number: usize) -> Result<Self> {
        let internal = |text: &str| Error::new(ErrorCode::Internal, text);
        let id = WorldId::new(1).ok_or_else(|| internal("no world has the id 0"))?;
        let places = Network::new(map).places(PLACES_M);
        let map = Arc::new(Town::new(Arc::clone(map)));
        let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map };
        let mut world = World::with_traffic(config)?;
        if trial.wet {
            let weather = Weather { wetness_percent: 100.0, ..world.frame().weather };
            world.apply(&Command::SetWeather { weather })?;
        }
        let vehicles = match trial.drivers {
            Drivers::Riders => ride(&mut world, &places, trial.count)?,
            Drivers::Pilots => pilot(&mut world, &places, trial.count, number)?,
            Drivers::Traffic | Drivers::Agents | Drivers::Routes => {
                (1..=trial.count).rev().find(|count| {
                    let (count, behaviour) = (*count, None);
                    let spawn = TrafficCommand::Spawn { count, behaviour };
                    world.apply(&Command::Traffic(spawn)).is_ok()
                })
            }
        };
        let vehicles = vehicles.ok_or_else(|| {
            Error::new(ErrorCode::Unsupported, "the map has no lane with room for a car")
        })?;
        let mut stage = Self { world, vehicles, places, sent: 0, drivers: trial.drivers };
        if matches!(trial.drivers, Drivers::Agents | Drivers::Routes) {
            stage.hand_over()?;
        }
        Ok(stage)
    }

    /// Gives every vehicle a normal navigation agent.
    fn hand_over(&mut self) -> Result<()> {
        let of = |actor: &ActorState| (actor.kind == ActorKind::Vehicle).then_some(actor.id);
        let cars: Vec<ActorId> = self.world.frame().actors.iter().filter_map(of).collect();
        for actor in cars {
            let behaviour = AgentBehaviour::Normal;
            let options = AgentOptions { behaviour, ..AgentOptions::default() };
            let keep_route = false;
            self.world.apply(&Command::Agent(AgentCommand::Set { actor, options, keep_route }))?;
            self.world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true }))?;
        }
        Ok(())
    }

    /// Sends those who have no way to go to the next place that lanes lead to.
    pub(super) fn send(&mut self) -> Result<()> {
        if self.drivers != Drivers::Routes {
            return Ok(());
        }
        let waiting = self.world.frame().agents;
        for agent in waiting.iter().filter(|agent| agent.status != AgentStatus::OnRoute) {
            for _ in 0..TRIES {
                self.sent += 1;
                let Some(place) = self.places.get(self.sent * STRIDE % self.places.len()) else {
                    break;
                };
                let (actor, places_m) = (agent.actor, vec![place.translation.vector]);
                let route = Command::Agent(AgentCommand::SetRoute { actor, places_m });
                match self.world.apply(&route) {
                    Ok(_) => break,
                    Err(error) if error.code == ErrorCode::InvalidArgument => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(())
    }
}

/// Every so many places, so that `count` of them lie over all of the map.
fn spread(places: &[Pose], count: u32) -> impl Iterator<Item = &Pose> {
    let step = (places.len() / count.max(1) as usize).max(1);
    places.iter().step_by(step).take(count as usize)
}

/// Puts two-wheelers on places over all of the map; how many, if there was room for any.
fn ride(world: &mut World, places: &[Pose], count: u32) -> Result<Option<u32>> {
    let (mut rode, mut kinds) = (0, TWO_WHEELERS.iter().cycle());
    for pose in spread(places, count) {
        let kind = kinds.next().copied().unwrap_or(TWO_WHEELERS[0]);
        if let Some(actor) = put(world, kind, pose)? {
            let behaviour = AgentBehaviour::Normal;
            world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour }))?;
            rode += 1;
        }
    }
    Ok((rode > 0).then_some(rode))
}

/// Puts one car on one of `count` places over all of the map.
fn pilot(world: &mut World, places: &[Pose], count: u32, number: usize) -> Result<Option<u32>> {
    let Some(pose) = spread(places, count).nth(number) else { return Ok(None) };
    let Some(actor) = put(world, CAR, pose)? else { return Ok(None) };
    let (mode, target_speed_mps) = (PilotMode::KeepLane, Some(PILOT_MPS));
    let pilot = VehicleCommand::Pilot { actor, mode, target_speed_mps };
    world.apply(&Command::Vehicle(pilot))?;
    Ok(Some(1))
}

/// A vehicle at rest; `None` where there is no room for it.
fn put(world: &mut World, kind: &str, pose: &Pose) -> Result<Option<ActorId>> {
    match world.apply(&Command::spawn(kind, *pose, Vec3::zeros())) {
        Ok(actor) => Ok(actor),
        Err(error) if error.code == ErrorCode::SpawnBlocked => Ok(None),
        Err(error) => Err(error),
    }
}
