//! How steep the ways ahead climb.

use super::{Lane, LaneId, Network};

/// Way over which a climb counts at least, in metres.
const SPAN_M: f32 = 1.0;

/// Marks every lane with the climb that no way from it on avoids.
///
/// The steepest lanes are taken out first, and with each those from which all ways lead to lanes
/// that are out: none of them has a way that climbs less.
pub(super) fn mark(network: &mut Network) {
    let onward: Vec<Vec<LaneId>> =
        network.lanes.iter().map(|lane| network.going_on(&lane.next)).collect();
    let mut left: Vec<usize> = onward.iter().map(Vec::len).collect();
    let ids = 0..network.lane_count() as LaneId;
    let own = |id| network.lane(id).map_or(0.0, own_climb);
    let mut steepest: Vec<(LaneId, f32)> = ids.map(|id| (id, own(id))).collect();
    steepest.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let mut found: Vec<Option<f32>> = vec![None; steepest.len()];
    for (first, climb) in steepest {
        let mut pending = vec![first];
        while let Some(id) = pending.pop() {
            let Some(at @ None) = found.get_mut(id as usize) else { continue };
            *at = Some(climb);
            for before in network.lane(id).into_iter().flat_map(|lane| &lane.previous) {
                let leads_here =
                    onward.get(*before as usize).is_some_and(|next| next.contains(&id));
                let Some(left) = left.get_mut(*before as usize).filter(|_| leads_here) else {
                    continue;
                };
                *left -= 1;
                if *left == 0 {
                    pending.push(*before);
                }
            }
        }
    }
    for (lane, climb) in network.lanes.iter_mut().zip(found) {
        lane.climb = climb.unwrap_or(0.0);
    }
}

impl Network {
    /// Those of some lanes from which a way goes on; all where none does.
    pub(crate) fn going_on(&self, lanes: &[LaneId]) -> Vec<LaneId> {
        let endless = |id: &&LaneId| self.lane(**id).is_some_and(|lane| lane.goes_on);
        let good: Vec<LaneId> = lanes.iter().filter(endless).copied().collect();
        if good.is_empty() { lanes.to_vec() } else { good }
    }
}

/// Of the steepest part of a lane, as a sine; 0 where it leads down only.
fn own_climb(lane: &Lane) -> f32 {
    let climbs = lane.points.windows(2).filter_map(|pair| {
        let [from, to] = pair else { return None };
        let along_m = to.at_m - from.at_m;
        (along_m >= SPAN_M).then(|| (to.point_m.z - from.point_m.z) / along_m)
    });
    climbs.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roads of 40 m from west to east, one after the other: each with the slope given, and after
    /// the first one a second way that is level.
    fn network(slopes: &[f32]) -> Network {
        let lane = |from: f32, slope: f32, next: &[LaneId], previous: &[LaneId]| {
            let point = |k: u8| {
                let along_m = 2.0 * f32::from(k);
                super::super::LanePoint {
                    at_m: along_m * slope.hypot(1.0),
                    point_m: schemas::Vec3::new(from + along_m, 0.0, along_m * slope),
                    heading_rad: 0.0,
                    curvature_per_m: 0.0,
                    limit_mps: 0.0,
                    width_m: 3.5,
                }
            };
            Lane {
                points: (0..=20).map(point).collect(),
                next: next.to_vec(),
                previous: previous.to_vec(),
                goes_on: true,
                ..Lane::default()
            }
        };
        let last = slopes.len() as LaneId - 1;
        let mut network = Network::default();
        for (id, slope) in (0..).zip(slopes) {
            let next = if id < last { vec![id + 1] } else { vec![] };
            let previous = if id > 0 { vec![id - 1] } else { vec![] };
            network.lanes.push(lane(40.0 * id as f32, *slope, &next, &previous));
        }
        network.lanes.push(lane(40.0, 0.0, &[], &[0]));
        network.lanes[0].next.push(last + 1);
        mark(&mut network);
        network
    }

    #[test]
    fn a_lane_climbs_as_the_least_steep_way_from_it_does_where_it_is_steepest() {
        let network = network(&[0.1, -0.3, 0.2, 0.4, 0.0]);
        let found = network.lanes.iter().map(|lane| lane.climb);
        let sine = |slope: f32| slope / slope.hypot(1.0);
        // The first one has a level way on.
        for (found, wanted) in found.zip([0.1, 0.4, 0.4, 0.4, 0.0, 0.0]) {
            assert!((found - sine(wanted)).abs() < 1.0e-5, "{found} of {}", sine(wanted));
        }
    }
}
