//! One episode: a pure state machine over frames.
//!
//! The caller asks for a [`Plan`], has the world carry it out, and hands back what came of it. A
//! plan changes nothing, so a step that fails on its way leaves the episode as it was.

mod camera;
mod collisions;
mod company;
mod counters;
mod lights;
mod navigation;
mod observation;
mod passing;
mod plan;

use std::sync::Arc;

use schemas::{
    ActorId, ActorState, Camera, Collision, Command, CommandReply, Frame, RulesBroken, SharedFrame,
    Vec3,
};
use serde_json::{Map, Value};

pub(crate) use collisions::Hits;
pub(crate) use company::{Company, Other};
pub(crate) use counters::{Counters, State, idle_state};
use lights::StopLines;
use navigation::Navigation;
pub(crate) use observation::{Metadata, Observation};
pub(crate) use plan::Plan;

use crate::action::Action;
use crate::scenario::decision::EgoLane;
use crate::scenario::lanes::{Lanes, Place};
use crate::scenario::{
    Broken, Common, DoneReason, Facts, RUBRIC_GAMMA, Rubric, Scenario, WorldSpec,
};

/// Everything an episode needs besides its first frame.
#[derive(Clone)]
pub(crate) struct Start {
    /// As state reports it.
    pub(crate) episode_id: String,
    /// Root of all its randomness.
    pub(crate) seed: u64,
    /// Where.
    pub(crate) map: Arc<roads::Map>,
    /// Already reset with the seed.
    pub(crate) scenario: Box<dyn Scenario>,
    /// As state reports it.
    pub(crate) weather_name: String,
    /// Settings that nobody knew.
    pub(crate) ignored_config: Vec<String>,
    /// Commands of the first step, before those of its action.
    pub(crate) opening: Vec<Command>,
}

/// What a client hears of a state that was kept.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SavedState {
    pub(crate) id: String,
    /// Of its world.
    pub(crate) bytes: usize,
}

/// What one request brought.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Report {
    /// Of the step; `None` at reset.
    pub(crate) reward: Option<f64>,
    /// `None` at reset and with pictures.
    pub(crate) rubric_reward: Option<f64>,
    /// What happened besides, in sentences.
    pub(crate) events: Vec<String>,
    /// Whether this begins the episode.
    pub(crate) is_reset: bool,
    /// Whether this ends it.
    pub(crate) just_done: bool,
    /// Settings that nobody knew.
    pub(crate) ignored_config: Vec<String>,
    /// Base64 of a JPEG.
    pub(crate) camera_image: Option<String>,
    /// Why there is no picture.
    pub(crate) camera_error: Option<String>,
    /// A state that was kept.
    pub(crate) saved: Option<SavedState>,
    /// Who else is in the world.
    pub(crate) company: Option<Company>,
    /// What CARLA's clients load to come into the world.
    pub(crate) carla_world: Option<String>,
}

/// One episode.
#[derive(Clone)]
pub(crate) struct Episode {
    start: Start,
    prompt: String,
    ego: ActorId,
    frame: SharedFrame,
    place: Option<Place>,
    lane: Option<u32>,
    /// None in a world without lights.
    stop_lines: StopLines,
    broken: Broken,
    hits: Hits,
    counters: Counters,
    done: Option<DoneReason>,
    last_reward: f64,
    last_rubric: f64,
    step_rewards: Vec<f64>,
    /// It hit something while nobody drove.
    is_too_late: bool,
    /// The state that it went on from last, and how often it did.
    resumed_from: Option<String>,
    resumptions: u32,
}

/// Rewards kept for the credit of single steps; longer episodes get none.
const STEP_REWARDS_MAX: usize = 1_000;

impl Episode {
    /// Begins with the first frame of its world for one of its egos, mostly the only one; `None` if
    /// it is not there.
    pub(crate) fn begin(
        start: Start,
        frame: SharedFrame,
        replies: &[CommandReply],
        number: usize,
    ) -> Option<(Self, Report)> {
        let reply = replies.get(WorldSpec::EGO_COMMAND + number)?;
        let ego = reply.as_ref().ok().copied().flatten()?;
        frame.actor(ego)?;
        let prompt = start.scenario.prompt();
        let has_lights = !frame.traffic_lights.is_empty();
        let stop_lines = if has_lights { StopLines::of(&start.map) } else { StopLines::default() };
        let mut episode = Self {
            start,
            prompt,
            ego,
            frame,
            place: None,
            lane: None,
            stop_lines,
            broken: Broken::default(),
            hits: Hits::default(),
            counters: Counters::default(),
            done: None,
            last_reward: 0.0,
            last_rubric: 0.0,
            step_rewards: Vec::new(),
            is_too_late: false,
            resumed_from: None,
            resumptions: 0,
        };
        episode.find_lane();
        let report = episode.opened();
        Some((episode, report))
    }

    /// Goes on under another id in a world that is as its own was.
    pub(crate) fn resume(&mut self, frame: SharedFrame, from: String, episode_id: String) {
        self.frame = frame;
        self.start.episode_id = episode_id;
        self.resumed_from = Some(from);
        self.resumptions += 1;
    }

    /// The same before its first step, in a world that has gone on meanwhile.
    pub(crate) fn at(&self, frame: SharedFrame) -> Self {
        let mut later = Self { frame, ..self.clone() };
        later.find_lane();
        later
    }

    /// Under another id.
    pub(crate) fn named(mut self, episode_id: String) -> Self {
        self.start.episode_id = episode_id;
        self
    }

    /// What begins it.
    pub(crate) fn opened(&self) -> Report {
        let ignored_config = self.start.ignored_config.clone();
        Report { is_reset: true, ignored_config, ..Report::default() }
    }

    /// Which actor it drives.
    pub(crate) fn ego(&self) -> ActorId {
        self.ego
    }

    /// It is over without a verdict, as its world is.
    pub(crate) fn end(&mut self, reason: DoneReason) -> Report {
        let just_done = self.done.is_none();
        self.done.get_or_insert(reason);
        self.counters.is_truncated |= just_done;
        Report { reward: Some(0.0), just_done, ..Report::default() }
    }

    /// Whether time goes on while no step is asked for.
    pub(crate) fn is_realtime(&self) -> bool {
        self.common().realtime
    }

    /// The present state of the world.
    pub(crate) fn frame(&self) -> &SharedFrame {
        &self.frame
    }

    /// Whether the scenario has its verdict.
    pub(crate) fn is_done(&self) -> bool {
        self.done.is_some()
    }

    /// What an action asks of the world; changes nothing.
    pub(crate) fn plan(&self, action: &Action) -> Plan {
        let lanes = Lanes::new(&self.start.map);
        let mut plan = plan::plan(
            action,
            self.ego,
            self.ego_state(),
            self.start.scenario.as_ref(),
            lanes,
            (self.place, self.lane),
        );
        let agent = self.frame.agents.iter().find(|agent| agent.actor == self.ego);
        let goal_m = self.start.scenario.goal_m();
        Navigation { ego: self.ego, agent, goal_m }.plan(action, &mut plan);
        if self.counters.num_turns == 0 {
            plan.commands.splice(0..0, self.start.opening.iter().cloned());
        }
        plan
    }

    /// The camera of a picture of the present frame.
    pub(crate) fn camera(&self) -> Camera {
        camera::front(self.ego, self.common())
    }

    /// Takes in what the world made of a plan.
    pub(crate) fn advance(
        &mut self,
        action: &Action,
        plan: Plan,
        frame: SharedFrame,
        replies: &[CommandReply],
        collisions: &[Collision],
    ) -> Report {
        let mut events = plan.events;
        for refusal in replies.iter().filter_map(|reply| reply.as_ref().err()) {
            events.push(format!("the world refused the action: {refusal}"));
        }
        let was_done = self.is_done();
        if !was_done && !self.is_too_late {
            self.start.scenario.on_action(action, self.ego_lane());
        }
        self.counters.count_step(action.kind);
        self.take_in(frame, plan.tick_count, collisions, &mut events);
        self.counters.note_speed(self.speed_kmh());
        self.judge(was_done);
        Report {
            reward: Some(self.last_reward),
            rubric_reward: Some(self.last_rubric),
            events,
            just_done: !was_done && self.is_done(),
            ..Report::default()
        }
    }

    /// Takes in a picture, or why there is none; no time passes.
    pub(crate) fn captured(&mut self, picture: Result<String, String>) -> Report {
        self.counters.count_capture();
        let (camera_image, camera_error) = match picture {
            Ok(image) => (Some(image), None),
            Err(error) => (None, Some(error)),
        };
        Report { reward: Some(0.0), camera_image, camera_error, ..Report::default() }
    }

    /// What the client sees after a request.
    pub(crate) fn observation<'a>(&'a self, report: &'a Report) -> Observation<'a> {
        observation::build(self, report)
    }

    /// What the client can ask about the episode at any time.
    pub(crate) fn state(&self) -> State<'_> {
        counters::state(self)
    }

    fn note_lights(&mut self, before: (&Frame, Vec3), events: &mut Vec<String>) {
        let Some(ego) = self.frame.actor(self.ego) else { return };
        let count = self.stop_lines.run(&self.start.map, before, (&self.frame, ego));
        if count > 0 {
            self.broken.red_lights += count;
            events.push("ran a red light".to_owned());
        }
    }

    /// Takes in which other rules the world says that the ego has broken since a frame.
    fn note_rules(&mut self, before: &Frame, events: &mut Vec<String>) {
        let Some(now) = self.frame.broken_by(self.ego) else { return };
        let then = before.broken_by(self.ego);
        let since = |of: fn(&RulesBroken) -> u32| of(now).saturating_sub(then.map_or(0, of));
        let broken = &mut self.broken;
        for (count, new, event) in [
            (&mut broken.stop_signs, since(|all| all.stop_signs), "ran a stop sign"),
            (&mut broken.right_of_way, since(|all| all.right_of_way), "took the right of way"),
            (&mut broken.crossings, since(|all| all.crossings), "did not let people cross"),
        ] {
            *count += new;
            if new > 0 {
                events.push(event.to_owned());
            }
        }
    }

    fn ego_lane(&self) -> EgoLane {
        let lanes = Lanes::new(&self.start.map);
        let left = self.place.and_then(|place| lanes.left(place)).is_some();
        let right = self.place.and_then(|place| lanes.right(place)).is_some();
        EgoLane { number: self.lane, left, right }
    }

    fn judge(&mut self, was_done: bool) {
        let facts = Facts {
            step_count: self.counters.num_turns,
            pedestrians_hit: self.hits.pedestrians(),
            things_hit: self.hits.count(),
            broken: self.broken,
            goal_distance_m: self.goal_distance_m(),
        };
        // After the end the scenario still counts what happens, but its verdict stands.
        let progress = self.start.scenario.on_frame(&facts);
        if was_done {
            return;
        }
        self.done = progress.done;
        self.counters.is_truncated |= progress.truncated;
        self.last_reward = if progress.reward.is_finite() { progress.reward } else { 0.0 };
        self.counters.total_reward += self.last_reward;
        if self.step_rewards.len() < STEP_REWARDS_MAX {
            self.step_rewards.push(self.last_reward);
        }
        self.last_rubric = match self.start.scenario.rubric() {
            Rubric::Step => self.last_reward,
            Rubric::Trajectory if self.is_done() => self.last_reward,
            Rubric::Trajectory => 0.0,
        };
    }

    /// What each step earned of the final reward, discounted to its time.
    fn step_credits(&self) -> Option<Vec<f64>> {
        let steps = self.step_rewards.len();
        let complete = u64::try_from(steps).ok() == Some(self.counters.num_turns);
        if self.start.scenario.rubric() != Rubric::Trajectory || !complete {
            return None;
        }
        let credit = |step: usize| RUBRIC_GAMMA.powi((steps - 1 - step) as i32) * self.last_reward;
        Some((0..steps).map(credit).collect())
    }

    fn find_lane(&mut self) {
        let lanes = Lanes::new(&self.start.map);
        self.place = lanes.under(self.ego_position_m());
        self.lane = self.place.map(|place| lanes.number(place));
    }

    fn common(&self) -> &Common {
        self.start.scenario.common()
    }

    /// The ego; it is in the first frame, and no command of an episode takes it out.
    fn ego_state(&self) -> Option<&ActorState> {
        self.frame.actor(self.ego)
    }

    fn ego_position_m(&self) -> Vec3 {
        self.ego_state().map_or_else(Vec3::zeros, |ego| ego.world_from_actor.translation.vector)
    }

    fn speed_kmh(&self) -> f32 {
        self.ego_state().map_or(0.0, |ego| schemas::carla::kmh(ego.linear_velocity_mps.norm()))
    }

    fn goal_distance_m(&self) -> Option<f32> {
        let to_goal = self.start.scenario.goal_m()? - self.ego_position_m();
        Some(to_goal.xy().norm())
    }

    fn info(&self) -> Map<String, Value> {
        self.start.scenario.info()
    }
}
