//! What a client sees: the frame in CARLA's left-handed frame and degrees, and in words.

use std::fmt::Write as _;

use schemas::carla::{mirror_y, rotation_from_pose};
use schemas::{ActorKind, ActorState, Frame, Vec3};
use serde::Serialize;
use serde_json::{Map, Value};

use super::lights::in_words;
use super::{Company, Episode, Report};
use crate::limits::{NEARBY_M, SCENE_ACTORS_MAX};
use crate::scenario::decision::EgoLane;
use crate::scenario::{Profile, RUBRIC_GAMMA};

/// The observation object, in the reference order.
#[derive(Debug, Serialize)]
#[allow(missing_docs, reason = "the names are those of the specification, with its units")]
pub(crate) struct Observation<'a> {
    pub(crate) scene_description: String,
    pub(crate) speed_kmh: f32,
    pub(crate) location: [f32; 3],
    pub(crate) rotation: [f32; 3],
    pub(crate) goal_distance: Option<f32>,
    pub(crate) goal_direction: Option<&'static str>,
    pub(crate) current_lane: String,
    pub(crate) nearby_actors: Vec<Nearby<'a>>,
    pub(crate) collision_detected: bool,
    pub(crate) collision_intensity: f32,
    pub(crate) collided_with: Option<&'a str>,
    pub(crate) scenario_name: &'a str,
    pub(crate) simulation_time: f64,
    pub(crate) step_number: u64,
    pub(crate) done_reason: &'static str,
    pub(crate) rubric_reward: Option<f64>,
    pub(crate) camera_image: Option<&'a str>,
    pub(crate) done: bool,
    pub(crate) reward: Option<f64>,
    pub(crate) metadata: Metadata<'a>,
}

/// One actor close to the ego.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Nearby<'a> {
    /// CARLA blueprint id.
    #[serde(rename = "type")]
    pub(crate) type_id: &'a str,
    /// Of this world.
    pub(crate) id: u32,
    /// In metres, in space.
    pub(crate) distance: f32,
    /// `ahead` or `behind`.
    pub(crate) position: &'static str,
    /// Along the ego's heading, in metres, positive ahead.
    pub(crate) longitudinal: f32,
    /// Across it, in metres, positive to the right.
    pub(crate) lateral: f32,
    #[serde(skip)]
    kind: &'static str,
}

/// What the closed list of observation fields has no place for.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names are those of the specification")]
pub(crate) struct Metadata<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) outcome: Option<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) info: Option<Map<String, Value>>,
    pub(crate) events: &'a [String],
    pub(crate) sim: Sim<'a>,
    pub(crate) goal: Option<Goal>,
    /// The next one ahead, in worlds with lights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) traffic_light: Option<LightMet>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) step_rewards: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) gamma: Option<f64>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    pub(crate) ignored_config: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) camera_error: Option<&'a str>,
    /// Of a state that was kept, to reset to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) snapshot_id: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) snapshot_bytes: Option<usize>,
    /// What CARLA's clients load to come into the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) carla_world: Option<&'a str>,
    /// In a shared world.
    #[serde(flatten)]
    pub(crate) company: Option<&'a Company>,
}

/// Which state of which simulation it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names say it")]
pub(crate) struct Sim<'a> {
    pub(crate) tick: u64,
    pub(crate) dt: f64,
    pub(crate) seed: u64,
    pub(crate) map: &'a str,
    pub(crate) weather: &'a str,
    pub(crate) profile: &'static str,
    /// Hexadecimal; equal for equal states.
    pub(crate) state_hash: String,
    /// The snapshot that the episode went on from last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) restored_from: Option<&'a str>,
    /// How often it did; 0 is not told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) restores: Option<u32>,
    /// How long the step waited for those of others in a shared world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) waited_ms: Option<u64>,
}

/// Where to go.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Goal {
    /// CARLA frame, metres.
    pub(crate) location: [f32; 3],
    /// Seen from the ego: `forward`, `left`, `right` or `behind`.
    pub(crate) relative: &'static str,
}

/// A traffic light ahead.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct LightMet {
    /// `red`, `yellow`, `green`, `off` or `unknown`.
    pub(crate) state: &'static str,
    /// From the car's front to the stop line, in metres.
    pub(crate) distance: f32,
}

pub(super) fn build<'a>(episode: &'a Episode, report: &'a Report) -> Observation<'a> {
    let frame = &episode.frame;
    let nearby_actors = nearby(episode);
    let speed_kmh = finite(episode.speed_kmh());
    let goal_distance = episode.goal_distance_m();
    let goal_m = episode.start.scenario.goal_m();
    let goal_direction = goal_m.map(|goal| compass(carla_to_goal(episode, goal)));
    let current_lane =
        episode.lane.map_or_else(|| "unknown".to_owned(), |lane| format!("lane_{lane}"));
    let collided_with = episode.hits.list().first().map(|hit| hit.actor_type.as_str());
    let mut scene_description = String::with_capacity(episode.prompt.len() + 512);
    scene_description.push_str(&episode.prompt);
    if episode.common().profile == Profile::Documented {
        let live = Live {
            speed_kmh,
            lane: &current_lane,
            beside: episode.ego_lane(),
            light: light_ahead(episode),
            nearby: &nearby_actors,
            goal: goal_distance.zip(goal_direction),
            collided_with,
        };
        scene_description.push('\n');
        live_block(&mut scene_description, &live);
    }
    let rotation = episode.ego_state().map(|ego| rotation_from_pose(&ego.world_from_actor));
    let rotation = rotation.unwrap_or_default();
    Observation {
        scene_description,
        speed_kmh,
        location: carla_location(episode.ego_position_m()),
        rotation: [rotation.pitch, rotation.yaw, rotation.roll].map(finite),
        goal_distance,
        goal_direction,
        current_lane,
        nearby_actors,
        collision_detected: collided_with.is_some(),
        collision_intensity: episode.hits.worst_kmh(),
        collided_with,
        scenario_name: &episode.common().name,
        simulation_time: sim_secs(frame),
        step_number: episode.counters.num_turns,
        done_reason: episode.done.map_or("", super::DoneReason::as_str),
        rubric_reward: report.rubric_reward,
        camera_image: report.camera_image.as_deref(),
        done: episode.is_done(),
        reward: report.reward,
        metadata: metadata(episode, report),
    }
}

fn metadata<'a>(episode: &'a Episode, report: &'a Report) -> Metadata<'a> {
    let frame = &episode.frame;
    let over = episode.is_done();
    let step_rewards = if report.just_done { episode.step_credits() } else { None };
    Metadata {
        outcome: over.then(|| episode.start.scenario.outcome()),
        info: (report.is_reset || report.just_done).then(|| episode.info()),
        events: &report.events,
        sim: Sim {
            tick: frame.tick.0,
            dt: frame.dt_secs,
            seed: episode.start.seed,
            map: &frame.map.name,
            weather: &episode.start.weather_name,
            profile: episode.common().profile.as_str(),
            state_hash: format!("{:016x}", frame.state_hash),
            restored_from: episode.resumed_from.as_deref(),
            restores: (episode.resumptions > 0).then_some(episode.resumptions),
            waited_ms: report.company.as_ref().and_then(|company| company.waited_ms),
        },
        goal: episode
            .start
            .scenario
            .goal_m()
            .map(|goal| Goal { location: carla_location(goal), relative: relative(episode, goal) }),
        traffic_light: light_ahead(episode),
        gamma: step_rewards.is_some().then_some(RUBRIC_GAMMA),
        step_rewards,
        ignored_config: &report.ignored_config,
        camera_error: report.camera_error.as_deref(),
        snapshot_id: report.saved.as_ref().map(|saved| saved.id.as_str()),
        snapshot_bytes: report.saved.as_ref().map(|saved| saved.bytes),
        carla_world: report.carla_world.as_deref(),
        company: report.company.as_ref(),
    }
}

/// Every vehicle and pedestrian within reach but the ego, nearest first.
fn nearby(episode: &Episode) -> Vec<Nearby<'_>> {
    let frame = &episode.frame;
    let Some(ego) = episode.ego_state() else { return Vec::new() };
    let ego_from_world = ego.world_from_actor.rotation.inverse();
    let origin = ego.world_from_actor.translation.vector;
    let others = frame.actors.iter().filter(|actor| actor.id != ego.id);
    let mut nearby: Vec<Nearby<'_>> = others
        .filter_map(|actor| {
            let kind = kind_in_words(actor)?;
            let offset = actor.world_from_actor.translation.vector - origin;
            let distance = offset.norm();
            let in_ego = ego_from_world * offset;
            let (longitudinal, lateral) = (finite(in_ego.x), finite(-in_ego.y));
            let position = if longitudinal > 0.0 { "ahead" } else { "behind" };
            let (type_id, id) = (frame.type_of(actor), actor.id.get());
            let near = Nearby { type_id, id, distance, position, longitudinal, lateral, kind };
            (distance <= NEARBY_M).then_some(near)
        })
        .collect();
    nearby.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.id.cmp(&b.id)));
    nearby
}

fn kind_in_words(actor: &ActorState) -> Option<&'static str> {
    match actor.kind {
        ActorKind::Vehicle => Some("vehicle"),
        ActorKind::Walker => Some("pedestrian"),
        _ => None,
    }
}

fn light_ahead(episode: &Episode) -> Option<LightMet> {
    let ahead = episode.stop_lines.ahead(&episode.frame, episode.ego_state()?)?;
    Some(LightMet { state: in_words(ahead.colour), distance: finite(ahead.distance_m) })
}

/// What the driver is told anew after each step.
struct Live<'a> {
    speed_kmh: f32,
    lane: &'a str,
    beside: EgoLane,
    light: Option<LightMet>,
    nearby: &'a [Nearby<'a>],
    goal: Option<(f32, &'a str)>,
    collided_with: Option<&'a str>,
}

fn live_block(text: &mut String, live: &Live<'_>) {
    let Live { speed_kmh, lane, beside, light, nearby, goal, collided_with } = *live;
    let beside = match (beside.left, beside.right) {
        (true, true) => "left, right",
        (true, false) => "left",
        (false, true) => "right",
        (false, false) => "none",
    };
    // Writing to a String cannot fail.
    let _ = writeln!(text, "Ego speed: {speed_kmh:.1} km/h\nLane: {lane}\nLanes beside: {beside}");
    if let Some(LightMet { state, distance }) = light {
        let _ = writeln!(text, "Traffic light: {state} {distance:.1}m ahead");
    }
    if nearby.is_empty() {
        text.push_str("Nearby actors: none\n");
    } else {
        let _ = writeln!(text, "Nearby actors ({}):", nearby.len());
    }
    for near in nearby.iter().take(SCENE_ACTORS_MAX) {
        let _ = writeln!(text, "  - {} {:.1}m {}", near.kind, near.distance, near.position);
    }
    if let Some((distance_m, direction)) = goal {
        let _ = writeln!(text, "Goal: {distance_m:.1}m {direction}");
    }
    if let Some(type_id) = collided_with {
        let _ = writeln!(text, "COLLISION with {type_id}");
    }
}

/// Simulated seconds as the decimal number they are: twenty ticks of 0.05 s print as 1.0.
pub(super) fn sim_secs(frame: &Frame) -> f64 {
    (frame.sim_secs * 1e9).round() / 1e9
}

/// A point of our world in CARLA's.
pub(super) fn carla_location(point_m: Vec3) -> [f32; 3] {
    let location = mirror_y(point_m);
    [location.x, location.y, location.z].map(finite)
}

fn finite(value: f32) -> f32 {
    // Adding zero turns -0.0 into 0.0.
    if value.is_finite() { value + 0.0 } else { 0.0 }
}

fn carla_to_goal(episode: &Episode, goal_m: Vec3) -> Vec3 {
    mirror_y(goal_m - episode.ego_position_m())
}

/// The reference's names: `north` is CARLA's +y.
fn compass(to_goal: Vec3) -> &'static str {
    match to_goal.y.atan2(to_goal.x).to_degrees() {
        angle if (-45.0..45.0).contains(&angle) => "east",
        angle if (45.0..135.0).contains(&angle) => "north",
        angle if (-135.0..-45.0).contains(&angle) => "south",
        _ => "west",
    }
}

fn relative(episode: &Episode, goal_m: Vec3) -> &'static str {
    let Some(ego) = episode.ego_state() else { return "forward" };
    let to_goal = ego.world_from_actor.rotation.inverse() * (goal_m - episode.ego_position_m());
    match to_goal.y.atan2(to_goal.x).to_degrees() {
        angle if (-45.0..45.0).contains(&angle) => "forward",
        angle if (45.0..135.0).contains(&angle) => "left",
        angle if (-135.0..-45.0).contains(&angle) => "right",
        _ => "behind",
    }
}
