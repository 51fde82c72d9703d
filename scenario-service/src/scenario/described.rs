//! A scenario that a file describes: who stands and moves where, the goal, and what is worth what.
//! [`text`] is what a file may say, [`staging`] puts it on a map.

mod staging;
mod text;

use std::sync::Arc;

use schemas::{SplitMix64, Vec3};
use serde_json::{Map, Value, json};

use super::decision::EgoLane;
use super::{Broken, Common, DRIVING_TOOLS, DoneReason, Facts, Overrides, Profile, Progress};
use super::{Rubric, Scenario, ScenarioError, WorldSpec, object};
use crate::action::Action;
use text::Description;

/// What a file describes.
#[derive(Clone, Debug)]
pub(crate) struct Described {
    common: Common,
    file: Arc<str>,
    text: Description,
    episode: Episode,
}

#[derive(Clone, Debug, Default)]
struct Episode {
    goal_m: Option<Vec3>,
    /// Of those that the file places, and of traffic.
    spawned: usize,
    distance_m: Option<f64>,
    things_hit: u32,
    pedestrians_hit: u32,
    broken: Broken,
    reached: bool,
    reward: f64,
}

impl Described {
    /// Reads the file of a scenario of this name.
    ///
    /// # Errors
    /// [`ScenarioError::File`]: what is wrong with it.
    pub(crate) fn parse(name: &str, profile: Profile, file: &str) -> Result<Self, ScenarioError> {
        let wrong = |why: String| ScenarioError::File { name: name.to_owned(), why };
        let text = Description::parse(file).map_err(wrong)?;
        let mut common = Common::new(name, profile);
        common.description.clone_from(&text.description);
        let settings = serde_json::to_value(&text.settings).unwrap_or_default();
        let settings = object(settings);
        let mut overrides = Overrides::new(&settings);
        common.configure(&mut overrides).map_err(|why| wrong(why.to_string()))?;
        if let Some(key) = overrides.ignored().first() {
            return Err(wrong(format!("settings has no {key} that all scenarios have")));
        }
        Ok(Self { common, file: file.into(), text, episode: Episode::default() })
    }
}

impl Scenario for Described {
    fn common(&self) -> &Common {
        &self.common
    }

    fn common_mut(&mut self) -> &mut Common {
        &mut self.common
    }

    fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError> {
        overrides.boolean("traffic_lights", &mut self.text.start.traffic_lights)
    }

    fn reset(&mut self, seed: u64, map: &roads::Map) -> Result<WorldSpec, ScenarioError> {
        let mut rng = SplitMix64::new(seed);
        let (weather, weather_name) = self.common.weather.resolve(&mut rng);
        let staged = staging::stage(&self.text, &self.common, map, &mut rng)?;
        let start_m = staged.ego.world_from_actor.translation.vector;
        let away = |goal_m: Vec3| f64::from((goal_m - start_m).xy().norm());
        self.episode = Episode {
            goal_m: staged.goal_m,
            spawned: staged.others.len(),
            distance_m: staged.goal_m.map(away),
            ..Episode::default()
        };
        let (signals, ego, others) = (self.text.start.traffic_lights, staged.ego, staged.others);
        Ok(WorldSpec { weather, weather_name, signals, ego, others })
    }

    fn prompt(&self) -> String {
        if let Some(prompt) = &self.text.prompt {
            return prompt.clone();
        }
        let goal = self.text.goal.as_ref().map_or_else(String::new, |goal| {
            format!("Goal: reach within {:?}m of the destination.\n\n", goal.radius_m)
        });
        format!(
            "You drive a car.\n\n\
             {goal}{DRIVING_TOOLS}"
        )
    }

    fn on_action(&mut self, _: &Action, _: EgoLane) {}

    fn on_frame(&mut self, facts: &Facts) -> Progress {
        let (episode, worth) = (&mut self.episode, &self.text.reward);
        let radius_m = self.text.goal.as_ref().map_or(0.0, |goal| goal.radius_m);
        let now_m = facts.goal_distance_m.map(f64::from);
        let won_m = episode.distance_m.zip(now_m).map_or(0.0, |(before_m, now_m)| before_m - now_m);
        let was_reached = episode.reached;
        episode.reached |= now_m.is_some_and(|m| m < radius_m);
        let more = |now: u32, before: u32| f64::from(now.saturating_sub(before));
        let (now, before) = (&facts.broken, &episode.broken);
        let reward = worth.step
            + worth.metre * won_m
            + worth.goal * f64::from(u8::from(episode.reached && !was_reached))
            + worth.collision * more(facts.things_hit, episode.things_hit)
            + worth.pedestrian * more(facts.pedestrians_hit, episode.pedestrians_hit)
            + worth.red_light * more(now.red_lights, before.red_lights)
            + worth.stop_sign * more(now.stop_signs, before.stop_signs)
            + worth.right_of_way * more(now.right_of_way, before.right_of_way)
            + worth.crossing * more(now.crossings, before.crossings);
        episode.distance_m = now_m.or(episode.distance_m);
        episode.things_hit = facts.things_hit;
        episode.pedestrians_hit = facts.pedestrians_hit;
        episode.broken = facts.broken;
        episode.reward += reward;
        let collided = self.text.end.collision && facts.things_hit > 0;
        let arrived = self.text.end.goal && episode.reached;
        let done = match (collided, arrived) {
            (true, _) => Some(DoneReason::Collision),
            (_, true) => Some(DoneReason::GoalReached),
            _ if facts.step_count >= u64::from(self.common.max_steps) => Some(DoneReason::MaxSteps),
            _ => None,
        };
        Progress { reward, done, truncated: done == Some(DoneReason::MaxSteps) }
    }

    fn info(&self) -> Map<String, Value> {
        object(json!({
            "scenario_type": "file",
            "description": self.common.description,
            "spawned_actors": self.episode.spawned,
        }))
    }

    fn outcome(&self) -> Map<String, Value> {
        let episode = &self.episode;
        object(json!({
            "scenario": self.common.name,
            "goal_reached": episode.reached,
            "goal_distance": episode.distance_m,
            "collision": episode.things_hit > 0,
            "actual_pedestrians_hit": episode.pedestrians_hit,
            "red_lights_run": episode.broken.red_lights,
            "stop_signs_run": episode.broken.stop_signs,
            "right_of_way_taken": episode.broken.right_of_way,
            "crossings_taken": episode.broken.crossings,
            "reward": episode.reward,
        }))
    }

    fn goal_m(&self) -> Option<Vec3> {
        self.episode.goal_m
    }

    fn rubric(&self) -> Rubric {
        Rubric::Step
    }

    fn file(&self) -> Option<&str> {
        Some(&self.file)
    }

    fn clone_box(&self) -> Box<dyn Scenario> {
        Box::new(self.clone())
    }
}

#[cfg(test)]
mod tests;
