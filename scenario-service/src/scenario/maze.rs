//! The maze: nobody else on the road, a goal some corners away, and a limit of steps.

use schemas::{SplitMix64, Vec3};
use serde_json::{Map, Value, json};

use super::decision::EgoLane;
use super::goal::Goal;
use super::lanes::Lanes;
use super::spawn::{self, Beside, Site, Wanted};
use super::{Common, Facts, Overrides, Profile, Progress, Rubric, routes};
use super::{Scenario, ScenarioError, WorldSpec, object};
use crate::action::Action;
use crate::openenv::coerce::Bounds;
use crate::world_port::DT_SECS;

/// A goal may be this much nearer or farther than asked.
const GOAL_TOLERANCE_M: f64 = 5.0;
/// Turning in all that a way should have, two corners, or at least, one.
const TURNED_RAD: [f64; 3] = [2.6, 1.3, 0.0];
/// A way may be this many times as long as the straight line.
const DETOUR: f64 = 3.0;
/// Ticks of a step with which a client leaves the driving to an agent.
const TICKS_OF_A_STEP: f64 = 5.0;
/// A normal driver on an empty road is there within this part of all steps, if the map has such a
/// goal.
const IN_TIME: f64 = 0.8;
/// Starts that are tried for each of them.
const STARTS_MAX: usize = 16;

/// Find the way to a goal.
#[derive(Clone, Debug)]
pub(crate) struct Maze {
    common: Common,
    goal_distance_m: f64,
    success_radius_m: f64,
    /// Whether the map's lights and signs are there.
    traffic_lights: bool,
    episode: Episode,
}

#[derive(Clone, Debug, Default)]
struct Episode {
    goal: Goal,
    straight_m: f64,
    route_m: f64,
    drive_secs: f64,
    distance_m: Option<f32>,
}

impl Maze {
    /// The scenario with its defaults.
    pub(crate) fn new(name: &str, profile: Profile) -> Self {
        let mut common = Common::new(name, profile);
        common.max_steps = 200;
        Self {
            common,
            goal_distance_m: 150.0,
            success_radius_m: 5.0,
            traffic_lights: false,
            episode: Episode::default(),
        }
    }

    /// A place at the distance asked for whose way turns enough, and that distance.
    fn draw_goal(
        &self,
        lanes: Lanes<'_>,
        site: &Site,
        (turned_rad, within_secs): (f64, f64),
        rng: &mut SplitMix64,
    ) -> Option<(routes::Reached, f64)> {
        let start_m = site.world_from_ego.translation.vector;
        let reached = routes::reachable(lanes, site.place, self.goal_distance_m * DETOUR);
        let fits = |reached: &routes::Reached| {
            reached.turned_rad >= turned_rad && reached.drive_secs <= within_secs
        };
        let goals: Vec<_> = reached
            .into_iter()
            .filter(fits)
            .map(|goal| {
                let there_m = lanes.pose(goal.place).translation.vector;
                (goal, f64::from((there_m - start_m).xy().norm()))
            })
            .filter(|(_, m)| (m - self.goal_distance_m).abs() <= GOAL_TOLERANCE_M)
            .collect();
        rng.choose(&goals).copied()
    }
}

impl Scenario for Maze {
    fn common(&self) -> &Common {
        &self.common
    }

    fn common_mut(&mut self) -> &mut Common {
        &mut self.common
    }

    fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError> {
        let distances = Bounds { min: 20.0, max: 5_000.0 };
        overrides.number("goal_distance", &mut self.goal_distance_m, distances)?;
        let radii = Bounds { min: 0.5, max: 100.0 };
        overrides.number("success_radius", &mut self.success_radius_m, radii)?;
        overrides.boolean("traffic_lights", &mut self.traffic_lights)
    }

    fn reset(&mut self, seed: u64, map: &roads::Map) -> Result<WorldSpec, ScenarioError> {
        let mut rng = SplitMix64::new(seed);
        let lanes = Lanes::new(map);
        let wanted = Wanted {
            beside: Beside::NOTHING,
            beside_also_at_m: None,
            straight_m: spawn::STRAIGHT_M,
        };
        // To be there in time matters more than corners, and these more than the start: many starts
        // are tried before a straighter way will do.
        let steps_secs = f64::from(self.common.max_steps) * TICKS_OF_A_STEP * DT_SECS;
        let ways = [steps_secs * IN_TIME, f64::INFINITY]
            .into_iter()
            .flat_map(|secs| TURNED_RAD.map(|turned_rad| (turned_rad, secs)));
        for way in ways.flat_map(|way| [way; STARTS_MAX]) {
            let Some(site) = spawn::choose(lanes, &wanted, &mut rng) else { break };
            let Some((goal, straight_m)) = self.draw_goal(lanes, &site, way, &mut rng) else {
                continue;
            };
            let (weather, weather_name) = self.common.weather.resolve(&mut rng);
            self.episode = Episode {
                goal: Goal::at(lanes.pose(goal.place).translation.vector),
                straight_m,
                route_m: goal.route_m,
                drive_secs: goal.drive_secs,
                ..Episode::default()
            };
            let ego = site.ego(&self.common);
            let (signals, others) = (self.traffic_lights, Vec::new());
            return Ok(WorldSpec { weather, weather_name, signals, ego, others });
        }
        Err(ScenarioError::Map(format!(
            "no place of this map has a goal {} m away that its lanes lead to",
            self.goal_distance_m
        )))
    }

    fn prompt(&self) -> String {
        format!(
            "You control a vehicle in a maze.\n\n\
             Goal: reach within {:?}m of the destination.\n\n\
             Available tools:\n\
             - observe(): get current state\n\
             - control_vehicle(throttle, steer): manual control\n\
             - init_navigation_agent(behavior): start autopilot\n\
             - set_destination(x, y, z): set navigation goal\n\
             - follow_route(steps): follow planned route\n",
            self.success_radius_m
        )
    }

    fn on_action(&mut self, _: &Action, _: EgoLane) {}

    fn on_frame(&mut self, facts: &Facts) -> Progress {
        self.episode.distance_m = facts.goal_distance_m;
        self.episode.goal.judge(facts, self.success_radius_m, self.common.max_steps)
    }

    fn takes_several_egos(&self) -> bool {
        true
    }

    fn info(&self) -> Map<String, Value> {
        object(json!({
            "scenario_type": "maze",
            "goal_distance": self.episode.straight_m,
            "route_length": self.episode.route_m,
            "route_seconds": self.episode.drive_secs,
            "success_radius": self.success_radius_m,
        }))
    }

    fn outcome(&self) -> Map<String, Value> {
        let mut outcome = self.episode.goal.outcome(&self.common.name);
        outcome.insert("goal_distance".to_owned(), json!(self.episode.distance_m));
        outcome
    }

    fn goal_m(&self) -> Option<Vec3> {
        self.episode.goal.at_m
    }

    fn rubric(&self) -> Rubric {
        Rubric::Step
    }

    fn clone_box(&self) -> Box<dyn Scenario> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests;
