//! Cars and people of a world's own: where they begin.

use blueprints::{Blueprint, Class, VehicleModel, WalkerModel};
use roads::nav::NavMesh;
use schemas::{AgentBehaviour, Error, ErrorCode, Pose, SplitMix64, Vec3};
use world::Town;

use super::{AgentStart, shuffle};
use crate::spec::Spec;
use crate::task::Task;

/// Way between places at which a car may begin.
const PLACES_M: f32 = 20.0;
/// Cars begin farther than this from agents, and people from everybody with wheels.
const CAR_APART_M: f32 = 12.0;
const WALKER_APART_M: f32 = 4.0;
/// Places that are tried for each person.
const TRIES: usize = 10;
/// Share of people who may cross roads beside crossings.
const CROSSING_SHARE: f32 = 0.1;
/// Cars longer than this are left out, and those that have to be balanced.
const LENGTH_M_MAX: f32 = 5.6;
const WIDTH_M_MIN: f32 = 1.4;

/// Where cars may begin in a town, and how many of them and of people there are.
#[derive(Debug)]
pub(super) struct Places {
    cars: usize,
    walkers: usize,
    lanes: Vec<Pose>,
}

/// Where a car of the world's own traffic begins, at rest.
#[derive(Clone, Debug)]
pub(crate) struct CarStart {
    pub blueprint: &'static str,
    pub model: &'static VehicleModel,
    /// On the ground in the middle of its lane.
    pub pose: Pose,
    pub behaviour: AgentBehaviour,
}

/// Where a person begins, who then walks from place to place.
#[derive(Clone, Debug)]
pub(crate) struct WalkerStart {
    pub blueprint: &'static str,
    pub model: WalkerModel,
    pub foot_m: Vec3,
    pub speed_mps: f32,
    /// Share of ways that may lead over roads beside crossings.
    pub crossing_share: f32,
}

impl Places {
    /// # Errors
    /// `InvalidArgument` for a town without room for so many.
    pub(super) fn of(town: &Town, task: &Task, spec: &Spec) -> Result<Self, Error> {
        let name = &town.map_ref().name;
        let cars = spec.cars.unwrap_or(*task.others.cars.of(name));
        let walkers = spec.walkers.unwrap_or(*task.others.walkers.of(name));
        let lanes = if cars > 0 { town.network().places(PLACES_M) } else { Vec::new() };
        // Some of them may be too near to agents: their cars are left out.
        let most = lanes.len();
        if cars > most {
            return Err(Error::new(
                ErrorCode::InvalidArgument,
                "the town has no room for the cars",
            )
            .wanted(format!("at most {most} here"))
            .found(cars));
        }
        if walkers > 0 && town.nav().is_none() {
            return Err(Error::new(ErrorCode::InvalidArgument, "the town has nowhere to walk")
                .wanted("no walkers, or a map with sidewalks")
                .found(walkers));
        }
        Ok(Self { cars, walkers, lanes })
    }

    pub(super) fn count(&self) -> usize {
        self.cars + self.walkers
    }

    /// Cars and people of one start, away from its agents.
    pub(super) fn draw(
        &self,
        town: &Town,
        agents: &[AgentStart],
        random: &mut SplitMix64,
    ) -> (Vec<CarStart>, Vec<WalkerStart>) {
        if self.count() == 0 {
            return (Vec::new(), Vec::new());
        }
        let mut taken: Vec<Vec3> =
            agents.iter().map(|agent| agent.pose.translation.vector).collect();
        let cars = self.draw_cars(&taken, random);
        taken.extend(cars.iter().map(|car| car.pose.translation.vector));
        let walkers = town.nav().map(|mesh| self.draw_walkers(mesh, &taken, random));
        (cars, walkers.unwrap_or_default())
    }

    fn draw_cars(&self, taken: &[Vec3], random: &mut SplitMix64) -> Vec<CarStart> {
        let models = car_models();
        let mut places: Vec<Pose> = self.lanes.clone();
        shuffle(&mut places, random);
        let free = |pose: &Pose| {
            taken.iter().all(|other| (other - pose.translation.vector).norm() > CAR_APART_M)
        };
        let free = places.into_iter().filter(free).take(self.cars);
        let start = |pose| {
            let (blueprint, model) = *random.choose(&models)?;
            let mixed = [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Normal];
            let behaviour = random.choose(&mixed).copied().unwrap_or_default();
            Some(CarStart { blueprint, model, pose, behaviour })
        };
        free.filter_map(start).collect()
    }

    fn draw_walkers(
        &self,
        mesh: &NavMesh,
        taken: &[Vec3],
        random: &mut SplitMix64,
    ) -> Vec<WalkerStart> {
        let models = walker_models();
        let mut walkers: Vec<WalkerStart> = Vec::with_capacity(self.walkers);
        for _ in 0..self.walkers {
            let place = (0..TRIES).find_map(|_| {
                let foot_m = mesh.random_point(random.next_u64())?.coords.cast::<f32>();
                let apart = |other: &Vec3, least_m: f32| (other - foot_m).norm() > least_m;
                let free = taken.iter().all(|other| apart(other, WALKER_APART_M))
                    && walkers.iter().all(|other| apart(&other.foot_m, 1.0));
                free.then_some(foot_m)
            });
            let Some((foot_m, &(blueprint, model))) = place.zip(random.choose(&models)) else {
                continue;
            };
            let strays = random.next_u64() % 1_000 < (CROSSING_SHARE * 1_000.0) as u64;
            walkers.push(WalkerStart {
                blueprint,
                model,
                foot_m,
                speed_mps: model.walk_mps,
                crossing_share: f32::from(u8::from(strays)),
            });
        }
        walkers
    }
}

/// Cars with four wheels, in the order of the library.
fn car_models() -> Vec<(&'static str, &'static VehicleModel)> {
    let car = |blueprint: &'static Blueprint| match blueprint.class {
        Class::Vehicle(model) if model.length_m < LENGTH_M_MAX && model.width_m > WIDTH_M_MIN => {
            Some((blueprint.id.as_str(), model))
        }
        _ => None,
    };
    blueprints::all().iter().filter_map(car).collect()
}

/// People, in the order of the library.
fn walker_models() -> Vec<(&'static str, WalkerModel)> {
    let walker = |blueprint: &'static Blueprint| match blueprint.class {
        Class::Walker(model) if blueprint.listed => Some((blueprint.id.as_str(), model)),
        _ => None,
    };
    blueprints::all().iter().filter_map(walker).collect()
}
