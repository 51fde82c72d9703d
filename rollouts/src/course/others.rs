//! Cars and people of a world's own: where they begin.

use blueprints::{Blueprint, Class, VehicleModel, WalkerModel};
use nalgebra::{Point3, RealField};
use roads::LaneTypes;
use roads::nav::NavMesh;
use schemas::{AgentBehaviour, Error, ErrorCode, Pose, SplitMix64, Vec3, level_pose};
use world::Town;

use super::{AgentStart, share, shuffle};
use crate::spec::Spec;
use crate::task::{Standing, Task, WayEnd};

/// Way between places at which a car may begin.
const PLACES_M: f32 = 20.0;
/// Cars begin farther than this from agents, and people from everybody with wheels.
const CAR_APART_M: f32 = 12.0;
const WALKER_APART_M: f32 = 4.0;
/// Cars that stand are left out where an agent is nearer.
const STANDING_APART_M: f32 = 6.0;
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
    within_m: f32,
    standing: Vec<Standing>,
    agents: usize,
}

/// Where a car of the world's own begins, at rest.
#[derive(Clone, Debug)]
pub(crate) struct CarStart {
    pub blueprint: &'static str,
    pub model: &'static VehicleModel,
    /// On the ground in the middle of its lane.
    pub pose: Pose,
    /// Of whoever drives it; `None`: nobody, it stands.
    pub behaviour: Option<AgentBehaviour>,
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
        Ok(Self {
            cars,
            walkers,
            lanes,
            within_m: task.others.within_m.unwrap_or(f32::INFINITY),
            standing: task.others.standing.clone(),
            agents: spec.agents,
        })
    }

    pub(super) fn count(&self) -> usize {
        self.cars + self.walkers + self.standing.len() * self.agents
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
        let begin = agents.iter().map(|agent| agent.pose.translation.vector);
        let begin: Vec<Vec3> = begin.collect();
        let mut cars = self.draw_standing(town, agents, random);
        let place = |car: &CarStart| car.pose.translation.vector;
        let mut taken: Vec<Vec3> = begin.iter().copied().chain(cars.iter().map(place)).collect();
        cars.extend(self.draw_cars(&begin, &taken, random));
        taken.extend(cars.iter().map(place));
        let walkers = town.nav().map(|mesh| self.draw_walkers(mesh, &taken, random));
        (cars, walkers.unwrap_or_default())
    }

    /// Those that stand beside the agents' ways, or on them.
    fn draw_standing(
        &self,
        town: &Town,
        agents: &[AgentStart],
        random: &mut SplitMix64,
    ) -> Vec<CarStart> {
        let models = car_models();
        let mut standing = Vec::new();
        for (agent, stands) in
            agents.iter().flat_map(|it| self.standing.iter().map(move |s| (it, s)))
        {
            let pose = stands_at(town, agent, stands, share(random));
            let Some(&(blueprint, model)) = random.choose(&models) else { continue };
            let free = |other: &AgentStart| {
                let away_m = (other.pose.translation.vector - pose.translation.vector).norm();
                away_m > STANDING_APART_M
            };
            if agents.iter().all(free) {
                standing.push(CarStart { blueprint, model, pose, behaviour: None });
            }
        }
        standing
    }

    fn draw_cars(&self, near: &[Vec3], taken: &[Vec3], random: &mut SplitMix64) -> Vec<CarStart> {
        let models = car_models();
        let mut places: Vec<Pose> = self.lanes.clone();
        shuffle(&mut places, random);
        let away_m = |pose: &Pose, other: &Vec3| (other - pose.translation.vector).norm();
        let free = |pose: &Pose| {
            taken.iter().all(|other| away_m(pose, other) > CAR_APART_M)
                && near.iter().any(|other| away_m(pose, other) <= self.within_m)
        };
        let free = places.into_iter().filter(free).take(self.cars);
        let start = |pose| {
            let (blueprint, model) = *random.choose(&models)?;
            let mixed = [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Normal];
            let behaviour = random.choose(&mixed).copied().unwrap_or_default();
            Some(CarStart { blueprint, model, pose, behaviour: Some(behaviour) })
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

/// The place of a car that stands: along the way from its start, straight on from its goal, and
/// straight back from its start.
fn stands_at(town: &Town, agent: &AgentStart, stands: &Standing, share: f32) -> Pose {
    let (near_m, far_m) = stands.ahead_m;
    let ahead_m = near_m + (far_m - near_m) * share;
    let route = &agent.route;
    let (at_m, beyond_m) = match stands.from {
        WayEnd::Start => (ahead_m.max(0.0), ahead_m.min(0.0)),
        WayEnd::Goal => (route.length_m(), ahead_m),
    };
    let (point, (cos, sin)) = (route.at(at_m), route.facing(at_m));
    let x_m = point.x_m + cos * beyond_m - sin * stands.left_m;
    let y_m = point.y_m + sin * beyond_m + cos * stands.left_m;
    let mut position_m = Vec3::new(x_m, y_m, agent.pose.translation.z);
    let map = town.roads();
    if let Some(lane) = map.nearest(Point3::from(position_m).cast(), LaneTypes::ANY) {
        position_m.z = map.pose(&lane).translation.z as f32;
    }
    level_pose(position_m, RealField::atan2(sin, cos))
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use roads::Map;

    use super::*;
    use crate::course::Course;

    #[test]
    fn cars_stand_as_far_ahead_or_behind_as_they_are_said_to() {
        let map = Map::parse("Town02", &roads::town::build("Town02").unwrap()).unwrap();
        let (task, town) = ("lane-keep".to_owned(), "Town02".to_owned());
        let course = Course::new(&Spec { task, town, ..Spec::default() }, Arc::new(map)).unwrap();
        let agent = &course.start(0).agents[0];
        let (begin, end) = (agent.route.at(0.0), agent.route.at(agent.route.length_m()));
        for (from, ahead_m, corner) in [
            (WayEnd::Start, -20.0, &begin),
            (WayEnd::Start, 0.0, &begin),
            (WayEnd::Goal, -20.0, &end),
            (WayEnd::Goal, 7.0, &end),
        ] {
            let stands = Standing { from, ahead_m: (ahead_m, ahead_m), left_m: 3.0 };
            let pose = stands_at(&course.town, agent, &stands, 0.5);
            let corner_m = Vec3::new(corner.x_m, corner.y_m, pose.translation.z);
            let away_m = pose.inverse_transform_point(&corner_m.into());
            let wanted_m = (-ahead_m, -3.0);
            let off_m = (away_m.x - wanted_m.0).hypot(away_m.y - wanted_m.1);
            assert!(off_m < 0.05, "{from:?}, {ahead_m} m: {away_m}");
        }
    }
}
