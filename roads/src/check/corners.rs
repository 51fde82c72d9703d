//! Bends that no car holds at the speed that is allowed in them.

use nalgebra::Point3;

use crate::error::{Diagnostic, Report, Severity};
use crate::map::Map;
use crate::place::Waypoint;

/// Way between places at which the direction of a lane is looked at, in metres.
const STEP_M: f64 = 2.0;
/// Direction over a shorter way says nothing of a bend, in metres.
const WAY_M_MIN: f64 = 1.0;
/// Places of one lane; longer lanes are looked at less closely.
const STEPS_MAX: usize = 10_000;
const GRAVITY_MPS2: f64 = 9.81;
/// Sideways acceleration that a car holds on a dry road, over gravity.
const HELD_G: f64 = 0.8;

/// Where a lane asks for most.
#[derive(Clone, Copy, Debug)]
struct Corner {
    s: f64,
    limit_mps: f64,
    radius_m: f64,
}

impl Corner {
    fn asked_g(self) -> f64 {
        self.limit_mps * self.limit_mps / self.radius_m / GRAVITY_MPS2
    }

    fn held_mps(self) -> f64 {
        (HELD_G * GRAVITY_MPS2 * self.radius_m).sqrt()
    }
}

impl Map {
    /// Bends of driving lanes that ask for more than 0.8 g of sideways acceleration at their speed
    /// limit: one note for each lane, at its worst place, and one for all turns in junctions, where
    /// nobody drives as fast as the road allows. No note changes what [`check`](Self::check) says.
    ///
    /// Lanes without a limit are left out. **Cost:** some milliseconds for a town.
    #[must_use]
    pub fn corners(&self) -> Report {
        let mut report = Report::default();
        let mut turns = 0;
        for (entry, exit) in self.driving_lanes() {
            let Some(corner) = sharpest(self, &entry, &exit) else { continue };
            if corner.asked_g() <= HELD_G {
                continue;
            }
            if self.lane(&entry).is_junction {
                turns += 1;
            } else {
                report.push(note(entry, corner));
            }
        }
        if turns > 0 {
            report.push(Diagnostic {
                severity: Severity::Note,
                road: None,
                s: None,
                wanted: format!("turns of junctions that {HELD_G} g hold at their speed limit"),
                found: format!("{turns} lanes in junctions where drivers have to be slower"),
            });
        }
        report
    }
}

fn note(lane: Waypoint, corner: Corner) -> Diagnostic {
    Diagnostic {
        severity: Severity::Note,
        road: Some(lane.road),
        s: Some((corner.s * 10.0).round() / 10.0),
        wanted: format!(
            "a bend of lane {} that {HELD_G} g hold at its limit of {:.0} km/h",
            lane.lane,
            corner.limit_mps * 3.6
        ),
        found: format!(
            "a radius of {:.1} m, which asks for {:.1} g; {HELD_G} g hold {:.0} km/h",
            corner.radius_m,
            corner.asked_g(),
            corner.held_mps() * 3.6
        ),
    }
}

/// The place of a lane that asks for most; `None` where it is straight or has no limit.
fn sharpest(map: &Map, entry: &Waypoint, exit: &Waypoint) -> Option<Corner> {
    let count = (((exit.s - entry.s).abs() / STEP_M).ceil() as usize).clamp(1, STEPS_MAX);
    let places: Vec<(Waypoint, Point3<f64>, f64)> = (0..=count)
        .filter_map(|index| {
            let s = entry.s + (exit.s - entry.s) * index as f64 / count as f64;
            let place = Waypoint { s, ..*entry };
            let pose = map.lane_pose(&place)?;
            Some((place, pose.point, pose.heading_rad))
        })
        .collect();
    let corners = (0..places.len()).filter_map(|index| {
        let (place, ..) = places.get(index)?;
        let (_, from_m, from_rad) = places.get(index.saturating_sub(1))?;
        let (_, to_m, to_rad) = places.get(index + 1).or_else(|| places.last())?;
        let way_m = (to_m - from_m).norm();
        let turn_rad = turn(to_rad - from_rad);
        let limit_mps = map.speed_limit_mps(place)?;
        let bends = way_m >= WAY_M_MIN && turn_rad > 0.0;
        bends.then(|| Corner { s: place.s, limit_mps, radius_m: way_m / turn_rad })
    });
    corners.max_by(|a, b| a.asked_g().total_cmp(&b.asked_g()))
}

/// How far a difference of directions turns, either way.
fn turn(difference_rad: f64) -> f64 {
    let turned = difference_rad.rem_euclid(std::f64::consts::TAU);
    turned.min(std::f64::consts::TAU - turned)
}
