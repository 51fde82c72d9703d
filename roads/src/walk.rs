//! Moving along lanes.

use crate::lanes::{LaneEntry, LaneIndex, LaneTable};
use crate::limits;
use crate::links::Links;

/// Which way a walk goes, seen from the traffic of the lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Ahead,
    Back,
}

impl Way {
    /// The road coordinate where a walk enters a lane.
    fn entry_s(self, lane: &LaneEntry) -> f64 {
        if self == Self::Ahead { lane.entry_s() } else { lane.exit_s() }
    }

    /// The lanes a walk goes on in.
    fn from(self, lane: LaneIndex, links: &Links) -> &[LaneIndex] {
        if self == Self::Ahead { links.next_of(lane) } else { links.previous_of(lane) }
    }
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
    let way_sign = if way == Way::Ahead { 1.0 } else { -1.0 };
    let (mut index, mut s, mut rest_m) = (start.0, start.1, distance_m);
    // Most walks end in the lane they begin in, or in the only one that follows: no list for those.
    let mut pending = Vec::new();
    let mut told = 0;
    for _ in 0..limits::WALK_LANES_MAX {
        let Some(entry) = table.get(index) else { break };
        let sign = entry.sign * way_sign;
        let left_m = (if sign > 0.0 { entry.end_s } else { entry.start_s } - s) * sign;
        let mut linked: &[LaneIndex] = &[];
        if rest_m <= left_m {
            tell(index, s + rest_m * sign);
            told += 1;
            if told >= limits::WALK_RESULTS_MAX {
                break;
            }
        } else {
            linked = way.from(index, links);
            rest_m -= left_m;
        }
        if let [only] = linked {
            let Some(entry) = table.get(*only) else { break };
            (index, s) = (*only, way.entry_s(entry));
            continue;
        }
        // Reversed, so that the first branch is taken from the stack first.
        pending.extend(
            linked
                .iter()
                .rev()
                .filter_map(|next| Some((*next, way.entry_s(table.get(*next)?), rest_m))),
        );
        let Some(next) = pending.pop() else { break };
        (index, s, rest_m) = next;
    }
}
