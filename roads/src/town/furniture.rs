//! Street lamps and trees along the sidewalks.

use super::draft::{ObjectDraft, TownDraft};
use super::plan::Plan;

/// Distance between things along a sidewalk, in metres.
const SPACING_M: f64 = 16.0;
/// Distance of the first from the street's end, in metres.
const END_GAP_M: f64 = 8.0;
/// Distance of the middle of posts and trunks from the kerb, in metres.
const KERB_GAP_M: f64 = 0.7;
/// Height of a sidewalk above the road, in metres.
pub(super) const SIDEWALK_HEIGHT_M: f64 = 0.15;

/// Lamps and trees in turn, on both sides of every street.
pub(super) fn line_streets(plan: &Plan, draft: &mut TownDraft) {
    for (street, road) in plan.streets.iter().zip(&mut draft.roads) {
        let length_m = road.length_m();
        let beside_m = street.profile.kerb_m() + KERB_GAP_M;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a street of the plan is some hundred metres long"
        )]
        let count = ((length_m - 2.0 * END_GAP_M) / SPACING_M) as usize;
        for index in 0..=count {
            let s = END_GAP_M + index as f64 * SPACING_M;
            for (side, t) in [(0, beside_m), (1, -beside_m)] {
                let lamp = (index + side) % 2 == 0;
                let mut object = if lamp { lamp_post() } else { tree(7.0, 1.6) };
                (object.s, object.t) = (s, t);
                // Lamps reach over the road.
                object.heading_rad = if t > 0.0 {
                    -std::f64::consts::FRAC_PI_2
                } else {
                    std::f64::consts::FRAC_PI_2
                };
                road.objects.push(object);
            }
        }
    }
}

fn lamp_post() -> ObjectDraft {
    ObjectDraft {
        object_type: "streetLamp",
        name: "StreetLamp",
        s: 0.0,
        t: 0.0,
        z_offset_m: SIDEWALK_HEIGHT_M,
        heading_rad: 0.0,
        length_m: 0.2,
        width_m: 0.2,
        height_m: 6.5,
        outline: Vec::new(),
    }
}

/// A tree with a crown of this radius.
pub(super) fn tree(height_m: f64, radius_m: f64) -> ObjectDraft {
    ObjectDraft {
        object_type: "tree",
        name: "Tree",
        s: 0.0,
        t: 0.0,
        z_offset_m: SIDEWALK_HEIGHT_M,
        heading_rad: 0.0,
        length_m: 2.0 * radius_m,
        width_m: 2.0 * radius_m,
        height_m,
        outline: Vec::new(),
    }
}
