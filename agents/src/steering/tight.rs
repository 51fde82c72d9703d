//! Bends tighter than a vehicle can turn: begun earlier, so that it cuts as much of them as it
//! comes out beside them.

use super::LEAD_SECS;
use crate::network::{Network, wrapped};
use crate::path::Path;
use crate::pilot::VehicleView;

/// How far ahead bends count, and from step to step.
const LOOK_M: f32 = 10.0;
const STEP_M: f32 = 0.5;
/// A turn that lacks less is steered for as others.
const LACK_RAD_MIN: f32 = 0.03;
/// From the middle of the steering wheel to its lock takes twice as long.
const TURN_IN_SECS: f32 = 0.3;

/// The lock, 1 to the left, where a vehicle must steer to it for a bend that it cannot follow.
pub(super) fn lock(
    path: &Path,
    network: &Network,
    view: &VehicleView,
    along_mps: f32,
) -> Option<f32> {
    if !path.is_tight(network, LOOK_M, view.bend_per_m_max) {
        return None;
    }
    let from_m = along_mps.max(0.0) * (TURN_IN_SECS - LEAD_SECS);
    let steps = (0..=(LOOK_M / STEP_M) as u16).map(|step| from_m + f32::from(step) * STEP_M);
    let headings = steps.map_while(|ahead_m| Some(path.at(network, ahead_m)?.point.heading_rad));
    let headings: Vec<f32> = headings.collect();
    let turns = headings.windows(2).map(|pair| wrapped(pair[1] - pair[0]));
    let turns: Vec<f32> = turns.collect();
    [1.0, -1.0].into_iter().find(|side| lacks(&turns, *side, STEP_M * view.bend_per_m_max))
}

/// Whether a vehicle that turns by at most so much in a step would lack, by the time that it is out
/// of a bend to this side, more than half of what it lacks in it anyway.
fn lacks(turns: &[f32], side: f32, most_rad: f32) -> bool {
    let (mut now_rad, mut since_rad, mut bend_rad) = (0.0f32, 0.0f32, 0.0f32);
    let mut most_now_rad = 0.0f32;
    for turn in turns {
        let lack_rad = side * turn - most_rad;
        now_rad += lack_rad;
        most_now_rad = most_now_rad.max(now_rad);
        since_rad = (since_rad + lack_rad).max(0.0);
        bend_rad = bend_rad.max(since_rad);
    }
    bend_rad > LACK_RAD_MIN && most_now_rad > bend_rad / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether it steers to its lock this far before a bend of 0.9 rad with a radius of 3.5 m, if
    /// it can turn about so much.
    fn turns(before_m: f32, side: f32, radius_m: f32) -> [bool; 2] {
        let bend_m = 0.9 * 3.5;
        let turn = |step: u16| {
            let at_m = f32::from(step) * STEP_M - before_m;
            side * ((at_m + STEP_M).clamp(0.0, bend_m) - at_m.clamp(0.0, bend_m)) / 3.5
        };
        let turns: Vec<f32> = (0..20).map(turn).collect();
        [1.0, -1.0].map(|side| lacks(&turns, side, STEP_M / radius_m))
    }

    #[test]
    fn a_bend_too_tight_is_begun_before_it_by_half_of_what_is_lacking() {
        // Of 0.9 rad a vehicle that turns about 5 m lacks 0.27: 0.135 rad take it 0.68 m.
        assert_eq!(turns(1.0, 1.0, 5.0), [false, false]);
        assert_eq!(turns(0.5, 1.0, 5.0), [true, false]);
        assert_eq!(turns(0.5, -1.0, 5.0), [false, true]);
        assert_eq!(turns(-1.0, 1.0, 5.0), [true, false], "in the bend");
        assert_eq!(turns(0.5, 1.0, 3.4), [false, false], "not too tight");
    }
}
