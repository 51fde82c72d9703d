//! Episodes in whose world several egos drive, each stepped by a session of its own.

use schemas::{ActorId, AgentBehaviour, Command, SplitMix64, TrafficCommand};
use schemas::{VehicleCommand, VehicleControl};
use serde_json::Value;

use super::config::wrong;
use super::{Overrides, Placement, Scenario, ScenarioError, WorldSpec};
use crate::limits::EGOS_MAX;
use crate::openenv::coerce::Bounds;

/// Between two egos, and an ego and others, at the start: half as far as cars of a queue need.
const APART_M: f32 = 12.0;
/// Places that are drawn for one ego until one is free.
const TRIES: usize = 64;

/// Who drives an ego that nobody steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Absent {
    /// It brakes and stands.
    #[default]
    Brake,
    /// A driver of the world's own traffic.
    Autopilot,
    /// It keeps its last control.
    Hold,
}

impl Absent {
    /// What tells the world so.
    pub(crate) fn commands(self, actor: ActorId) -> Option<Command> {
        match self {
            Self::Brake => {
                let control = VehicleControl { brake: 1.0, ..VehicleControl::default() };
                Some(Command::Vehicle(VehicleCommand::Control { actor, control }))
            }
            Self::Autopilot => {
                let behaviour = AgentBehaviour::Normal;
                Some(Command::Traffic(TrafficCommand::Join { actor, behaviour }))
            }
            Self::Hold => None,
        }
    }

    /// The word for it.
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::Brake => "brake",
            Self::Autopilot => "autopilot",
            Self::Hold => "hold",
        }
    }
}

/// How the world of an episode is shared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sharing {
    /// Egos; 1: it is not shared.
    pub(crate) egos: u32,
    /// How long the others wait for the step of one.
    pub(crate) lease_secs: f64,
    /// How long the first tick waits for egos that nobody has joined as.
    pub(crate) join_timeout_secs: f64,
    /// What those do that nobody steps.
    pub(crate) absent: Absent,
}

impl Default for Sharing {
    fn default() -> Self {
        Self { egos: 1, lease_secs: 30.0, join_timeout_secs: 60.0, absent: Absent::Brake }
    }
}

impl Sharing {
    /// Takes the settings of it.
    ///
    /// # Errors
    /// [`ScenarioError::Config`] for a value outside its domain.
    pub(crate) fn configure(&mut self, overrides: &mut Overrides<'_>) -> Result<(), ScenarioError> {
        overrides.integer("num_egos", &mut self.egos, 1, EGOS_MAX)?;
        let times = Bounds { min: 0.1, max: 3_600.0 };
        overrides.number("lease_secs", &mut self.lease_secs, times)?;
        overrides.number("join_timeout_secs", &mut self.join_timeout_secs, times)?;
        if let Some(value) = overrides.take("absent") {
            self.absent = match value {
                Value::String(word) if word == "brake" => Absent::Brake,
                Value::String(word) if word == "autopilot" => Absent::Autopilot,
                Value::String(word) if word == "hold" => Absent::Hold,
                other => return Err(wrong("absent", "brake, autopilot or hold", other)),
            };
        }
        Ok(())
    }
}

/// Puts the egos after the first one into the world, each drawn as if it were alone, at a place
/// that is free. Gives their scenarios; the commands that spawn them follow that of the first one.
///
/// # Errors
/// [`ScenarioError`] when this scenario has one ego only, or the map no more free places.
pub(crate) fn add_egos(
    spec: &mut WorldSpec,
    settings: &dyn Scenario,
    seed: u64,
    map: &roads::Map,
) -> Result<Vec<Box<dyn Scenario>>, ScenarioError> {
    let more = settings.common().sharing.egos as usize - 1;
    let only_one = match (settings.takes_several_egos(), settings.common().realtime) {
        (false, _) => Some("1 in this scenario; free_roam and maze_navigation take more"),
        // Whose time would it be?
        (true, true) => Some("1 where realtime is true"),
        (true, false) => None,
    };
    if let Some(wanted) = only_one.filter(|_| more > 0) {
        return Err(ScenarioError::Config {
            key: "num_egos".to_owned(),
            wanted: wanted.to_owned(),
            found: settings.common().sharing.egos.to_string(),
        });
    }
    let mut seeds = SplitMix64::new(!seed);
    let (mut scenarios, mut placements) = (Vec::new(), Vec::new());
    for _ in 0..more {
        let drawn = (0..TRIES).find_map(|_| {
            let mut scenario = settings.clone_box();
            let ego = scenario.reset(seeds.next_u64(), map).ok()?.ego;
            let mut taken = std::iter::once(&spec.ego).chain(&spec.others).chain(&placements);
            taken.all(|other| is_apart(&ego, other)).then_some((scenario, ego))
        });
        let Some((scenario, ego)) = drawn else {
            let text = format!("this map has no place for {} egos; ask for fewer", more + 1);
            return Err(ScenarioError::Map(text));
        };
        scenarios.push(scenario);
        placements.push(ego);
    }
    spec.others.splice(0..0, placements);
    Ok(scenarios)
}

fn is_apart(ego: &Placement, other: &Placement) -> bool {
    let way_m = ego.world_from_actor.translation.vector - other.world_from_actor.translation.vector;
    way_m.norm() >= APART_M
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::scenario::{Profile, registry};
    use crate::testing;

    fn configured(name: &str, settings: Value) -> Result<Box<dyn Scenario>, ScenarioError> {
        let mut scenario = registry::build(name, Profile::Documented)?;
        let values = settings.as_object().unwrap().clone();
        scenario.common_mut().configure(&mut Overrides::new(&values))?;
        Ok(scenario)
    }

    #[test]
    fn egos_stand_apart_from_each_other_and_from_everybody_and_have_goals_of_their_own() {
        let map = testing::map();
        let mut first = configured("free_roam", json!({ "num_egos": 8 })).unwrap();
        let mut spec = first.reset(5, &map).unwrap();
        let settings = configured("free_roam", json!({ "num_egos": 8 })).unwrap();
        let others = add_egos(&mut spec, settings.as_ref(), 5, &map).unwrap();
        assert_eq!(others.len(), 7);
        let all: Vec<_> = std::iter::once(&spec.ego).chain(&spec.others).collect();
        for (index, ego) in all[..8].iter().enumerate() {
            assert!(all[index + 1..].iter().all(|other| is_apart(ego, other)), "{index}");
        }
        let goals: Vec<_> = others.iter().map(|scenario| scenario.goal_m().unwrap()).collect();
        assert!(goals.iter().any(|goal| *goal != goals[0]));
        let mut again = first.reset(5, &map).unwrap();
        add_egos(&mut again, settings.as_ref(), 5, &map).unwrap();
        assert_eq!(again, spec);
    }

    #[test]
    fn who_cannot_share_says_so() {
        let map = testing::map();
        let mut trolley = configured("trolley_saves", json!({ "num_egos": 2 })).unwrap();
        let settings = trolley.clone_box();
        let mut spec = trolley.reset(1, &map).unwrap();
        let refused = add_egos(&mut spec, settings.as_ref(), 1, &map).err().unwrap().to_string();
        assert!(refused.contains("num_egos") && refused.contains("free_roam"), "{refused}");
        let mut free = configured("free_roam", json!({ "num_egos": 2, "realtime": true })).unwrap();
        let settings = free.clone_box();
        let mut spec = free.reset(1, &map).unwrap();
        let refused = add_egos(&mut spec, settings.as_ref(), 1, &map).err().unwrap().to_string();
        assert!(refused.contains("num_egos must be 1 where realtime is true"), "{refused}");
        for wrong in
            [json!({ "num_egos": 0 }), json!({ "absent": "fly" }), json!({ "num_egos": 65 })]
        {
            assert!(configured("free_roam", wrong.clone()).is_err(), "{wrong}");
        }
    }
}
