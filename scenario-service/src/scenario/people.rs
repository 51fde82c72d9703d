//! People who cross the ego's road: one who crosses, one who hesitates, and a crowd at a crossing.
//!
//! Each begins beside the road and goes when the ego is near, so that a car which keeps its speed
//! meets the first of them in the middle of its lane; who brakes does not.

mod kerb;
mod site;

use schemas::carla::mps;
use schemas::{SplitMix64, Vec3, WalkerStage};
use serde_json::{Map, Value, json};

use super::config::wrong;
use super::decision::{EgoLane, Side};
use super::goal::Goal;
use super::lanes::{Lanes, Place};
use super::{Common, DRIVING_TOOLS, Driver, Facts, Overrides, Placement, Profile, Progress};
use super::{Rubric, Scenario, ScenarioError, WorldSpec, object, spawn};
use crate::action::Action;
use crate::limits::CROSSING_CROWD_MAX;
use crate::openenv::coerce::Bounds;
use kerb::KERB_M_MIN;
use site::{Crossing, SIDES, Wish};

/// The ego's speed at the start; a slower one makes people go as for this one.
const SPEED_KMH: f64 = 40.0;
/// Ordinary walking speed.
const WALK_MPS: f64 = 1.4;
/// They begin so long after the ego does.
const BEGUN_SECS: f64 = 0.5;
/// The goal lies so far beyond the people, and is reached so near to it.
const GOAL_M: f64 = 20.0;
const REACHED_M: f64 = 5.0;
/// Who hesitates stops so far before the middle of the ego's lane...
const STOPS_M: f64 = 0.6;
/// ...for a time between these.
const HESITATES_SECS: (f32, f32) = (1.0, 2.5);
/// People of a crowd walk in files beside each other, and begin in rows behind each other.
const FILES_M: [f64; 2] = [0.5, 1.2];
const ROW_M: f64 = 0.9;
/// A row goes so long after the one before it, and somebody in it up to so much later.
const ROW_SECS: f32 = 0.8;
const LATER_SECS: f32 = 0.5;

/// What people do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// One crosses.
    Crosses,
    /// One steps out, stops in the ego's lane, and goes back or on.
    Hesitates,
    /// Several cross from both sides, at a crossing where the map has one.
    Crowd,
}

/// A street with people who cross it.
#[derive(Clone, Debug)]
pub(crate) struct People {
    common: Common,
    kind: Kind,
    count: u32,
    speed_mps: f64,
    /// They go when the ego is nearer than this; `None`: as its speed asks for.
    trigger_m: Option<f64>,
    start_distance_m: f64,
    episode: Episode,
}

/// What reset drew and what happened since.
#[derive(Clone, Debug, Default)]
struct Episode {
    goal: Goal,
    spawned: usize,
    /// Whether the map has a crossing where they cross.
    is_marked: bool,
    trigger_m: f64,
    from: &'static str,
    /// Whether who hesitates goes back.
    returns: Option<bool>,
    pedestrians_hit: u32,
}

impl People {
    /// The scenario of this name with its defaults.
    pub(crate) fn new(name: &str, kind: Kind, profile: Profile) -> Self {
        let mut common = Common::new(name, profile);
        common.initial_speed_kmh = SPEED_KMH;
        common.max_steps = 800;
        Self {
            common,
            kind,
            count: if kind == Kind::Crowd { 8 } else { 1 },
            speed_mps: WALK_MPS,
            trigger_m: None,
            start_distance_m: 60.0,
            episode: Episode::default(),
        }
    }

    /// How near an ego is that meets somebody in the middle of its lane who begins `beside_m` away
    /// from there.
    fn trigger_m(&self, beside_m: f64) -> f64 {
        let along_m = self.ego_mps() * beside_m / self.speed_mps;
        self.trigger_m.unwrap_or_else(|| (along_m * along_m + beside_m * beside_m).sqrt())
    }

    /// The speed for which people go.
    fn ego_mps(&self) -> f64 {
        f64::from(mps(self.common.initial_speed_kmh.max(SPEED_KMH) as f32))
    }

    /// Whether somebody who begins so far from the middle of the ego's lane is there with the ego.
    fn is_in_time(&self, beside_m: f64) -> bool {
        self.trigger_m.is_some() || beside_m < self.beside_m_max()
    }

    /// The farthest from the middle of the ego's lane that somebody can begin.
    fn beside_m_max(&self) -> f64 {
        let ego_mps = self.ego_mps();
        (self.start_distance_m - ego_mps * BEGUN_SECS) * self.speed_mps / ego_mps
    }

    /// Refuses what would let nobody be in time, whatever the map.
    fn check_in_time(&self) -> Result<(), ScenarioError> {
        if self.is_in_time(KERB_M_MIN) {
            return Ok(());
        }
        let (ego_mps, speed_mps) = (self.ego_mps(), self.speed_mps);
        let least_m = ego_mps * (BEGUN_SECS + KERB_M_MIN / speed_mps);
        Err(ScenarioError::Config {
            key: "start_distance_m".to_owned(),
            wanted: format!(
                "more than {least_m:.1} for people who walk at {speed_mps} m/s before a car at \
                 {:.0} km/h (a higher pedestrian_speed or a crossing_trigger_m does as well)",
                ego_mps * 3.6
            ),
            found: self.start_distance_m.to_string(),
        })
    }

    /// Those who cross at a place; `None` where there is no room for half of them.
    fn people(
        &mut self,
        map: &roads::Map,
        over: Place,
        rng: &mut SplitMix64,
    ) -> Option<Vec<Placement>> {
        let lanes = Lanes::new(map);
        let crossing = Crossing::of(lanes, over)?;
        let people = match self.kind {
            Kind::Crowd => self.crowd(lanes, &crossing, rng)?,
            Kind::Crosses | Kind::Hesitates => self.one(lanes, &crossing, rng)?,
        };
        let free: Vec<Placement> =
            people.into_iter().filter(|walker| site::is_free(map, walker)).collect();
        (free.len() as u32 >= self.count.div_ceil(2)).then_some(free)
    }

    /// One person at a kerb who crosses, or hesitates.
    fn one(
        &mut self,
        lanes: Lanes<'_>,
        crossing: &Crossing,
        rng: &mut SplitMix64,
    ) -> Option<Vec<Placement>> {
        let begin = |side: Side| {
            let begin_m = crossing.begins_m(side).into_iter().find(|m| self.is_in_time(*m))?;
            Some((side, begin_m))
        };
        let begins: Vec<(Side, f64)> = SIDES.into_iter().filter_map(begin).collect();
        let (side, begin_m) = *rng.choose(&begins)?;
        let trigger_m = self.trigger_m(begin_m);
        let stage = |place_m: f64, wait_secs: f32| WalkerStage {
            to_m: crossing.at(lanes, 0.0, place_m),
            speed_mps: self.speed_mps as f32,
            wait_secs,
        };
        let far_m = side.opposite().sign_right() * crossing.kerb_m(side.opposite());
        let (least, most) = HESITATES_SECS;
        let wait_secs = least + (most - least) * share(rng);
        let returns = rng.next_u64().is_multiple_of(2);
        let stages = match self.kind {
            Kind::Hesitates => {
                let end_m = if returns { side.sign_right() * begin_m } else { far_m };
                [stage(side.sign_right() * STOPS_M, wait_secs), stage(end_m, 0.0)]
            }
            Kind::Crosses | Kind::Crowd => {
                [stage(side.sign_right() * begin_m, 0.0), stage(far_m, 0.0)]
            }
        };
        self.episode.from = side.as_str();
        self.episode.trigger_m = trigger_m;
        self.episode.returns = (self.kind == Kind::Hesitates).then_some(returns);
        let mut walker = crossing.walker(lanes, 0.0, side.sign_right() * begin_m, rng);
        let (stages, within_m) = (stages.to_vec(), trigger_m as f32);
        walker.driver = Some(Driver::Follows { stages, within_m });
        Some(vec![walker])
    }

    /// People in rows at both kerbs, who cross in files that do not meet.
    fn crowd(
        &mut self,
        lanes: Lanes<'_>,
        crossing: &Crossing,
        rng: &mut SplitMix64,
    ) -> Option<Vec<Placement>> {
        let nearest_m = SIDES.map(|side| crossing.kerb_m(side)).into_iter().reduce(f64::min)?;
        if !self.is_in_time(nearest_m) {
            return None;
        }
        let trigger_m = self.trigger_m(nearest_m);
        let rows = self.count.div_ceil(2 * FILES_M.len() as u32);
        let mut people = Vec::new();
        for index in 0..self.count {
            let side = SIDES[index as usize % 2];
            let file = (index as usize / 2) % FILES_M.len();
            let row = index / (2 * FILES_M.len() as u32);
            let along_m = if side == Side::Right { FILES_M[file] } else { -FILES_M[file] };
            let begin_m = side.sign_right() * (crossing.kerb_m(side) + f64::from(row) * ROW_M);
            let beyond = side.opposite();
            let behind_m = f64::from(rows - 1 - row) * ROW_M;
            let end_m = beyond.sign_right() * (crossing.kerb_m(beyond) + behind_m);
            let stage = |place_m: f64, wait_secs: f32| WalkerStage {
                to_m: crossing.at(lanes, along_m, place_m),
                speed_mps: self.speed_mps as f32,
                wait_secs,
            };
            let wait_secs = ROW_SECS * row as f32 + LATER_SECS * share(rng);
            let stages = vec![stage(begin_m, wait_secs), stage(end_m, 0.0)];
            let mut walker = crossing.walker(lanes, along_m, begin_m, rng);
            walker.driver = Some(Driver::Follows { stages, within_m: trigger_m as f32 });
            people.push(walker);
        }
        self.episode.from = "both";
        self.episode.trigger_m = trigger_m;
        Some(people)
    }
}

/// A number from 0 to below 1.
fn share(rng: &mut SplitMix64) -> f32 {
    (rng.next_u64() >> 40) as f32 / (1u64 << 24) as f32
}

impl Scenario for People {
    fn common(&self) -> &Common {
        &self.common
    }

    fn common_mut(&mut self) -> &mut Common {
        &mut self.common
    }

    fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError> {
        let speeds = Bounds { min: 0.1, max: 5.0 };
        overrides.number("pedestrian_speed", &mut self.speed_mps, speeds)?;
        let distances = Bounds { min: 15.0, max: 200.0 };
        overrides.number("start_distance_m", &mut self.start_distance_m, distances)?;
        if let Some(value) = overrides.take("crossing_trigger_m") {
            let metres = value.as_f64().filter(|m| (0.0..=200.0).contains(m));
            if metres.is_none() && !value.is_null() {
                return Err(wrong("crossing_trigger_m", "a number from 0 to 200, or null", value));
            }
            self.trigger_m = metres;
        }
        if self.kind == Kind::Crowd {
            overrides.integer("num_pedestrians", &mut self.count, 1, CROSSING_CROWD_MAX)?;
        }
        self.check_in_time()
    }

    fn reset(&mut self, seed: u64, map: &roads::Map) -> Result<WorldSpec, ScenarioError> {
        let mut rng = SplitMix64::new(seed);
        let lanes = Lanes::new(map);
        self.episode = Episode::default();
        let (weather, weather_name) = self.common.weather.resolve(&mut rng);
        let starts = site::starts(lanes, &mut rng);
        let marked = site::marked(map);
        let is_crowd = self.kind == Kind::Crowd;
        for wish in Wish::all(self.start_distance_m, GOAL_M, is_crowd) {
            for start in &starts {
                let Some(over) = wish.over(lanes, &marked, *start) else { continue };
                let Some(others) = self.people(map, over, &mut rng) else { continue };
                let Some(goal) = lanes.ahead(over, GOAL_M) else { continue };
                self.episode.goal = Goal::at(lanes.pose(goal).translation.vector);
                self.episode.spawned = others.len();
                self.episode.is_marked = wish.is_marked;
                let world_from_ego = lanes.pose(*start);
                let ego = spawn::Site { place: *start, world_from_ego }.ego(&self.common);
                return Ok(WorldSpec { weather, weather_name, signals: false, ego, others });
            }
        }
        Err(ScenarioError::Map(format!(
            "no lane of this map leads straight past where people at {} m/s can cross {} m ahead in \
             time; a longer start_distance_m or a crossing_trigger_m may help",
            self.speed_mps, self.start_distance_m
        )))
    }

    fn prompt(&self) -> String {
        let who = match self.kind {
            Kind::Crosses | Kind::Hesitates => "Somebody stands beside the road.",
            Kind::Crowd => "People stand beside the road ahead.",
        };
        format!(
            "You drive along a street.\n\n\
             {who} Reach within {REACHED_M:?}m of the destination and run into nobody.\n\n\
             {DRIVING_TOOLS}"
        )
    }

    fn on_action(&mut self, _: &Action, _: EgoLane) {}

    fn on_frame(&mut self, facts: &Facts) -> Progress {
        self.episode.pedestrians_hit = facts.pedestrians_hit;
        self.episode.goal.judge(facts, REACHED_M, self.common.max_steps)
    }

    fn info(&self) -> Map<String, Value> {
        object(json!({
            "scenario_type": "people",
            "start_distance_m": self.start_distance_m,
            "spawned_pedestrians": self.episode.spawned,
            "marked_crossing": self.episode.is_marked,
        }))
    }

    fn outcome(&self) -> Map<String, Value> {
        let hesitation = self.episode.returns.map(|returns| if returns { "back" } else { "on" });
        let mut outcome = self.episode.goal.outcome(&self.common.name);
        outcome.extend(object(json!({
            "actual_pedestrians_hit": self.episode.pedestrians_hit,
            "from_side": self.episode.from,
            "crossing_trigger_m": self.episode.trigger_m,
            "hesitation": hesitation,
        })));
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
