//! What the lights show: a cycle per group; and which lights and signs are there.
//!
//! The controllers of a group take turns. In its turn a controller's lights show green, then
//! yellow, then red, while all others stay red. Times belong to controllers.

use schemas::{ActorId, TrafficLightColour as Colour, TrafficLightState};
use serde::{Deserialize, Serialize};

use super::TrafficPlan;

/// How much too early a change may come, so that steps of 0.05 s sum up to 10 s, in seconds.
const EARLY_SECS: f64 = 1.0e-6;

/// The state of all lights of a world, and which of its lights and signs were destroyed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lights {
    frozen: bool,
    /// Simulated time that was not frozen.
    clock_secs: f64,
    /// By group.
    cycles: Vec<Cycle>,
    /// By controller.
    times: Vec<Times>,
    /// By light.
    shown: Vec<Shown>,
    /// Positions of the lights and signs that were destroyed, ascending.
    gone: Vec<u32>,
}

/// Whose turn it is in a group, and what it does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Cycle {
    /// Position in the group's controllers.
    turn: u32,
    phase: Phase,
    /// On the lights' clock.
    since_secs: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Phase {
    Green,
    Yellow,
    /// All are red before the next turn.
    Red,
}

/// How long the phases of a controller last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Times {
    pub green_secs: f32,
    pub yellow_secs: f32,
    pub red_secs: f32,
}

/// What one light shows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Shown {
    colour: Colour,
    /// On the lights' clock.
    since_secs: f64,
}

impl Times {
    /// CARLA's.
    const DEFAULT: Self = Self { green_secs: 10.0, yellow_secs: 3.0, red_secs: 2.0 };

    fn of(&self, phase: Phase) -> f32 {
        match phase {
            Phase::Green => self.green_secs,
            Phase::Yellow => self.yellow_secs,
            Phase::Red => self.red_secs,
        }
    }
}

impl Phase {
    fn colour(self) -> Colour {
        match self {
            Self::Green => Colour::Green,
            Self::Yellow => Colour::Yellow,
            Self::Red => Colour::Red,
        }
    }
}

impl Lights {
    /// Every group at the beginning of its first controller's turn.
    pub(crate) fn new(plan: &TrafficPlan) -> Self {
        let cycle = Cycle { turn: 0, phase: Phase::Green, since_secs: 0.0 };
        let mut lights = Self {
            frozen: false,
            clock_secs: 0.0,
            cycles: vec![cycle; plan.groups.len()],
            times: vec![Times::DEFAULT; plan.controllers.len()],
            shown: vec![Shown { colour: Colour::Red, since_secs: 0.0 }; plan.light_count()],
            gone: Vec::new(),
        };
        for group in 0..plan.groups.len() {
            lights.show_turn(plan, group);
        }
        lights
    }

    /// Lets time pass. A group changes at most once, so times shorter than a step last one step.
    pub(crate) fn advance(&mut self, plan: &TrafficPlan, dt_secs: f64) {
        if self.frozen {
            return;
        }
        self.clock_secs += dt_secs;
        for (group, turns) in plan.groups.iter().enumerate() {
            let Some(cycle) = self.cycles.get_mut(group) else { continue };
            let controller = turns.get(cycle.turn as usize);
            let Some(times) = controller.and_then(|c| self.times.get(*c)) else { continue };
            let lasts_secs = f64::from(times.of(cycle.phase)) - EARLY_SECS;
            if self.clock_secs - cycle.since_secs < lasts_secs {
                continue;
            }
            cycle.since_secs = self.clock_secs;
            (cycle.phase, cycle.turn) = match cycle.phase {
                Phase::Green => (Phase::Yellow, cycle.turn),
                Phase::Yellow => (Phase::Red, cycle.turn),
                Phase::Red => (Phase::Green, next_turn(cycle.turn, turns.len())),
            };
            self.show_turn(plan, group);
        }
    }

    /// What one light shows from now on, until its controller changes it.
    pub(crate) fn show(&mut self, light: usize, colour: Colour) {
        let since_secs = self.clock_secs;
        if let Some(shown) = self.shown.get_mut(light) {
            *shown = Shown { colour, since_secs };
        }
    }

    /// What they show, in the order of the map's lights; `Unknown` for those that are gone.
    pub fn colours(&self) -> impl Iterator<Item = Colour> + '_ {
        (0..self.shown.len()).filter_map(|light| self.colour(light))
    }

    /// What one of them shows, `Unknown` if it is gone; `None` beyond the last one.
    pub(crate) fn colour(&self, light: usize) -> Option<Colour> {
        let shown = self.shown.get(light)?;
        Some(if self.stands(light) { shown.colour } else { Colour::Unknown })
    }

    /// Whether the light or sign at a position was not destroyed.
    pub(crate) fn stands(&self, position: usize) -> bool {
        self.gone.binary_search(&(position as u32)).is_err()
    }

    /// Positions of the lights and signs that were destroyed, ascending.
    pub(crate) fn gone(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.gone.iter().map(|gone| *gone as usize)
    }

    /// The light or sign at a position is gone from now on.
    pub(crate) fn destroy(&mut self, position: usize) {
        let position = position as u32;
        if let Err(at) = self.gone.binary_search(&position) {
            self.gone.insert(at, position);
        }
    }

    /// The times of a light's controller.
    pub(crate) fn times_mut(&mut self, plan: &TrafficPlan, light: usize) -> Option<&mut Times> {
        self.times.get_mut(*plan.controller_of.get(light)?)
    }

    pub(crate) fn freeze(&mut self, frozen: bool) {
        self.frozen = frozen;
    }

    /// Starts the cycle of a light's group anew, or, without a light, those of all groups.
    pub(crate) fn reset(&mut self, plan: &TrafficPlan, light: Option<usize>) {
        let only = light.map(|light| usize::from(plan.group_of(light)));
        for (group, turns) in plan.groups.iter().enumerate() {
            if only.is_some_and(|only| only != group) {
                continue;
            }
            if let Some(cycle) = self.cycles.get_mut(group) {
                *cycle = Cycle { turn: 0, phase: Phase::Green, since_secs: self.clock_secs };
            }
            let lights = turns.iter().filter_map(|turn| plan.controllers.get(*turn)).flatten();
            for light in lights {
                self.show(*light, Colour::Red);
            }
            self.show_turn(plan, group);
        }
    }

    /// What a light shows and when it will change.
    pub(crate) fn state(
        &self,
        plan: &TrafficPlan,
        light: usize,
        actor: ActorId,
    ) -> Option<TrafficLightState> {
        let shown = self.shown.get(light)?;
        let times = self.times.get(*plan.controller_of.get(light)?)?;
        Some(TrafficLightState {
            actor,
            colour: self.colour(light)?,
            group: plan.group_of(light),
            frozen: self.frozen,
            elapsed_secs: (self.clock_secs - shown.since_secs) as f32,
            green_secs: times.green_secs,
            yellow_secs: times.yellow_secs,
            red_secs: times.red_secs,
        })
    }

    /// Whether this can be the state of a plan's lights; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self, plan: &TrafficPlan) -> bool {
        let past = |since_secs: f64| (0.0..=self.clock_secs).contains(&since_secs);
        let lasting = |times: &Times| {
            [times.green_secs, times.yellow_secs, times.red_secs]
                .iter()
                .all(|secs| secs.is_finite() && *secs >= 0.0)
        };
        let in_turn = |(cycle, turns): (&Cycle, &Vec<usize>)| {
            (cycle.turn as usize) < turns.len() && past(cycle.since_secs)
        };
        self.clock_secs.is_finite()
            && self.cycles.len() == plan.groups.len()
            && self.times.len() == plan.controllers.len()
            && self.shown.len() == plan.light_count()
            && self.gone.is_sorted_by(|gone, next| gone < next)
            && self.gone().all(|gone| gone < plan.count())
            && self.cycles.iter().zip(&plan.groups).all(in_turn)
            && self.times.iter().all(lasting)
            && self.shown.iter().all(|shown| past(shown.since_secs))
    }

    /// Makes the lights in turn show their group's phase.
    fn show_turn(&mut self, plan: &TrafficPlan, group: usize) {
        let Some(cycle) = self.cycles.get(group).copied() else { return };
        let controller = plan.groups.get(group).and_then(|turns| turns.get(cycle.turn as usize));
        let lights = controller.and_then(|controller| plan.controllers.get(*controller));
        for light in lights.into_iter().flatten() {
            self.show(*light, cycle.phase.colour());
        }
    }
}

fn next_turn(turn: u32, count: usize) -> u32 {
    if (turn as usize) + 1 < count { turn + 1 } else { 0 }
}
