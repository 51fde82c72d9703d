//! Lights, signs, crossings and junctions ahead of an agent.

use schemas::TrafficLightColour;

use super::traits::Traits;
use super::{Agent, EASY_MPS2, GAP_M, HARD_MPS2, STANDING_MPS};
use crate::junction::{Approach, Claims, Held};
use crate::network::Stop;
use crate::scene::Ahead;
use crate::senses::Senses;

/// How long a vehicle stands at a stop sign.
const STOP_SECS: f32 = 1.0;
/// A stop line this far ahead of the bumper at most is the one that a vehicle stands at.
const AT_LINE_M: f32 = 4.0;

/// Lights and signs ahead.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lines {
    /// Whether it is to stop now.
    pub stops_here: bool,
    /// From the origin to the first one that holds it.
    pub held_m: Option<f32>,
    /// From the front to the first crossing that people are on; endless where there is none.
    pub people_m: f32,
}

impl Agent {
    /// Free way to where it waits for the next junction, or in it; endless where it may drive on.
    pub(super) fn junction(
        &mut self,
        senses: &Senses<'_>,
        claims: &mut Claims,
        queue: &[Ahead],
        (line_m, look_m, speed_mps): (Option<f32>, f32, f32),
    ) -> f32 {
        if !self.asks() {
            return f32::INFINITY;
        }
        let stopping_m = speed_mps * speed_mps / (2.0 * EASY_MPS2);
        let path = &self.path;
        let approach =
            Approach { senses, path, speed_mps, look_m, stopping_m, gap_m: GAP_M, line_m, queue };
        let stop_m = self.passage.enter(&approach, claims).map_or(f32::INFINITY, |m| m.max(0.0));
        // Who comes to a line stops there by its own rules.
        if self.passage.held() == Held::Line { f32::INFINITY } else { stop_m }
    }

    /// Whether a red light or a stop sign is near, and the first one that holds it.
    pub(super) fn lines(
        &mut self,
        senses: &Senses<'_>,
        traits: &Traits,
        look_m: f32,
        speed_mps: f32,
    ) -> Lines {
        let front_m = senses.body.half_m.x;
        let stopping_m = speed_mps * speed_mps / (2.0 * HARD_MPS2);
        let from_m = (traits.light_m + speed_mps.max(0.0)).max(stopping_m + 1.0);
        let lines = self.path.stops(senses.network, 0.0, look_m.max(from_m) + front_m);
        let people_m = match self.options.ignore_vehicles {
            true => None,
            false => self.crossings.line(senses, &lines, speed_mps),
        };
        let people_m = people_m.map_or(f32::INFINITY, |line_m| (line_m - front_m - 1.0).max(0.0));
        let red = |light: u32| senses.scene.light(light) == TrafficLightColour::Red;
        let mut at_red = lines.iter().filter(|line| match line.why {
            Stop::Light(light) => !self.options.ignore_lights && red(light),
            _ => false,
        });
        let red_m = at_red.next().map(|line| line.ahead_m);
        let at_red = red_m.is_some_and(|red_m| red_m <= from_m + front_m);
        let sign = lines.iter().find(|line| line.why == Stop::Sign);
        let sign = sign.filter(|_| !self.options.ignore_stop_signs);
        let Some(sign) = sign.filter(|sign| sign.ahead_m <= from_m + front_m) else {
            (self.stood_secs, self.passed) = (0.0, None);
            let held_m = sign.map(|sign| sign.ahead_m).into_iter().chain(red_m).reduce(f32::min);
            return Lines { stops_here: at_red, held_m, people_m };
        };
        let gap_m = sign.ahead_m - front_m;
        if speed_mps < STANDING_MPS && gap_m < AT_LINE_M {
            self.stood_secs += senses.dt_secs;
        }
        if self.stood_secs >= STOP_SECS {
            self.passed = Some(sign.lane);
        }
        let holds = self.passed != Some(sign.lane);
        let sign_m = Some(sign.ahead_m).filter(|_| holds);
        let stops_here = at_red || (holds && gap_m < stopping_m + 1.5);
        let held_m = sign_m.into_iter().chain(red_m).reduce(f32::min);
        Lines { stops_here, held_m, people_m }
    }
}
