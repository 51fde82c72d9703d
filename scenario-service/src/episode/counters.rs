//! What is counted over an episode, and the state object that reports it.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Map, Value};

use super::Episode;
use super::collisions::Hit;
use super::observation::{carla_location, sim_secs};
use crate::action::ActionKind;
use crate::scenario::Common;

/// Counts and sums over the steps of an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Counters {
    /// Every step message, pictures included.
    pub(crate) step_count: u64,
    /// Steps that let time pass.
    pub(crate) num_turns: u64,
    /// Per verb, pictures not counted.
    pub(crate) tool_call_counts: BTreeMap<&'static str, u64>,
    /// Metres between the ends of steps.
    pub(crate) total_distance_m: f32,
    /// Until the episode was over.
    pub(crate) total_reward: f64,
    /// Whether it ended by running out of steps.
    pub(crate) is_truncated: bool,
    speed_sum_kmh: f64,
    max_speed_kmh: f32,
}

impl Counters {
    pub(super) fn count_step(&mut self, kind: ActionKind) {
        self.step_count += 1;
        self.num_turns += 1;
        *self.tool_call_counts.entry(kind.as_str()).or_insert(0) += 1;
    }

    pub(super) fn count_capture(&mut self) {
        self.step_count += 1;
    }

    pub(super) fn note_distance(&mut self, distance_m: f32) {
        self.total_distance_m += distance_m;
    }

    /// At the end of a step.
    pub(super) fn note_speed(&mut self, speed_kmh: f32) {
        self.speed_sum_kmh += f64::from(speed_kmh);
        self.max_speed_kmh = self.max_speed_kmh.max(speed_kmh);
    }

    fn average_speed_kmh(&self) -> f64 {
        if self.num_turns == 0 { 0.0 } else { self.speed_sum_kmh / self.num_turns as f64 }
    }
}

/// The state object, in the reference order; what follows `scenario_data` is ours.
#[derive(Debug, Serialize)]
#[allow(missing_docs, reason = "the names are those of the specification, with its units")]
pub(crate) struct State<'a> {
    pub(crate) episode_id: Option<&'a str>,
    pub(crate) step_count: u64,
    pub(crate) scenario_name: &'a str,
    pub(crate) town: &'a str,
    pub(crate) weather: &'a str,
    pub(crate) total_distance: f32,
    pub(crate) total_reward: f64,
    pub(crate) simulation_time: f64,
    pub(crate) num_turns: u64,
    pub(crate) total_tool_calls: u64,
    pub(crate) tool_call_counts: BTreeMap<&'static str, u64>,
    pub(crate) is_truncated: bool,
    pub(crate) average_speed: f64,
    pub(crate) max_speed: f32,
    pub(crate) collisions: &'a [Hit],
    pub(crate) collisions_count: u32,
    pub(crate) collision_intensity_total: f32,
    pub(crate) scenario_data: Map<String, Value>,
    pub(crate) seed: Option<u64>,
    pub(crate) tick: u64,
    pub(crate) profile: &'static str,
    pub(crate) done: bool,
    pub(crate) red_lights_run: u32,
    pub(crate) stop_signs_run: u32,
    pub(crate) right_of_way_taken: u32,
    pub(crate) crossings_taken: u32,
}

pub(super) fn state(episode: &Episode) -> State<'_> {
    let counters = &episode.counters;
    let mut scenario_data = Map::new();
    if let Some(goal) = episode.start.scenario.goal_m() {
        scenario_data.insert("goal_location".to_owned(), carla_location(goal).as_slice().into());
    }
    scenario_data.insert("info".to_owned(), Value::Object(episode.info()));
    scenario_data.insert("outcome".to_owned(), Value::Object(episode.start.scenario.outcome()));
    State {
        episode_id: Some(&episode.start.episode_id),
        step_count: counters.step_count,
        scenario_name: &episode.common().name,
        town: &episode.frame.map.name,
        weather: &episode.start.weather_name,
        total_distance: counters.total_distance_m,
        total_reward: counters.total_reward,
        simulation_time: sim_secs(&episode.frame),
        num_turns: counters.num_turns,
        total_tool_calls: counters.num_turns,
        tool_call_counts: counters.tool_call_counts.clone(),
        is_truncated: counters.is_truncated,
        average_speed: counters.average_speed_kmh(),
        max_speed: counters.max_speed_kmh,
        collisions: episode.hits.list(),
        collisions_count: episode.hits.count(),
        collision_intensity_total: episode.hits.total_kmh(),
        scenario_data,
        seed: Some(episode.start.seed),
        tick: episode.frame.tick.0,
        profile: episode.common().profile.as_str(),
        done: episode.is_done(),
        red_lights_run: episode.broken.red_lights,
        stop_signs_run: episode.broken.stop_signs,
        right_of_way_taken: episode.broken.right_of_way,
        crossings_taken: episode.broken.crossings,
    }
}

/// The state before the first reset.
pub(crate) fn idle_state(common: &Common) -> State<'_> {
    State {
        episode_id: None,
        step_count: 0,
        scenario_name: &common.name,
        town: common.map_name(),
        weather: "ClearNoon",
        total_distance: 0.0,
        total_reward: 0.0,
        simulation_time: 0.0,
        num_turns: 0,
        total_tool_calls: 0,
        tool_call_counts: BTreeMap::new(),
        is_truncated: false,
        average_speed: 0.0,
        max_speed: 0.0,
        collisions: &[],
        collisions_count: 0,
        collision_intensity_total: 0.0,
        scenario_data: Map::new(),
        seed: None,
        tick: 0,
        profile: common.profile.as_str(),
        done: false,
        red_lights_run: 0,
        stop_signs_run: 0,
        right_of_way_taken: 0,
        crossings_taken: 0,
    }
}
