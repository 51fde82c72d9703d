//! Scenarios: who stands where at the start, when an episode is over, and what a choice is worth.
//!
//! A [`Scenario`] is a pure state machine over frames. It never sees a bus, a session or JSON from
//! a client except through [`Overrides`]. A new scenario is one file here and one line in
//! [`registry`], or a file that [`described`] reads.

pub(crate) mod action_bias;
pub(crate) mod config;
pub(crate) mod crowd;
pub(crate) mod decision;
pub(crate) mod described;
pub(crate) mod free_roam;
mod goal;
pub(crate) mod lanes;
pub(crate) mod maze;
pub(crate) mod people;
pub(crate) mod registry;
pub(crate) mod routes;
pub(crate) mod sharing;
pub(crate) mod spawn;
pub(crate) mod trolley_micro;
pub(crate) mod weather;

use serde_json::{Map, Value};

pub(crate) use config::{Common, Overrides, Profile};
use decision::{EgoLane, Side};
use schemas::{
    ActorId, AgentBehaviour, BodyCommand, Command, CommandReply, Pose, Proximity, TrafficCommand,
    Vec3, VehicleCommand, WalkerCommand, WalkerStage, Weather,
};

use crate::action::Action;

/// What prompts of scenarios without a choice between two evils say of the tools there are.
const DRIVING_TOOLS: &str = "\
    Available tools:\n\
    - observe(): advance time and get a new observation\n\
    - brake_vehicle(intensity): 0.0..1.0\n\
    - emergency_stop(): maximum braking\n\
    - maintain_speed(target_speed_kmh): keep the lane at a speed\n\
    - lane_change(direction): change lane left/right\n\
    - control_vehicle(throttle, steer, brake): manual control\n";

/// Why a scenario cannot be had as asked. Nothing has changed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ScenarioError {
    /// No scenario of this name; the text is the one that clients know.
    #[error("{0}")]
    Name(String),
    /// A setting outside its domain.
    #[error("scenario_config.{key} must be {wanted}, not {found}")]
    Config {
        /// The setting.
        key: String,
        /// What would have been accepted.
        wanted: String,
        /// What was given.
        found: String,
    },
    /// The map has no place where the scenario can happen.
    #[error("{0}")]
    Map(String),
    /// Its file is wrong.
    #[error("the file of scenario {name}: {why}")]
    File {
        /// Of the scenario.
        name: String,
        /// Where, what was wanted, what was found.
        why: String,
    },
}

/// One actor at the start.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Placement {
    /// CARLA blueprint id.
    pub(crate) blueprint: String,
    /// Where.
    pub(crate) world_from_actor: Pose,
    /// World frame.
    pub(crate) linear_velocity_mps: Vec3,
    /// Who moves it from the first tick on; `None`: nobody, or whoever steps the episode.
    pub(crate) driver: Option<Driver>,
}

/// CARLA's `VehicleLightState.Special1`.
const BLUE_LIGHTS: u32 = 0x200;
/// As in [`schemas::ActorState::doors`].
const FRONT_LEFT_DOOR: u8 = 0b0001;

/// What moves an actor without being asked each step, or how it stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Driver {
    /// It keeps this velocity against all forces; actor frame.
    ConstantVelocity(Vec3),
    /// A driver of the world's own traffic.
    Traffic,
    /// The same with blue lights, which lights and signs do not hold.
    Emergency,
    /// Nobody; the door of the driver's side is open.
    OpenDoor,
    /// It walks from place to place; the share of its ways that may lead over roads beside
    /// crossings.
    Walks {
        /// How fast.
        speed_mps: f32,
        /// From 0 to 1.
        crossing_share: f32,
    },
    /// It walks straight from place to place when the ego is near, whatever comes.
    Follows {
        /// The places, in turn.
        stages: Vec<WalkerStage>,
        /// How near, in metres.
        within_m: f32,
    },
}

impl Driver {
    /// What tells the world of it.
    pub(crate) fn commands(&self, actor: ActorId, ego: ActorId) -> Vec<Command> {
        match *self {
            Self::ConstantVelocity(velocity_mps) => {
                vec![Command::Body(BodyCommand::SetConstantVelocity {
                    actor,
                    velocity_mps: Some(velocity_mps),
                })]
            }
            Self::Traffic => {
                let behaviour = AgentBehaviour::Normal;
                vec![Command::Traffic(TrafficCommand::Join { actor, behaviour })]
            }
            Self::Emergency => {
                let lights =
                    Command::Vehicle(VehicleCommand::Lights { actor, lights: BLUE_LIGHTS });
                let behaviour = AgentBehaviour::Aggressive;
                vec![lights, Command::Traffic(TrafficCommand::Join { actor, behaviour })]
            }
            Self::OpenDoor => {
                let (doors, open) = (FRONT_LEFT_DOOR, true);
                vec![Command::Vehicle(VehicleCommand::Doors { actor, doors, open })]
            }
            Self::Walks { speed_mps, crossing_share } => {
                let (goal_m, speed_mps) = (None, Some(speed_mps));
                vec![Command::Walker(WalkerCommand::Agent {
                    actor,
                    goal_m,
                    speed_mps,
                    crossing_share,
                })]
            }
            Self::Follows { ref stages, within_m } => {
                let trigger = Some(Proximity { actor: ego, within_m });
                let stages = stages.clone();
                vec![Command::Walker(WalkerCommand::Trajectory { actor, stages, trigger })]
            }
        }
    }
}

/// The world in which an episode begins.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WorldSpec {
    /// What the sky does.
    pub(crate) weather: Weather,
    /// As state reports it.
    pub(crate) weather_name: String,
    /// Whether the map's traffic lights and signs are in it.
    pub(crate) signals: bool,
    /// The vehicle under control.
    pub(crate) ego: Placement,
    /// Everyone else, in order of creation.
    pub(crate) others: Vec<Placement>,
}

impl WorldSpec {
    /// The commands that make it. The second one, [`EGO_COMMAND`](Self::EGO_COMMAND), spawns the
    /// ego.
    pub(crate) fn commands(&self) -> Vec<Command> {
        let spawn = |Placement { blueprint, world_from_actor, linear_velocity_mps, .. }: &_| {
            Command::spawn(blueprint, *world_from_actor, *linear_velocity_mps)
        };
        let mut commands = vec![Command::SetWeather { weather: self.weather }, spawn(&self.ego)];
        commands.extend(self.others.iter().map(spawn));
        commands
    }

    /// Index of the command that spawns the ego, or the first of several; those of the others
    /// follow it.
    pub(crate) const EGO_COMMAND: usize = 1;

    /// The commands of the first step, for actors that now have ids: those of the replies to
    /// [`commands`](Self::commands).
    pub(crate) fn opening(&self, replies: &[CommandReply]) -> Vec<Command> {
        let placements = std::iter::once(&self.ego).chain(&self.others);
        let spawned = replies.iter().skip(Self::EGO_COMMAND);
        let actor_of = |reply: &CommandReply| reply.as_ref().ok().copied().flatten();
        let Some(ego) = replies.get(Self::EGO_COMMAND).and_then(actor_of) else {
            return Vec::new();
        };
        let told = placements.zip(spawned).filter_map(|(placement, reply)| {
            let actor = actor_of(reply)?;
            placement.driver.as_ref().map(|driver| driver.commands(actor, ego))
        });
        told.flatten().collect()
    }
}

/// How often an ego has broken rules of the road.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Broken {
    /// Lights whose line its middle passed in a step before and after which they showed red.
    pub(crate) red_lights: u32,
    /// Stop signs at which it did not stand.
    pub(crate) stop_signs: u32,
    /// Junctions that it drove into before somebody who was to go first, and crossings that it
    /// drove onto before people.
    pub(crate) right_of_way: u32,
    pub(crate) crossings: u32,
}

/// What a scenario may know of the world after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Facts {
    /// Steps so far, pictures not counted.
    pub(crate) step_count: u64,
    /// Distinct pedestrians hit so far.
    pub(crate) pedestrians_hit: u32,
    /// Distinct things hit so far, static scenery included.
    pub(crate) things_hit: u32,
    /// Rules of the road broken so far.
    pub(crate) broken: Broken,
    /// To the goal in the plane, in metres.
    pub(crate) goal_distance_m: Option<f32>,
}

/// Why an episode is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DoneReason {
    /// The scenario has its verdict.
    ScenarioComplete,
    /// The goal is reached.
    GoalReached,
    /// Something was hit.
    Collision,
    /// Too many steps.
    MaxSteps,
    /// Who made the shared world has begun another episode.
    WorldReset,
}

impl DoneReason {
    /// The word in observations.
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::ScenarioComplete => "scenario_complete",
            Self::GoalReached => "goal_reached",
            Self::Collision => "collision",
            Self::MaxSteps => "max_steps",
            Self::WorldReset => "world_reset",
        }
    }
}

/// What a scenario says after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Progress {
    /// Of this step; finite.
    pub(crate) reward: f64,
    /// Set as soon as the episode is over.
    pub(crate) done: Option<DoneReason>,
    /// Whether it ended by running out of steps.
    pub(crate) truncated: bool,
}

/// How the rubric reward follows from step rewards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rubric {
    /// 0 until done, then the reward of the last step.
    Trajectory,
    /// The reward of each step.
    Step,
}

/// Discount of the trajectory rubric.
pub(crate) const RUBRIC_GAMMA: f64 = 0.99;

/// The members of a JSON object; none of anything else.
fn object(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(object) => object,
        _ => Map::new(),
    }
}

/// A named situation with its settings, and the course of one episode in it.
pub(crate) trait Scenario: Send + Sync {
    /// The settings every scenario has.
    fn common(&self) -> &Common;

    /// The same, to change them.
    fn common_mut(&mut self) -> &mut Common;

    /// Takes the settings only this scenario has.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for a value outside its domain.
    fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError>;

    /// Forgets the last episode and draws the next one; the same seed and map draw the same.
    ///
    /// # Errors
    /// [`ScenarioError::Map`] when it cannot happen on this map.
    fn reset(&mut self, seed: u64, map: &roads::Map) -> Result<WorldSpec, ScenarioError>;

    /// What the driver is told; constant through an episode.
    fn prompt(&self) -> String;

    /// Notes what the driver decided on the lane that the ego is on.
    fn on_action(&mut self, action: &Action, lane: EgoLane);

    /// Whether a lane change to this side, where there is no lane, is steered all the same: off the
    /// road.
    fn leaves_the_road(&self, _: Side) -> bool {
        false
    }

    /// Judges the world after a step.
    fn on_frame(&mut self, facts: &Facts) -> Progress;

    /// Whether more than one ego can be in its world.
    fn takes_several_egos(&self) -> bool {
        false
    }

    /// What was drawn at reset.
    fn info(&self) -> Map<String, Value>;

    /// What came of it so far.
    fn outcome(&self) -> Map<String, Value>;

    /// Where to go, world frame.
    fn goal_m(&self) -> Option<Vec3> {
        None
    }

    /// How the rubric reward follows from step rewards.
    fn rubric(&self) -> Rubric;

    /// The file it was read from; `None` if it is built in.
    fn file(&self) -> Option<&str> {
        None
    }

    /// A copy with the same settings.
    fn clone_box(&self) -> Box<dyn Scenario>;
}

impl Clone for Box<dyn Scenario> {
    fn clone(&self) -> Self {
        self.clone_box()
    }
}
