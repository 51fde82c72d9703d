//! Where roads lie, so that nothing is built on, over or under them.

use super::course::distance_m;
use super::draft::{RoadDraft, TownDraft};
use super::plan::Plan;

/// Distance between the places of a road that are looked at, in metres.
const SAMPLE_M: f64 = 3.0;

/// A disc as wide as a road.
struct Disc {
    road: u32,
    through_junction: bool,
    at: [f64; 2],
    radius_m: f64,
}

/// The land that all roads cover.
pub(super) struct Clearance {
    discs: Vec<Disc>,
}

impl Clearance {
    pub(super) fn new(plan: &Plan, draft: &TownDraft) -> Self {
        let mut discs = Vec::new();
        for road in &draft.roads {
            let [left_m, right_m] = [1, -1].map(|sign| width_m(plan, road, sign));
            for piece in &road.pieces {
                let mut along_m = 0.0;
                while along_m <= piece.length_m {
                    let middle = piece.pose_at(along_m).left((left_m - right_m) / 2.0);
                    discs.push(Disc {
                        road: road.id,
                        through_junction: road.junction.is_some(),
                        at: middle.at,
                        radius_m: (left_m + right_m) / 2.0,
                    });
                    along_m += SAMPLE_M;
                }
            }
        }
        Self { discs }
    }

    /// Whether a thing keeps `gap_m` away from all roads; `distance_m` is that of a point from it.
    pub(super) fn is_clear(&self, gap_m: f64, distance_m: impl Fn([f64; 2]) -> f64) -> bool {
        self.discs.iter().all(|disc| distance_m(disc.at) >= disc.radius_m + gap_m)
    }

    /// Whether a thing beside one street is on, over or under no other street.
    pub(super) fn is_beside_only(&self, street: u32, at: [f64; 2], radius_m: f64) -> bool {
        self.discs.iter().all(|disc| {
            disc.road == street
                || disc.through_junction
                || distance_m(disc.at, at) >= disc.radius_m + radius_m
        })
    }
}

/// Width of a road on the side with this sign, at its widest.
fn width_m(plan: &Plan, road: &RoadDraft, sign: i32) -> f64 {
    let street = plan.streets.iter().find(|street| street.id == road.id);
    street.map_or_else(
        || {
            let lanes = road.sections.iter().flat_map(|section| &section.lanes);
            lanes.filter(|lane| lane.id.signum() == sign).map(|lane| lane.width_m[0]).sum()
        },
        |street| street.profile.width_m(sign),
    )
}
