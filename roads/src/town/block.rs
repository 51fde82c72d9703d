//! The land between streets: houses, yards and the parks.

use super::draft::{ObjectDraft, TownDraft};
use super::furniture::{SIDEWALK_HEIGHT_M, tree};
use super::plan::{Block, LandUse, Plan};
use super::random::Random;

/// Free strip between sidewalk and houses, in metres.
const FRONT_GAP_M: f64 = 1.5;
/// Depth of a house, in metres.
const DEPTH_M: f64 = 15.0;
/// Width of a house, in metres, before it is stretched to fill its row.
const WIDTH_M: [f64; 2] = [14.0, 26.0];
/// Height of a storey, in metres.
const STOREY_M: f64 = 3.3;
/// Distance of a park's fence from the sidewalk, width of its gates and its height, in metres.
const FENCE_INSET_M: f64 = 0.6;
const GATE_M: f64 = 6.0;
const FENCE_HEIGHT_M: f64 = 1.1;
/// Distance between trees in a park, in metres.
const TREE_SPACING_M: f64 = 14.0;

/// Fills every block of the plan.
pub(super) fn fill(plan: &Plan, random: &mut Random, draft: &mut TownDraft) {
    for block in &plan.blocks {
        floor(block, draft);
        match block.use_of_land {
            LandUse::Houses => houses_around(block, random, draft),
            LandUse::Row => row_along(block, random, draft),
            LandUse::Park => {
                park(block, random, draft);
                fence(block, draft);
            }
            LandUse::Square => {}
        }
    }
}

fn size(block: &Block) -> [f64; 2] {
    [block.max[0] - block.min[0], block.max[1] - block.min[1]]
}

fn middle(block: &Block) -> [f64; 2] {
    [(block.min[0] + block.max[0]) / 2.0, (block.min[1] + block.max[1]) / 2.0]
}

fn floor(block: &Block, draft: &mut TownDraft) {
    let [length_m, width_m] = size(block);
    let name = if block.use_of_land == LandUse::Park { "Lawn" } else { "Paving" };
    // A centimetre lower than the sidewalks, whose rounded corners reach over it.
    let height_m =
        if block.use_of_land == LandUse::Square { 0.0 } else { SIDEWALK_HEIGHT_M - 0.01 };
    let patch = thing("patch", name, [length_m, width_m, height_m], 0.0);
    draft.place(middle(block), 0.0, patch);
}

pub(super) fn thing(
    object_type: &'static str,
    name: &'static str,
    [length_m, width_m, height_m]: [f64; 3],
    z_offset_m: f64,
) -> ObjectDraft {
    ObjectDraft {
        object_type,
        name,
        s: 0.0,
        t: 0.0,
        z_offset_m,
        heading_rad: 0.0,
        length_m,
        width_m,
        height_m,
        outline: Vec::new(),
    }
}

/// Rows on the long sides take the corners, rows on the short sides fill what is left.
fn houses_around(block: &Block, random: &mut Random, draft: &mut TownDraft) {
    let (low, high) = (block.min.map(|v| v + FRONT_GAP_M), block.max.map(|v| v - FRONT_GAP_M));
    let deep_m = DEPTH_M / 2.0;
    for y in [low[1] + deep_m, high[1] - deep_m] {
        row([low[0], y], [high[0], y], random, draft);
    }
    for x in [low[0] + deep_m, high[0] - deep_m] {
        row([x, low[1] + DEPTH_M], [x, high[1] - DEPTH_M], random, draft);
    }
    let yard = middle(block);
    draft.place(yard, 0.0, tree(9.0, 2.8));
}

fn row_along(block: &Block, random: &mut Random, draft: &mut TownDraft) {
    let [x, y] = middle(block);
    let [length_m, width_m] = size(block);
    if length_m > width_m {
        row([block.min[0], y], [block.max[0], y], random, draft);
    } else {
        row([x, block.min[1]], [x, block.max[1]], random, draft);
    }
}

/// Houses wall to wall from one point to the other.
fn row(from: [f64; 2], to: [f64; 2], random: &mut Random, draft: &mut TownDraft) {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length_m = dx.hypot(dy);
    let heading_rad = dy.atan2(dx);
    let mut widths_m: Vec<f64> = Vec::new();
    let mut filled_m = 0.0;
    while filled_m + WIDTH_M[0] <= length_m {
        let width_m = random.between(WIDTH_M[0], WIDTH_M[1]);
        widths_m.push(width_m);
        filled_m += width_m;
    }
    let stretch = length_m / filled_m.max(1.0);
    let mut along_m = 0.0;
    for width_m in widths_m.into_iter().map(|width_m| width_m * stretch) {
        let share = (along_m + width_m / 2.0) / length_m;
        // A hand's width between neighbours keeps their walls apart.
        let house = house([width_m - 0.1, DEPTH_M], random.between(3.0, 8.0).floor());
        draft.place([from[0] + dx * share, from[1] + dy * share], heading_rad, house);
        along_m += width_m;
    }
}

/// A house on a floor as high as the sidewalks.
pub(super) fn house([length_m, width_m]: [f64; 2], storeys: f64) -> ObjectDraft {
    let size_m = [length_m, width_m, storeys * STOREY_M + 1.0];
    thing("building", "House", size_m, SIDEWALK_HEIGHT_M)
}

/// A fence around a park, with a gate in the middle of every side.
fn fence(block: &Block, draft: &mut TownDraft) {
    let [x, y] = middle(block);
    let half = size(block).map(|side_m| side_m / 2.0 - FENCE_INSET_M);
    for (along, across, heading_rad) in [(0, 1, 0.0), (1, 0, std::f64::consts::FRAC_PI_2)] {
        let length_m = half[along] - GATE_M / 2.0;
        let size_m = [length_m, 0.1, FENCE_HEIGHT_M];
        for (end, side) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let mut at = [x, y];
            at[along] += end * (GATE_M + length_m) / 2.0;
            at[across] += side * half[across];
            draft.place(at, heading_rad, thing("barrier", "Fence", size_m, SIDEWALK_HEIGHT_M));
        }
    }
}

fn park(block: &Block, random: &mut Random, draft: &mut TownDraft) {
    let [length_m, width_m] = size(block);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a block is some hundred metres wide"
    )]
    let counts = [length_m, width_m].map(|side_m| (side_m / TREE_SPACING_M) as usize);
    for column in 0..counts[0] {
        for line in 0..counts[1] {
            let at = [
                block.min[0] + (column as f64 + 0.5) * TREE_SPACING_M + random.between(-4.0, 4.0),
                block.min[1] + (line as f64 + 0.5) * TREE_SPACING_M + random.between(-4.0, 4.0),
            ];
            let grown = tree(random.between(6.0, 12.0), random.between(1.8, 3.2));
            draft.place(at, 0.0, grown);
        }
    }
}
