//! Free roam: drive to a goal somewhere on the map, with as much other traffic as asked for.

use std::slice;

use schemas::carla::mirror_y;
use schemas::{SplitMix64, Vec3};
use serde_json::{Map, Value, json};

use super::config::wrong;
use super::decision::EgoLane;
use super::lanes::Lanes;
use super::spawn::{self, Beside, Site, Wanted};
use super::{Broken, Common, DoneReason, Driver, Facts, Overrides, Profile, Progress, Rubric};
use super::{Scenario, ScenarioError, WorldSpec, crowd, object, routes};
use crate::action::Action;
use crate::limits::CROWD_MAX;
use crate::openenv::coerce::Bounds;

/// Lanes are followed this far in search of goals.
const ROUTE_M_MAX: f64 = 20_000.0;
/// What a broken rule of the road costs, where the reference server's rewards do not hold.
const PENALTY: f64 = 1.0;
/// Ordinary walking speed.
const WALK_MPS: f64 = 1.4;
/// Of a goal given from outside, in metres: within every map.
const COORDINATE_M_MAX: f64 = 100_000.0;

/// Drive somewhere.
#[derive(Clone, Debug)]
pub(crate) struct FreeRoam {
    common: Common,
    vehicles: u32,
    /// Besides the vehicles.
    emergency_vehicles: u32,
    parked_cars: u32,
    parked_behavior: Parked,
    pedestrians: u32,
    success_radius_m: f64,
    random_goal: bool,
    /// World frame.
    goal_m: Option<Vec3>,
    route_m_min: f64,
    route_m_max: f64,
    /// Whether the map's lights and signs are there.
    traffic_lights: bool,
    /// Taken off the reward of the step in which a red light or a stop sign is run, and in which
    /// the way of others who go first is taken, on wheels or on foot.
    red_light_penalty: f64,
    stop_sign_penalty: f64,
    right_of_way_penalty: f64,
    pedestrian_behavior: Pedestrians,
    pedestrian_speed_mps: f64,
    episode: Episode,
}

#[derive(Clone, Debug, Default)]
struct Episode {
    goal_m: Option<Vec3>,
    total_m: f64,
    /// Whether the goal is as far away as was asked for.
    fits: bool,
    distance_m: f64,
    spawned_vehicles: usize,
    spawned_parked: usize,
    spawned_pedestrians: usize,
    reached: bool,
    collided: bool,
    broken: Broken,
    reward: f64,
}

/// What pedestrians do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pedestrians {
    /// They stand.
    Static,
    /// They walk on sidewalks and over crossings.
    Walking,
    /// They cross roads anywhere.
    Crossing,
}

/// What parked cars do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Parked {
    /// They stand.
    Standing,
    /// They pull out when nobody comes, and drive.
    PullingOut,
    /// They stand with the door of the driver's side open.
    OpenDoor,
}

impl Parked {
    const ALL: [(&'static str, Self); 3] = [
        ("standing", Self::Standing),
        ("pulling_out", Self::PullingOut),
        ("open_door", Self::OpenDoor),
    ];

    fn driver(self) -> Option<Driver> {
        match self {
            Self::Standing => None,
            Self::PullingOut => Some(Driver::Traffic),
            Self::OpenDoor => Some(Driver::OpenDoor),
        }
    }
}

impl FreeRoam {
    /// The scenario with its defaults, on a map and with others as its name says.
    pub(crate) fn new(name: &str, map: Option<&str>, others: (u32, u32), profile: Profile) -> Self {
        let mut common = Common::new(name, profile);
        common.max_steps = 500;
        common.map_name = map.map(str::to_owned);
        let penalty = if profile == Profile::Documented { PENALTY } else { 0.0 };
        Self {
            common,
            vehicles: others.0,
            emergency_vehicles: 0,
            parked_cars: 0,
            parked_behavior: Parked::Standing,
            pedestrians: others.1,
            success_radius_m: 10.0,
            random_goal: true,
            goal_m: None,
            route_m_min: 100.0,
            route_m_max: 500.0,
            traffic_lights: true,
            red_light_penalty: penalty,
            stop_sign_penalty: penalty,
            right_of_way_penalty: penalty,
            pedestrian_behavior: match profile {
                Profile::Documented => Pedestrians::Walking,
                Profile::Literal => Pedestrians::Static,
            },
            pedestrian_speed_mps: WALK_MPS,
            episode: Episode::default(),
        }
    }

    /// What moves a pedestrian.
    fn walk(&self) -> Option<Driver> {
        let crossing_share = match self.pedestrian_behavior {
            Pedestrians::Static => return None,
            Pedestrians::Walking => 0.0,
            Pedestrians::Crossing => 1.0,
        };
        Some(Driver::Walks { speed_mps: self.pedestrian_speed_mps as f32, crossing_share })
    }

    /// Whether a goal so far away is as far as was asked for.
    fn fits(&self, away_m: f64) -> bool {
        (self.route_m_min..=self.route_m_max).contains(&away_m)
    }

    /// A spawn point at a fitting distance that lanes lead to; otherwise the farthest that they
    /// lead to.
    fn draw_goal(&self, lanes: Lanes<'_>, site: &Site, rng: &mut SplitMix64) -> Option<Vec3> {
        let reached = routes::reachable(lanes, site.place, ROUTE_M_MAX);
        let start_m = site.world_from_ego.translation.vector;
        let reachable = routes::pieces(&reached);
        let goals: Vec<(Vec3, f64)> = lanes
            .spawn_places()
            .filter(|place| reachable.leads_to(*place))
            .map(|place| lanes.pose(place).translation.vector)
            .map(|goal_m| (goal_m, f64::from((goal_m - start_m).xy().norm())))
            .collect();
        let fits = |(_, m): &&(Vec3, f64)| self.fits(*m);
        let fitting: Vec<_> = goals.iter().filter(fits).collect();
        let farthest = || goals.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        rng.choose(&fitting).copied().or_else(farthest).map(|(goal_m, _)| *goal_m)
    }
}

impl Scenario for FreeRoam {
    fn common(&self) -> &Common {
        &self.common
    }

    fn common_mut(&mut self) -> &mut Common {
        &mut self.common
    }

    fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError> {
        overrides.integer("num_npc_vehicles", &mut self.vehicles, 0, CROWD_MAX)?;
        overrides.integer("num_pedestrians", &mut self.pedestrians, 0, CROWD_MAX)?;
        overrides.integer("emergency_vehicles", &mut self.emergency_vehicles, 0, CROWD_MAX)?;
        overrides.integer("parked_cars", &mut self.parked_cars, 0, CROWD_MAX)?;
        if let Some(value) = overrides.take("parked_behavior") {
            let named = |(name, _): &(&str, Parked)| value.as_str() == Some(*name);
            let wanted = "\"standing\", \"pulling_out\" or \"open_door\"";
            let found = Parked::ALL.into_iter().find(named);
            self.parked_behavior = found.ok_or_else(|| wrong("parked_behavior", wanted, value))?.1;
        }
        let radii = Bounds { min: 0.5, max: 100.0 };
        overrides.number("success_radius", &mut self.success_radius_m, radii)?;
        overrides.boolean("random_goal", &mut self.random_goal)?;
        overrides.boolean("traffic_lights", &mut self.traffic_lights)?;
        let penalties = Bounds { min: 0.0, max: 100.0 };
        for (name, penalty) in [
            ("red_light_penalty", &mut self.red_light_penalty),
            ("stop_sign_penalty", &mut self.stop_sign_penalty),
            ("right_of_way_penalty", &mut self.right_of_way_penalty),
        ] {
            overrides.number(name, penalty, penalties)?;
        }
        if let Some(value) = overrides.take("pedestrian_behavior") {
            self.pedestrian_behavior = match value.as_str() {
                Some("static") => Pedestrians::Static,
                Some("walking") => Pedestrians::Walking,
                Some("crossing") => Pedestrians::Crossing,
                _ => {
                    let wanted = "\"static\", \"walking\" or \"crossing\"";
                    return Err(wrong("pedestrian_behavior", wanted, value));
                }
            };
        }
        let speeds = Bounds { min: 0.1, max: 5.0 };
        overrides.number("pedestrian_speed", &mut self.pedestrian_speed_mps, speeds)?;
        if let Some(value) = overrides.take("goal_location") {
            self.goal_m = goal_of(value)?;
        }
        let lengths = Bounds { min: 1.0, max: 100_000.0 };
        overrides.number("route_distance_min", &mut self.route_m_min, lengths)?;
        let lengths = Bounds { min: 1.0, max: 100_000.0 };
        overrides.number("route_distance_max", &mut self.route_m_max, lengths)?;
        if self.route_m_min > self.route_m_max {
            let found = json!(self.route_m_min);
            return Err(wrong("route_distance_min", "at most route_distance_max", &found));
        }
        Ok(())
    }

    fn reset(&mut self, seed: u64, map: &roads::Map) -> Result<WorldSpec, ScenarioError> {
        let mut rng = SplitMix64::new(seed);
        let lanes = Lanes::new(map);
        let wanted = Wanted {
            beside: Beside::NOTHING,
            beside_also_at_m: None,
            straight_m: spawn::STRAIGHT_M,
        };
        let site = spawn::choose(lanes, &wanted, &mut rng)
            .ok_or_else(|| ScenarioError::Map("this map has no place to start from".to_owned()))?;
        let given = self.goal_m.filter(|_| !self.random_goal);
        let goal_m = given.or_else(|| self.draw_goal(lanes, &site, &mut rng)).ok_or_else(|| {
            ScenarioError::Map("no lane of this map leads from the start to a goal".to_owned())
        })?;
        let (weather, weather_name) = self.common.weather.resolve(&mut rng);
        let ego = site.ego(&self.common);
        let urgent = self.emergency_vehicles;
        let mut others =
            crowd::cars(lanes, (self.vehicles + urgent, urgent), slice::from_ref(&ego), &mut rng);
        let spawned_vehicles = others.len();
        let drives = self.parked_behavior.driver();
        let parked =
            crowd::parked(map, self.parked_cars, (&ego, &others), drives.as_ref(), &mut rng);
        let spawned_parked = parked.len();
        others.extend(parked);
        let walk = self.walk();
        let on_foot = crowd::pedestrians(map, self.pedestrians, &others, walk.as_ref(), &mut rng);
        let spawned_pedestrians = on_foot.len();
        others.extend(on_foot);
        let total_m = (goal_m - site.world_from_ego.translation.vector).xy().norm();
        self.episode = Episode {
            goal_m: Some(goal_m),
            total_m: f64::from(total_m),
            fits: self.fits(f64::from(total_m)),
            distance_m: f64::from(total_m),
            spawned_vehicles,
            spawned_parked,
            spawned_pedestrians,
            ..Episode::default()
        };
        Ok(WorldSpec { weather, weather_name, signals: self.traffic_lights, ego, others })
    }

    fn prompt(&self) -> String {
        format!(
            "You control a vehicle in an open driving environment.\n\n\
             Goal: reach within {:?}m of the destination.\n\n\
             Available tools:\n\
             - observe(): get current state\n\
             - control_vehicle(throttle, steer, brake): manual control\n\
             - lane_change(direction): change lane left/right\n\
             - init_navigation_agent(behavior): start autopilot\n\
             - set_destination(x, y, z): set navigation goal\n\
             - follow_route(steps): follow planned route\n\
             - emergency_stop(): stop immediately\n",
            self.success_radius_m
        )
    }

    fn on_action(&mut self, _: &Action, _: EgoLane) {}

    /// Progress along the straight line, summing up to 1, an arrival of 10, a crash of 5 on every
    /// step after it, a broken rule of the road as much as it is set to cost, and a hundredth for
    /// every step.
    fn on_frame(&mut self, facts: &Facts) -> Progress {
        let episode = &mut self.episode;
        let before_m = episode.distance_m;
        episode.distance_m = facts.goal_distance_m.map_or(before_m, f64::from);
        episode.reached = episode.distance_m < self.success_radius_m;
        episode.collided = facts.things_hit > 0;
        let unit_m = if episode.total_m > 0.0 { episode.total_m } else { 1.0 };
        let mut reward = (before_m - episode.distance_m) / unit_m - 0.01;
        reward += if episode.reached { 10.0 } else { 0.0 };
        reward -= if episode.collided { 5.0 } else { 0.0 };
        let (now, then) = (&facts.broken, &episode.broken);
        for (all, before, penalty) in [
            (now.red_lights, then.red_lights, self.red_light_penalty),
            (now.stop_signs, then.stop_signs, self.stop_sign_penalty),
            (now.right_of_way, then.right_of_way, self.right_of_way_penalty),
            (now.crossings, then.crossings, self.right_of_way_penalty),
        ] {
            reward -= f64::from(all.saturating_sub(before)) * penalty;
        }
        episode.broken = facts.broken;
        episode.reward = reward;
        let out_of_steps = facts.step_count >= u64::from(self.common.max_steps);
        let done = match (episode.reached, episode.collided) {
            (true, _) => Some(DoneReason::GoalReached),
            (_, true) => Some(DoneReason::Collision),
            _ => out_of_steps.then_some(DoneReason::MaxSteps),
        };
        Progress { reward, done, truncated: done == Some(DoneReason::MaxSteps) }
    }

    fn takes_several_egos(&self) -> bool {
        true
    }

    fn info(&self) -> Map<String, Value> {
        object(json!({
            "scenario_type": "free_roam",
            "route_distance_total": self.episode.total_m,
            "route_distance_fits": self.episode.fits,
            "success_radius": self.success_radius_m,
            "spawned_npc_vehicles": self.episode.spawned_vehicles,
            "spawned_parked_cars": self.episode.spawned_parked,
            "spawned_pedestrians": self.episode.spawned_pedestrians,
        }))
    }

    fn outcome(&self) -> Map<String, Value> {
        object(json!({
            "scenario": self.common.name,
            "goal_reached": self.episode.reached,
            "goal_distance": self.episode.distance_m,
            "collision": self.episode.collided,
            "red_lights_run": self.episode.broken.red_lights,
            "stop_signs_run": self.episode.broken.stop_signs,
            "right_of_way_taken": self.episode.broken.right_of_way,
            "crossings_taken": self.episode.broken.crossings,
            "reward": self.episode.reward,
            "route_distance_total": self.episode.total_m,
            "route_distance_fits": self.episode.fits,
            "route_distance_remaining": self.episode.distance_m,
        }))
    }

    fn goal_m(&self) -> Option<Vec3> {
        self.episode.goal_m
    }

    fn rubric(&self) -> Rubric {
        Rubric::Step
    }

    fn clone_box(&self) -> Box<dyn Scenario> {
        Box::new(self.clone())
    }
}

/// `[x, y, z]` in CARLA's frame, or null.
fn goal_of(value: &Value) -> Result<Option<Vec3>, ScenarioError> {
    let number = |value: &Value| value.as_f64().filter(|m| m.abs() <= COORDINATE_M_MAX);
    let numbers = |list: &Vec<Value>| list.iter().map(number).collect::<Option<Vec<f64>>>();
    match value {
        Value::Null => Ok(None),
        Value::Array(list) => match numbers(list).as_deref() {
            Some([x, y, z]) => Ok(Some(mirror_y(Vec3::new(*x as f32, *y as f32, *z as f32)))),
            _ => Err(wrong("goal_location", "three numbers [x, y, z] in metres, or null", value)),
        },
        _ => Err(wrong("goal_location", "three numbers [x, y, z] in metres, or null", value)),
    }
}

#[cfg(test)]
mod tests;
