//! From a map to its network.

use roads::{LaneChange, Map, Waypoint};
use schemas::yaw_rad;

use super::grid::Grid;
use super::{
    Beside, Lane, LaneId, LanePoint, Network, climbs, conflicts, crossings, rings, shared, stops,
    ways, wrapped,
};

/// Greatest distance between points of a lane, in metres of road coordinate.
const SPACING_M: f64 = 2.0;
/// Points so many times as far apart along the lane are put nearer to each other.
const WIDE: f64 = 1.5;
/// Nobody changes to a lane where it is narrower.
const CAR_WIDTH_M: f64 = 2.0;
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
    ways::enter(&mut network);
    for (id, (entry, exit)) in (0..).zip(&spans) {
        let sides = [map.left_driving(entry), map.right_driving(entry)];
        let [left, right] = sides.map(|beside| network.place(&beside?).map(|place| place.lane));
        let left = left.map(|lane| beside(&network, map, (id, entry, exit), lane, true));
        let right = right.map(|lane| beside(&network, map, (id, entry, exit), lane, false));
        if let Some(lane) = network.lanes.get_mut(id as usize) {
            (lane.left, lane.right) = (left, right);
        }
    }
    for lane in &mut network.lanes {
        lane.is_barred = is_too_tight(lane) || is_too_narrow(lane);
    }
    mark_endless(&mut network);
    climbs::mark(&mut network);
    conflicts::find(&mut network);
    stops::mark(&mut network, map);
    shared::mark(&mut network);
    network.grid = Grid::new(&network.lanes);
    rings::mark(&mut network);
    crossings::mark(&mut network, map);
    network
}

fn lane(map: &Map, entry: &Waypoint, exit: &Waypoint) -> Lane {
    let info = map.lane(&between(entry, exit, 0.5));
    let count = (((exit.s - entry.s).abs() / SPACING_M).ceil() as usize).clamp(1, POINTS_MAX);
    let mut points = middle(map, entry, exit, count);
    // On the outside of a tight curve a step along the road is several along the lane.
    let gaps_m = points.windows(2).map(|pair| pair[1].at_m - pair[0].at_m);
    let times = f64::from(gaps_m.fold(0.0, f32::max)) / SPACING_M;
    if times > WIDE {
        let count = (count as f64 * times).ceil() as usize;
        points = middle(map, entry, exit, count.clamp(1, POINTS_MAX));
    }
    bend(&mut points);
    let bends = points.iter().map(|point| point.curvature_per_m.abs());
    let bend_per_m = bends.fold(0.0, f32::max);
    Lane {
        key: (entry.road, entry.section, entry.lane),
        entry_s: entry.s,
        exit_s: exit.s,
        points,
        bend_per_m,
        junction: info.is_junction.then_some(info.junction_id.unwrap_or(u32::MAX)),
        keeps_left: !info.is_right_hand_traffic,
        ..Lane::default()
    }
}

/// Points of the middle of a lane, evenly spaced in road coordinates, without their curvature.
fn middle(map: &Map, entry: &Waypoint, exit: &Waypoint, count: usize) -> Vec<LanePoint> {
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
            width_m: map.lane(&at).width_m as f32,
        });
    }
    points
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

/// The lane beside, with the longest stretch on which markings allow to change to it and it has
/// room for a car: turning lanes open from width zero.
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
        let allowed = allowed && !info.is_junction && is_wide(map, &at, network.lane(lane));
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

/// Whether no car can turn as the lane does: with a turning circle of about 11 m it leaves the
/// road. Maps have such ways back where roads end.
fn is_too_tight(lane: &Lane) -> bool {
    const TURN_RAD: f32 = 1.75;
    const RADIUS_M: f32 = 4.0;
    let turns = lane.points.windows(2).map(|pair| pair[1].heading_rad - pair[0].heading_rad);
    let turn_rad: f32 = turns.map(|turn_rad| wrapped(turn_rad).abs()).sum();
    turn_rad > TURN_RAD && lane.length_m() < RADIUS_M * turn_rad
}

/// Whether a lane is as wide as a car at a place abreast.
fn is_wide(map: &Map, at: &Waypoint, lane: Option<&Lane>) -> bool {
    lane.is_some_and(|lane| map.lane(&Waypoint { lane: lane.key.2, ..*at }).width_m >= CAR_WIDTH_M)
}

/// Whether no car has room on any of it: maps have lanes of width zero.
fn is_too_narrow(lane: &Lane) -> bool {
    const NARROW_M: f32 = 1.2;
    lane.points.iter().all(|point| point.width_m < NARROW_M)
}

/// Lanes from which all ways end, or go on where no car can, are peeled off from the ends. Where
/// that leaves none, those are kept that lead to the end of a road, where no lane beside goes on.
fn mark_endless(network: &mut Network) {
    peel(network, |_, lane| lane.next.is_empty());
    if !network.lanes.iter().any(|lane| lane.goes_on) {
        let goes_on = |network: &Network, beside: &Option<Beside>| {
            let lane = beside.and_then(|beside| network.lane(beside.lane));
            lane.is_some_and(|lane| !lane.next.is_empty())
        };
        peel(network, |network, lane| {
            let sides = [lane.left, lane.right];
            lane.next.is_empty() && sides.iter().any(|beside| goes_on(network, beside))
        });
    }
}

/// Lanes from which all ways lead to such ends, or to where no car can drive, do not go on.
fn peel(network: &mut Network, is_end: impl Fn(&Network, &Lane) -> bool) {
    for lane in &mut network.lanes {
        lane.goes_on = true;
    }
    let lanes = (0..).zip(&network.lanes);
    let ends = lanes.filter(|(_, lane)| lane.is_barred || is_end(network, lane));
    let mut pending: Vec<LaneId> = ends.map(|(id, _)| id).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// One lane 12 m to the right of a road that turns left about a circle of 2 m, and one on which
    /// a car would have to turn back within a circle of 1.5 m.
    fn lanes(curvature_per_m: f64, length_m: f64, right_m: f64) -> Network {
        let text = format!(
            r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="arc" version="1" north="0" south="0" east="0" west="0"/>
  <road name="arc" length="{length_m}" id="1" junction="-1">
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="{length_m}"><arc curvature="{curvature_per_m}"/></geometry>
    </planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="shoulder" level="false">
        <width sOffset="0" a="{right_m}" b="0" c="0" d="0"/></lane>
      <lane id="-2" type="driving" level="false">
        <width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#
        );
        Network::new(&Map::parse("arc", &text).unwrap())
    }

    #[test]
    fn a_lane_far_outside_of_a_tight_curve_has_points_as_near_to_each_other_as_others() {
        // Half a turn about 2 m; the lane's middle is 13.5 m from the centre of the turn.
        let network = lanes(0.5, 6.2, 10.0);
        let lane = &network.lanes[0];
        for pair in lane.points.windows(2) {
            assert!(pair[1].at_m - pair[0].at_m < 3.1, "{pair:?}");
        }
        let middle = lane.at(lane.length_m() / 2.0);
        assert!((middle.curvature_per_m - 1.0 / 13.5).abs() < 0.005, "{middle:?}");
    }

    #[test]
    fn a_way_back_that_no_car_can_turn_in_is_too_tight() {
        assert!(is_too_tight(&lanes(0.66, 4.7, 0.0).lanes[0]), "half a turn about 3 m");
        assert!(!is_too_tight(&lanes(0.5, 6.2, 10.0).lanes[0]), "half a turn about 13.5 m");
        assert!(!is_too_tight(&lanes(0.66, 2.0, 0.0).lanes[0]), "a sharp corner of 76°");
    }

    #[test]
    fn the_points_up_to_a_place_are_counted_wherever_it_is() {
        let text = roads::town::build("Town02_Opt").unwrap();
        let network = Network::new(&Map::parse("Town02_Opt", &text).unwrap());
        for lane in &network.lanes {
            let within = (-2..=41).map(|step| lane.length_m() * step as f32 / 40.0);
            let at_points = lane.points.iter().map(|point| point.at_m);
            for at_m in within.chain(at_points).chain([f32::NAN, f32::INFINITY]) {
                let wanted = lane.points.partition_point(|point| point.at_m <= at_m);
                assert_eq!(lane.after(at_m), wanted, "{at_m} m");
            }
        }
    }

    /// A road of 200 m with two lanes of which the left one ends after 100 m.
    #[test]
    fn where_all_roads_end_a_lane_that_ends_before_leads_nowhere() {
        let lane = |id: i32, successor: &str| {
            format!(
                "<lane id=\"{id}\" type=\"driving\" level=\"false\"><link>{successor}</link>\
                 <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
            )
        };
        let section = |s: u8, lanes: String| {
            format!(
                "<laneSection s=\"{s}\"><center><lane id=\"0\" type=\"none\" level=\"false\"/>\
                 </center><right>{lanes}</right></laneSection>"
            )
        };
        let first = lane(-1, "") + &lane(-2, "<successor id=\"-1\"/>");
        let text = format!(
            "<OpenDRIVE><header/><road id=\"1\" length=\"200\" junction=\"-1\"><link/><planView>\
             <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"200\"><line/></geometry>\
             </planView><lanes>{}{}</lanes></road></OpenDRIVE>",
            section(0, first),
            section(100, lane(-1, "<predecessor id=\"-2\"/>"))
        );
        let network = Network::new(&Map::parse("ends", &text).unwrap());
        let goes_on = |key| network.lane(network.by_key[&key]).unwrap().goes_on;
        assert_eq!([(1, 0, -1), (1, 0, -2), (1, 1, -1)].map(goes_on), [false, true, true]);
    }
}
