//! Moving along lanes.

use crate::lanes::{LaneIndex, LaneTable};
use crate::limits;
use crate::links::Links;

/// Which way a walk goes, seen from the traffic of the lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Ahead,
    Back,
}

/// Tells all places `distance_m` along the lanes from one place.
///
/// At every fork the walk goes on along each branch; a branch that ends before the distance gives
/// nothing. A distance below zero leads nowhere.
#[inline]
pub(crate) fn walk(
    table: &LaneTable,
    links: &Links,
    start: (LaneIndex, f64),
    distance_m: f64,
    way: Way,
    mut tell: impl FnMut(LaneIndex, f64),
) {
    if distance_m.is_nan() || distance_m < 0.0 {
        return;
    }
    // Most walks end in the lane they begin in; those need no list.
    let mut first = Some((start.0, start.1, distance_m));
    let mut pending = Vec::new();
    let (mut entered, mut told) = (0, 0);
    while let Some((index, s, rest_m)) = first.take().or_else(|| pending.pop()) {
        entered += 1;
        let Some(entry) = table.get(index) else { continue };
        if entered > limits::WALK_LANES_MAX || told >= limits::WALK_RESULTS_MAX {
            break;
        }
        let along_s = entry.forward == (way == Way::Ahead);
        // Which way lanes run cannot be foreseen: a factor costs less than a branch.
        let sign = if along_s { 1.0 } else { -1.0 };
        let left_m = (if along_s { entry.end_s } else { entry.start_s } - s) * sign;
        if rest_m <= left_m {
            tell(index, s + rest_m * sign);
            told += 1;
            continue;
        }
        let linked = match way {
            Way::Ahead => links.next_of(index),
            Way::Back => links.previous_of(index),
        };
        // Reversed, so that the first branch is taken from the stack first.
        pending.extend(linked.iter().rev().filter_map(|next| {
            let entry = table.get(*next)?;
            let s = if entry.forward == (way == Way::Ahead) { entry.start_s } else { entry.end_s };
            Some((*next, s, rest_m - left_m))
        }));
    }
}
