//! From a map to its network.

use roads::{LaneChange, Map, Waypoint};
use schemas::yaw_rad;

use super::grid::Grid;
use super::{Beside, Lane, LaneId, LanePoint, Network, conflicts, stops, wrapped};

/// Greatest distance between points of a lane, in metres of road coordinate.
const SPACING_M: f64 = 2.0;
/// Points of one lane; longer lanes have wider spacing.
const POINTS_MAX: usize = 10_000;

pub(super) fn network(map: &Map) -> Network {
    let spans = map.driving_lanes();
    let mut network = Network::default();
    for (id, (entry, exit)) in (0..).zip(&spans) {
        network.by_key.insert((entry.road, entry.section, entry.lane), id);
        network.lanes.push(lane(map, entry, exit));
    }
    link(&mut network, map);
    for (id, (entry, exit)) in (0..).zip(&spans) {
        let sides = [map.left_driving(entry), map.right_driving(entry)];
        let [left, right] = sides.map(|beside| network.place(&beside?).map(|place| place.lane));
        let left = left.map(|lane| beside(&network, map, (id, entry, exit), lane, true));
        let right = right.map(|lane| beside(&network, map, (id, entry, exit), lane, false));
        if let Some(lane) = network.lanes.get_mut(id as usize) {
            (lane.left, lane.right) = (left, right);
        }
    }
    mark_endless(&mut network);
    conflicts::find(&mut network);
    stops::mark(&mut network, map);
    network.grid = Grid::new(&network.lanes);
    network
}

fn lane(map: &Map, entry: &Waypoint, exit: &Waypoint) -> Lane {
    let info = map.lane(&between(entry, exit, 0.5));
    let count = (((exit.s - entry.s).abs() / SPACING_M).ceil() as usize).clamp(1, POINTS_MAX);
    let mut points: Vec<LanePoint> = Vec::with_capacity(count + 1);
    for index in 0..=count {
        let at = between(entry, exit, index as f64 / count as f64);
        let pose: schemas::Pose = nalgebra::convert(map.pose(&at));
        let point_m = pose.translation.vector;
        let before = points.last().map_or((0.0, point_m), |last| (last.at_m, last.point_m));
        points.push(LanePoint {
            at_m: before.0 + (point_m - before.1).norm(),
            point_m,
            heading_rad: yaw_rad(&pose),
            curvature_per_m: 0.0,
            limit_mps: map.speed_limit_mps(&at).unwrap_or(0.0) as f32,
        });
    }
    bend(&mut points);
    Lane {
        key: (entry.road, entry.section, entry.lane),
        entry_s: entry.s,
        exit_s: exit.s,
        points,
        junction: info.is_junction.then_some(info.junction_id.unwrap_or(u32::MAX)),
        ..Lane::default()
    }
}

fn between(entry: &Waypoint, exit: &Waypoint, share: f64) -> Waypoint {
    Waypoint { s: entry.s + (exit.s - entry.s) * share, ..*entry }
}

/// Curvature as the turn from the point before to the point after.
fn bend(points: &mut [LanePoint]) {
    let last = points.len().saturating_sub(1);
    let curvatures: Vec<f32> = (0..points.len())
        .map(|index| {
            let (from, to) = (points[index.saturating_sub(1)], points[(index + 1).min(last)]);
            wrapped(to.heading_rad - from.heading_rad) / (to.at_m - from.at_m).max(1.0e-3)
        })
        .collect();
    for (point, curvature) in points.iter_mut().zip(curvatures) {
        point.curvature_per_m = curvature;
    }
}

fn link(network: &mut Network, map: &Map) {
    let joined: Vec<(LaneId, LaneId)> = map
        .lane_joints()
        .iter()
        .filter_map(|(end, start)| Some((network.place(end)?.lane, network.place(start)?.lane)))
        .collect();
    for (from, to) in joined {
        if let Some(lane) = network.lanes.get_mut(from as usize)
            && !lane.next.contains(&to)
        {
            lane.next.push(to);
        }
        if let Some(lane) = network.lanes.get_mut(to as usize)
            && !lane.previous.contains(&from)
        {
            lane.previous.push(from);
        }
    }
}

/// The lane beside, with the longest stretch on which markings allow to change to it.
fn beside(
    network: &Network,
    map: &Map,
    (id, entry, exit): (LaneId, &Waypoint, &Waypoint),
    lane: LaneId,
    left: bool,
) -> Beside {
    let own = network.lane(id);
    let count = own.map_or(1, |own| own.points.len().saturating_sub(1)).max(1);
    let (mut best, mut start_m) = ((0.0, 0.0), None);
    for index in 0..=count {
        let at = between(entry, exit, index as f64 / count as f64);
        let at_m = own.and_then(|own| own.points.get(index)).map_or(0.0, |point| point.at_m);
        let info = map.lane(&at);
        let allowed = match info.lane_change {
            LaneChange::Both => true,
            LaneChange::Left => left,
            LaneChange::Right => !left,
            LaneChange::None => false,
        };
        let allowed = allowed && !info.is_junction;
        if !allowed {
            start_m = None;
            continue;
        }
        let from_m = *start_m.get_or_insert(at_m);
        if at_m - from_m > best.1 - best.0 {
            best = (from_m, at_m);
        }
    }
    Beside { lane, from_m: best.0, to_m: best.1 }
}

/// Lanes from which all ways end are peeled off from the ends.
fn mark_endless(network: &mut Network) {
    for lane in &mut network.lanes {
        lane.goes_on = true;
    }
    let mut pending: Vec<LaneId> = (0..)
        .zip(&network.lanes)
        .filter(|(_, lane)| lane.next.is_empty())
        .map(|(id, _)| id)
        .collect();
    while let Some(id) = pending.pop() {
        let Some(lane) = network.lanes.get_mut(id as usize) else { continue };
        if !std::mem::replace(&mut lane.goes_on, false) {
            continue;
        }
        for before in lane.previous.clone() {
            let ends =
                |next: &LaneId| !network.lanes.get(*next as usize).is_some_and(|l| l.goes_on);
            if network.lanes.get(before as usize).is_some_and(|lane| lane.next.iter().all(ends)) {
                pending.push(before);
            }
        }
    }
}
