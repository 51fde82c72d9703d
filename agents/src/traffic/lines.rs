//! Lines of lights and signs that hold a driver of traffic.

use schemas::TrafficLightColour;

use super::{Driver, STANDING_MPS};
use crate::junction::AT_LINE_M;
use crate::network::Stop;
use crate::path::StopAhead;
use crate::senses::Senses;
use crate::speed::stops_for_yellow;

/// How long a vehicle stands at a stop sign.
const STOP_SECS: f32 = 1.0;

impl Driver {
    /// Distance from the origin to the next line that holds this vehicle, for people too, and
    /// whether that is the line of a stop sign.
    pub(super) fn line(
        &mut self,
        senses: &Senses<'_>,
        lines: &[StopAhead],
        speed_mps: f32,
    ) -> (Option<f32>, bool) {
        let held = self.held_by(senses, lines, speed_mps);
        let people_m = self.crossings.line(senses, lines, speed_mps);
        let line_m = held.map(|line| line.ahead_m).into_iter().chain(people_m).reduce(f32::min);
        let is_first = |line: StopAhead| line_m == Some(line.ahead_m);
        (line_m, held.is_some_and(|line| line.why == Stop::Sign && is_first(line)))
    }

    /// The next line of a light or sign that holds it.
    fn held_by(
        &mut self,
        senses: &Senses<'_>,
        lines: &[StopAhead],
        speed_mps: f32,
    ) -> Option<StopAhead> {
        let front_m = senses.body.half_m.x;
        let closed = |light: u32, gap_m: f32| match senses.scene.light(light) {
            TrafficLightColour::Red => gap_m > 0.0 || speed_mps < 1.0,
            TrafficLightColour::Yellow => stops_for_yellow(speed_mps, gap_m),
            _ => false,
        };
        let mut held = None;
        let mut at_sign = false;
        for line in lines {
            let gap_m = line.ahead_m - front_m;
            let holds = match line.why {
                _ if senses.body.is_urgent => false,
                Stop::Light(light) => closed(light, gap_m),
                Stop::Sign if self.passed == Some(line.lane) => {
                    at_sign = true;
                    false
                }
                Stop::Sign => {
                    at_sign = true;
                    if speed_mps < STANDING_MPS && gap_m < AT_LINE_M {
                        self.stood_secs += senses.dt_secs;
                    }
                    if self.stood_secs >= STOP_SECS {
                        self.passed = Some(line.lane);
                    }
                    self.passed != Some(line.lane)
                }
                Stop::Yield | Stop::Crossing(_) => false,
            };
            if holds && held.is_none() {
                held = Some(*line);
            }
        }
        if !at_sign {
            (self.stood_secs, self.passed) = (0.0, None);
        }
        held
    }
}
