//! What a file of a scenario may say, and what is wrong with one that says something else.

use schemas::limits::WALKER_STAGES_MAX;
use serde::Deserialize;

use crate::limits::{CROWD_MAX, GROUP_MAX, PROMPT_CHARS_MAX};

/// A scenario as its file has it.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Description {
    /// For people.
    pub(super) description: String,
    /// What the driver is told; without it the goal, and which tools there are.
    pub(super) prompt: Option<String>,
    /// As `scenario_config`.
    pub(super) settings: toml::Table,
    pub(super) start: Start,
    pub(super) goal: Option<GoalAt>,
    pub(super) traffic: Traffic,
    pub(super) actors: Vec<Actor>,
    pub(super) reward: Reward,
    pub(super) end: End,
}

/// Where the ego begins: at a place of the map drawn by the seed, or at one.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Start {
    /// Straight road ahead, at least.
    pub(super) straight_m: f64,
    /// Lanes of the same direction that must lie beside the ego's.
    pub(super) lanes_beside: Vec<Neighbour>,
    /// The lane nearest to this place of CARLA's frame instead.
    pub(super) at: Option<[f64; 2]>,
    /// Whether the map's lights and signs are there.
    pub(super) traffic_lights: bool,
}

impl Default for Start {
    fn default() -> Self {
        let lanes_beside = Vec::new();
        Self { straight_m: 40.0, lanes_beside, at: None, traffic_lights: false }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Neighbour {
    Left,
    Right,
}

/// Where to go.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GoalAt {
    /// So far along the ego's lane.
    pub(super) ahead_m: Option<f64>,
    /// A place of CARLA's frame.
    pub(super) at: Option<[f64; 2]>,
    #[serde(default = "five_m")]
    pub(super) radius_m: f64,
}

fn five_m() -> f64 {
    5.0
}

/// Others whom nobody places.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Traffic {
    pub(super) vehicles: u32,
    /// Besides these.
    pub(super) emergency_vehicles: u32,
    pub(super) parked_cars: u32,
    pub(super) pedestrians: u32,
}

/// Somebody or something at a place.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Actor {
    /// Of CARLA's library; `vehicle.*` and `walker.pedestrian.*` are drawn by the seed.
    pub(super) blueprint: String,
    pub(super) ahead_m: Option<f64>,
    #[serde(default)]
    pub(super) right_m: f64,
    #[serde(default)]
    pub(super) lane: Lane,
    pub(super) at: Option<[f64; 2]>,
    /// Clockwise from the lane's traffic, or from x where the place is one of CARLA's frame.
    #[serde(default)]
    pub(super) heading_deg: f64,
    #[serde(default)]
    pub(super) speed_kmh: f64,
    #[serde(default)]
    pub(super) driver: DriverName,
    /// People who stand together.
    #[serde(default = "one")]
    pub(super) count: u32,
    /// Where somebody on foot goes in turn, straight, whatever comes.
    #[serde(default)]
    pub(super) walk: Vec<Stage>,
    /// How near the ego is when they set off.
    pub(super) when_within_m: Option<f64>,
}

fn one() -> u32 {
    1
}

/// A place that somebody on foot goes to.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stage {
    pub(super) ahead_m: Option<f64>,
    #[serde(default)]
    pub(super) right_m: f64,
    #[serde(default)]
    pub(super) lane: Lane,
    pub(super) at: Option<[f64; 2]>,
    #[serde(default = "walking")]
    pub(super) speed_mps: f64,
    /// Before they set off to it.
    #[serde(default)]
    pub(super) wait_secs: f64,
}

fn walking() -> f64 {
    1.4
}

/// From which lane a place is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Lane {
    /// The ego's.
    #[default]
    Own,
    Left,
    Right,
    /// The nearest one of the other direction.
    Oncoming,
}

/// Who drives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum DriverName {
    #[default]
    Nobody,
    Traffic,
    Emergency,
    OpenDoor,
    ConstantVelocity,
    /// On foot, from place to place.
    Wander,
}

/// What a step is worth, each term once for each event.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Reward {
    pub(super) goal: f64,
    /// For each thing that is hit, people too.
    pub(super) collision: f64,
    /// For each pedestrian that is hit, besides.
    pub(super) pedestrian: f64,
    /// For each metre nearer to the goal, in a straight line.
    pub(super) metre: f64,
    pub(super) step: f64,
    pub(super) red_light: f64,
    pub(super) stop_sign: f64,
    pub(super) right_of_way: f64,
    pub(super) crossing: f64,
}

impl Default for Reward {
    fn default() -> Self {
        Self {
            goal: 1.0,
            collision: -1.0,
            pedestrian: 0.0,
            metre: 0.0,
            step: 0.0,
            red_light: 0.0,
            stop_sign: 0.0,
            right_of_way: 0.0,
            crossing: 0.0,
        }
    }
}

/// What ends an episode before its last step.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct End {
    pub(super) goal: bool,
    pub(super) collision: bool,
}

impl Default for End {
    fn default() -> Self {
        Self { goal: true, collision: true }
    }
}

/// Of lengths along a lane, and of places of CARLA's frame.
const BEHIND_M_MAX: f64 = 200.0;
const AHEAD_M_MAX: f64 = 1_000.0;
const BESIDE_M_MAX: f64 = 100.0;
const COORDINATE_M_MAX: f64 = 100_000.0;
const REWARD_MAX: f64 = 1_000_000.0;

impl Description {
    /// Reads a file.
    ///
    /// # Errors
    /// Where something else was wanted, and what.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let read: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start].matches('\n').count() + 1);
            let message = error.message();
            line.map_or_else(|| message.to_owned(), |line| format!("line {line}: {message}"))
        })?;
        read.check()?;
        Ok(read)
    }

    fn check(&self) -> Result<(), String> {
        let told = self.prompt.as_deref().unwrap_or_default();
        for (what, text) in [("description", self.description.as_str()), ("prompt", told)] {
            let length = text.chars().count() as f64;
            within(what, length, 0.0, PROMPT_CHARS_MAX as f64, " characters")?;
        }
        within("start.straight_m", self.start.straight_m, 0.0, 500.0, "")?;
        coordinates("start", self.start.at)?;
        if let Some(goal) = &self.goal {
            place("goal", goal.ahead_m, goal.at, 0.0)?;
            within("goal.radius_m", goal.radius_m, 0.5, 100.0, "")?;
        }
        let Traffic { vehicles, emergency_vehicles, parked_cars, pedestrians } = self.traffic;
        for (what, count) in [
            ("traffic.vehicles", vehicles),
            ("traffic.emergency_vehicles", emergency_vehicles),
            ("traffic.parked_cars", parked_cars),
            ("traffic.pedestrians", pedestrians),
            ("the number of actors", self.actors.len() as u32),
        ] {
            within(what, f64::from(count), 0.0, f64::from(CROWD_MAX), "")?;
        }
        for (index, actor) in self.actors.iter().enumerate() {
            actor.check().map_err(|why| format!("actors[{index}] ({}): {why}", actor.blueprint))?;
        }
        self.reward.check()
    }
}

impl Actor {
    /// Whether it is somebody on foot.
    pub(super) fn walks(&self) -> bool {
        self.blueprint.starts_with("walker.")
    }

    fn check(&self) -> Result<(), String> {
        let drives = self.blueprint.starts_with("vehicle.");
        let stands = self.blueprint.starts_with("static.prop.");
        if self.blueprint.len() > 128 || !(self.walks() || drives || stands) {
            return Err("wanted a vehicle.…, walker.… or static.prop.…".to_owned());
        }
        place("it", self.ahead_m, self.at, self.right_m)?;
        within("heading_deg", self.heading_deg, -360.0, 360.0, "")?;
        within("speed_kmh", self.speed_kmh, 0.0, 200.0, "")?;
        within("count", f64::from(self.count), 1.0, f64::from(GROUP_MAX), "")?;
        within("when_within_m", self.when_within_m.unwrap_or(1.0), 0.0, AHEAD_M_MAX, "")?;
        let fits = match self.driver {
            DriverName::Nobody => true,
            DriverName::Wander => self.walks() && self.walk.is_empty(),
            DriverName::ConstantVelocity => drives || self.walks() && self.walk.is_empty(),
            DriverName::Traffic | DriverName::Emergency | DriverName::OpenDoor => drives,
        };
        let rules = [
            (
                fits,
                "this driver is not for it: vehicles take traffic, emergency, open_door and \
                 constant_velocity, walkers wander and constant_velocity, if they have no walk",
            ),
            (self.walk.is_empty() || self.walks(), "walk is for walkers"),
            (!self.walk.is_empty() || self.when_within_m.is_none(), "when_within_m needs a walk"),
            (
                self.count == 1 || self.walks() && self.walk.is_empty(),
                "count is for walkers who stand",
            ),
            (self.speed_kmh == 0.0 || !stands, "a prop has no speed"),
        ];
        if let Some((_, why)) = rules.into_iter().find(|(holds, _)| !holds) {
            return Err(why.to_owned());
        }
        let stages = self.walk.len() as f64;
        within("the number of places to walk to", stages, 0.0, WALKER_STAGES_MAX as f64, "")?;
        self.walk.iter().enumerate().try_for_each(|(index, stage)| {
            stage.check().map_err(|why| format!("walk[{index}]: {why}"))
        })
    }
}

impl Stage {
    fn check(&self) -> Result<(), String> {
        place("it", self.ahead_m, self.at, self.right_m)?;
        within("speed_mps", self.speed_mps, 0.1, 10.0, "")?;
        within("wait_secs", self.wait_secs, 0.0, 600.0, "")
    }
}

impl Reward {
    fn check(&self) -> Result<(), String> {
        for (what, value) in [
            ("goal", self.goal),
            ("collision", self.collision),
            ("pedestrian", self.pedestrian),
            ("metre", self.metre),
            ("step", self.step),
            ("red_light", self.red_light),
            ("stop_sign", self.stop_sign),
            ("right_of_way", self.right_of_way),
            ("crossing", self.crossing),
        ] {
            within(&format!("reward.{what}"), value, -REWARD_MAX, REWARD_MAX, "")?;
        }
        Ok(())
    }
}

/// Whether a place is said in one of two ways.
fn place(
    what: &str,
    ahead_m: Option<f64>,
    at: Option<[f64; 2]>,
    right_m: f64,
) -> Result<(), String> {
    if ahead_m.is_some() == at.is_some() {
        return Err(format!("{what} wants either ahead_m or at = [x, y]"));
    }
    within("ahead_m", ahead_m.unwrap_or_default(), -BEHIND_M_MAX, AHEAD_M_MAX, "")?;
    within("right_m", right_m, -BESIDE_M_MAX, BESIDE_M_MAX, "")?;
    coordinates(what, at)
}

fn coordinates(what: &str, at: Option<[f64; 2]>) -> Result<(), String> {
    let most_m = COORDINATE_M_MAX;
    at.into_iter()
        .flatten()
        .try_for_each(|m| within(&format!("at of {what}"), m, -most_m, most_m, ""))
}

fn within(what: &str, value: f64, least: f64, most: f64, unit: &str) -> Result<(), String> {
    // Not a number is within nothing.
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(format!("{what} must be from {least} to {most}{unit}, not {value}"))
}
