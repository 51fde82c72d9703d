//! Where roads lie, so that nothing is built on, over or under them.

use super::course::distance_m;
use super::draft::{RoadDraft, TownDraft};
use super::plan::Plan;

/// Distance between the places of a road that are looked at, in metres.
const SAMPLE_M: f64 = 3.0;

/// A disc as wide as a road.
struct Disc {
    at: [f64; 2],
    radius_m: f64,
}

/// The discs of one road, and the rectangle around them.
struct Strip {
    road: u32,
    through_junction: bool,
    discs: Vec<Disc>,
    min: [f64; 2],
    max: [f64; 2],
}

impl Strip {
    /// Whether a disc may touch the strip, judged by the rectangle.
    fn is_near(&self, at: [f64; 2], radius_m: f64) -> bool {
        (0..2).all(|k| at[k] + radius_m > self.min[k] && at[k] - radius_m < self.max[k])
    }
}

/// The land that all roads cover.
pub(super) struct Clearance {
    strips: Vec<Strip>,
}

impl Clearance {
    pub(super) fn new(plan: &Plan, draft: &TownDraft) -> Self {
        let strips = draft.roads.iter().map(|road| strip(plan, road)).collect();
        Self { strips }
    }

    /// Whether a thing within `radius_m` of a place keeps `gap_m` away from all roads;
    /// `distance_m` is that of a point from the thing.
    pub(super) fn is_clear(
        &self,
        at: [f64; 2],
        radius_m: f64,
        gap_m: f64,
        distance_m: impl Fn([f64; 2]) -> f64,
    ) -> bool {
        let near = self.strips.iter().filter(|strip| strip.is_near(at, radius_m + gap_m));
        near.flat_map(|strip| &strip.discs).all(|disc| distance_m(disc.at) >= disc.radius_m + gap_m)
    }

    /// Whether a thing beside one street is on, over or under no other street.
    pub(super) fn is_beside_only(&self, street: u32, at: [f64; 2], radius_m: f64) -> bool {
        self.strips
            .iter()
            .filter(|strip| strip.road != street && !strip.through_junction)
            .filter(|strip| strip.is_near(at, radius_m))
            .flat_map(|strip| &strip.discs)
            .all(|disc| distance_m(disc.at, at) >= disc.radius_m + radius_m)
    }
}

fn strip(plan: &Plan, road: &RoadDraft) -> Strip {
    let [left_m, right_m] = [1, -1].map(|sign| width_m(plan, road, sign));
    let radius_m = (left_m + right_m) / 2.0;
    let mut discs = Vec::new();
    for piece in &road.pieces {
        let mut along_m = 0.0;
        while along_m <= piece.length_m {
            let middle = piece.pose_at(along_m).left((left_m - right_m) / 2.0);
            discs.push(Disc { at: middle.at, radius_m });
            along_m += SAMPLE_M;
        }
    }
    let edge = |start: f64, pick: fn(f64, f64) -> f64, k: usize| {
        discs.iter().map(|disc| disc.at[k]).fold(start, pick)
    };
    Strip {
        road: road.id,
        through_junction: road.junction.is_some(),
        min: [0, 1].map(|k| edge(f64::INFINITY, f64::min, k) - radius_m),
        max: [0, 1].map(|k| edge(f64::NEG_INFINITY, f64::max, k) + radius_m),
        discs,
    }
}

/// Width of a road on the side with this sign, at its widest.
fn width_m(plan: &Plan, road: &RoadDraft, sign: i32) -> f64 {
    let street = plan.streets.iter().find(|street| street.id == road.id);
    street.map_or_else(
        || {
            let lanes = road.sections.iter().flat_map(|section| &section.lanes);
            lanes
                .filter(|lane| lane.id.signum() == sign)
                .filter_map(|lane| lane.widths.first())
                .map(|width| width.abcd[0])
                .sum()
        },
        |street| street.profile.width_m(sign),
    )
}
