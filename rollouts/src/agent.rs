//! One agent's episode: how far it is along its way, what a step is worth, and whether it is over.

use std::sync::Arc;

use nalgebra::ComplexField;
use schemas::TrafficLightColour;

use crate::action::Action;
use crate::course::AgentStart;
use crate::end::{Cause, End};
use crate::episode::Tally;
use crate::line::LightAhead;
use crate::motion::{Contacts, Motion};
use crate::reward::{self, Terms};
use crate::route::{Abreast, Route};
use crate::spec::Spec;
use crate::task::{GoalRule, Task};

/// Who is farther beside its lane does not pass the line of its light.
const BESIDE_M: f32 = 0.5;

/// What holds for all agents of a batch.
#[derive(Clone, Debug)]
pub(crate) struct Rules {
    pub weights: Terms,
    /// By position in [`End::ALL`].
    pub ends: [bool; End::ALL.len()],
    pub horizon_secs: Option<f32>,
    pub goal: GoalRule,
    /// Length of a step.
    pub step_secs: f32,
}

/// One agent in its episode.
#[derive(Clone, Debug)]
pub(crate) struct Agent {
    pub route: Arc<Route>,
    pub place: Abreast,
    pub last: Action,
    pub alive: bool,
    /// The next line of a light on its way, and what that shows.
    pub light: Option<LightAhead>,
    limit_secs: f32,
    pair: usize,
    /// Number of the preset.
    weather: u32,
    tally: Tally,
}

/// What came of an agent's action.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome<'a> {
    pub motion: &'a Motion,
    pub contacts: Contacts,
    /// What the town's lights show, by position.
    pub colours: &'a [TrafficLightColour],
}

/// What a step was worth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict {
    pub reward: f32,
    pub cause: Option<Cause>,
}

impl Rules {
    pub(crate) fn new(spec: &Spec, task: &Task) -> Result<Self, schemas::Error> {
        let named = spec.ends.as_deref().unwrap_or(&task.ends);
        Ok(Self {
            weights: spec.reward.weights(&task.reward)?,
            ends: End::ALL.map(|end| named.contains(&end)),
            horizon_secs: spec.horizon_secs,
            goal: task.goal,
            step_secs: spec.step_secs() as f32,
        })
    }

    /// The first of the ends that hold and count.
    fn end(&self, holds: [bool; End::ALL.len()]) -> Option<End> {
        let counted = End::ALL.into_iter().zip(self.ends).zip(holds);
        counted.into_iter().find(|((_, counts), holds)| *counts && *holds).map(|((end, _), _)| end)
    }
}

impl Agent {
    pub(crate) fn new(start: &AgentStart, weather: u32, motion: &Motion) -> Self {
        let place = start.route.abreast(motion.x_m, motion.y_m, 0);
        Self {
            route: Arc::clone(&start.route),
            place,
            last: Action::default(),
            alive: true,
            light: None,
            limit_secs: start.limit_secs,
            pair: start.pair,
            weather,
            tally: Tally::default(),
        }
    }

    /// Takes in what came of an action.
    pub(crate) fn advance(
        &mut self,
        rules: &Rules,
        action: Action,
        outcome: &Outcome<'_>,
    ) -> Verdict {
        let Outcome { motion, contacts, colours } = *outcome;
        let place = self.route.abreast(motion.x_m, motion.y_m, self.place.segment);
        let before = std::mem::replace(&mut self.place, place);
        let steered = (action.steer - std::mem::replace(&mut self.last, action).steer).abs();
        let arrived = self.has_arrived(rules, motion);
        let off_route = self.place.away_m > self.place.half_width_m;
        let speeding_mps = match self.place.limit_mps {
            limit_mps if limit_mps > 0.0 => (motion.speed_mps - limit_mps).max(0.0),
            _ => 0.0,
        };
        let progress_m = self.place.at_m - before.at_m;
        let red_light = self.runs_red(colours);
        self.look_out(colours);
        let number = |holds: bool| f32::from(u8::from(holds));
        let terms: Terms = [
            progress_m,
            progress_m / self.route.length_m(),
            number(arrived),
            number(contacts.any()),
            number(off_route),
            speeding_mps,
            steered,
            number(red_light),
            self.place.left_m.abs(),
            1.0,
        ];
        let reward = reward::sum(&terms, &rules.weights);
        self.note(rules, outcome, reward, (off_route, speeding_mps));
        self.tally.red_lights += u32::from(red_light);
        let cause = rules
            .end([arrived, contacts.any(), off_route, motion.overturned, red_light])
            .map(Cause::By)
            .or_else(|| self.is_late(rules).then_some(Cause::Time));
        Verdict { reward, cause }
    }

    fn has_arrived(&self, rules: &Rules, motion: &Motion) -> bool {
        let goal = self.route.goal();
        let (to_x, to_y) = (goal.x_m - motion.x_m, goal.y_m - motion.y_m);
        let (cos, sin) = self.route.facing(goal.at_m);
        let away_m = ComplexField::sqrt(to_x * to_x + to_y * to_y);
        rules.goal.holds(away_m, motion.speed_mps, motion.cos * cos + motion.sin * sin)
    }

    fn note(
        &mut self,
        rules: &Rules,
        outcome: &Outcome<'_>,
        reward: f32,
        (off_route, speeding_mps): (bool, f32),
    ) {
        let secs = rules.step_secs;
        let tally = &mut self.tally;
        tally.reward += reward;
        tally.steps += 1;
        tally.secs = tally.steps as f32 * secs;
        tally.driven_m += outcome.motion.speed_mps.abs() * secs;
        tally.beside_m += self.place.left_m.abs();
        tally.hit(outcome.contacts);
        if off_route {
            tally.off_route_secs += secs;
        }
        if speeding_mps > 0.0 {
            tally.speeding_secs += secs;
        }
    }

    /// Notes the next line on its way and what the light there shows.
    pub(crate) fn look_out(&mut self, colours: &[TrafficLightColour]) {
        let stop = if colours.is_empty() { None } else { self.route.stop_after(self.place.at_m) };
        self.light = stop.and_then(|stop| {
            let colour = *colours.get(stop.light)?;
            Some(LightAhead { at_m: stop.at_m, light: stop.light, colour })
        });
    }

    /// Whether it passed the line of a light that showed red before the step and does so now.
    fn runs_red(&self, colours: &[TrafficLightColour]) -> bool {
        let red = TrafficLightColour::Red;
        let is_on_way = self.place.away_m <= self.place.half_width_m + BESIDE_M;
        self.light.is_some_and(|light| {
            let stays_red = light.colour == red && colours.get(light.light) == Some(&red);
            stays_red && is_on_way && self.place.at_m >= light.at_m
        })
    }

    fn is_late(&self, rules: &Rules) -> bool {
        self.tally.secs >= rules.horizon_secs.unwrap_or(self.limit_secs)
    }

    /// Writes what is known of the episode that ended.
    pub(crate) fn conclude(&self, row: &mut [f32], cause: Cause) {
        let length_m = self.route.length_m();
        let arrived = cause == Cause::By(End::Arrived);
        let completion = if arrived { 1.0 } else { self.place.at_m / length_m };
        self.tally.write(row, cause, (length_m, completion), (self.pair, self.weather));
    }
}
