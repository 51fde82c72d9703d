//! The shortest way from place to place over lanes and lane changes (A*, and Dijkstra's search).
//!
//! **Source:** Hart, Nilsson, Raphael, "A formal basis for the heuristic determination of minimum
//! cost paths", 1968; the estimate is the straight distance to the goal.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use schemas::Vec3;

use crate::network::{Beside, LaneId, Network, Place};
use crate::path::Leg;

/// What a lane change counts, in metres of way.
const CHANGE_COST_M: f32 = 10.0;
/// Stretches shorter than this are too short to change on...
const CHANGE_M_MIN: f32 = 8.0;
/// ...and those shorter than this count more, per metre that they lack.
const CHANGE_M_EASY: f32 = 30.0;
const HURRY_COST: f32 = 3.0;
/// A change takes at most this way.
const CHANGE_M_MAX: f32 = 40.0;

/// A lane, and whether it is entered beside the start and not at its entry.
type Node = (LaneId, bool);

#[derive(Clone, Copy, Debug)]
struct Reached {
    cost_m: f32,
    from: Option<Node>,
    /// Beside the node before, and not beyond it.
    by_change: bool,
    is_done: bool,
}

/// Nodes that were reached from a place, each by its shortest way.
#[derive(Debug)]
pub(crate) struct Reach {
    from: Place,
    reached: BTreeMap<Node, Reached>,
}

/// The legs of the shortest way, with its cost in metres; `None` where no way leads there.
pub(crate) fn plan(network: &Network, from: Place, to: Place) -> Option<(f32, Vec<Leg>)> {
    let goal_m = network.lane(to.lane)?.at(to.at_m).point_m;
    let left_m = |node| left_m(network, node, goal_m);
    let is_goal = |node: Node| node.0 == to.lane && begin(network, from, node) <= to.at_m;
    let (reach, goal) = search(network, from, left_m, is_goal);
    reach.legs(network, to, goal?)
}

/// All that can be reached from a place (Dijkstra's search: nothing is estimated).
pub(crate) fn reach(network: &Network, from: Place) -> Reach {
    search(network, from, |_| 0.0, |_| false).0
}

impl Reach {
    /// As [`plan`] has it; of several ways of one length the other may be found.
    pub(crate) fn plan(&self, network: &Network, to: Place) -> Option<(f32, Vec<Leg>)> {
        let ends = [(to.lane, true), (to.lane, false)].into_iter().filter_map(|node| {
            let begins_m = begin(network, self.from, node);
            let reached = self.reached.get(&node).filter(|_| begins_m <= to.at_m)?;
            Some((reached.cost_m + to.at_m - begins_m, node))
        });
        let (_, goal) = ends.min_by(|one, other| one.0.total_cmp(&other.0))?;
        self.legs(network, to, goal)
    }

    fn legs(&self, network: &Network, to: Place, goal: Node) -> Option<(f32, Vec<Leg>)> {
        let cost_m = self.reached.get(&goal)?.cost_m;
        let begins_m = begin(network, self.from, goal);
        Some((cost_m + to.at_m - begins_m, legs(network, &self.reached, self.from, to, goal)))
    }
}

/// Looks at nodes in the order of their cost and what is left at least, until one is the goal.
fn search(
    network: &Network,
    from: Place,
    left_m: impl Fn(Node) -> f32,
    is_goal: impl Fn(Node) -> bool,
) -> (Reach, Option<Node>) {
    let mut reached: BTreeMap<Node, Reached> = BTreeMap::new();
    let mut open: BinaryHeap<Reverse<(u64, Node)>> = BinaryHeap::new();
    let start = (from.lane, true);
    reached.insert(start, Reached { cost_m: 0.0, from: None, by_change: false, is_done: false });
    open.push(Reverse((0, start)));
    while let Some(Reverse((_, node))) = open.pop() {
        let Some(state) = reached.get_mut(&node) else { continue };
        if std::mem::replace(&mut state.is_done, true) {
            continue;
        }
        let cost_m = state.cost_m;
        if is_goal(node) {
            return (Reach { from, reached }, Some(node));
        }
        for (next, step_m, by_change) in ways_on(network, node, begin(network, from, node)) {
            let cost_m = cost_m + step_m;
            if reached.get(&next).is_some_and(|known| known.cost_m <= cost_m) {
                continue;
            }
            let known = Reached { cost_m, from: Some(node), by_change, is_done: false };
            reached.insert(next, known);
            open.push(Reverse((millimetres(cost_m + left_m(next)), next)));
        }
    }
    (Reach { from, reached }, None)
}

/// Where on its lane a node begins.
fn begin(network: &Network, from: Place, (lane, beside_start): Node) -> f32 {
    let own = network.lane(from.lane).zip(network.lane(lane)).filter(|_| beside_start);
    own.map_or(0.0, |(own, lane)| own.abreast_m(from.at_m, lane))
}

/// Nodes after one that a car can drive on: which, the cost to there, and whether by a lane change.
fn ways_on(network: &Network, node: Node, begins_m: f32) -> Vec<(Node, f32, bool)> {
    let Some(lane) = network.lane(node.0) else { return Vec::new() };
    let rest_m = (lane.length_m() - begins_m).max(0.0);
    let mut ways: Vec<_> = lane.next.iter().map(|next| ((*next, false), rest_m, false)).collect();
    for beside in [lane.left, lane.right].into_iter().flatten() {
        let stretch_m = beside.to_m - beside.from_m.max(begins_m);
        if stretch_m >= CHANGE_M_MIN {
            let hurry_m = (CHANGE_M_EASY - stretch_m).max(0.0);
            ways.push(((beside.lane, node.1), CHANGE_COST_M + HURRY_COST * hurry_m, true));
        }
    }
    ways.retain(|((id, _), ..)| network.lane(*id).is_some_and(|lane| !lane.is_barred));
    ways
}

/// At least this far: entries of lanes lie at most a lane's length from where their cost counts.
fn left_m(network: &Network, (lane, beside_start): Node, goal_m: Vec3) -> f32 {
    let lane = network.lane(lane).filter(|_| !beside_start);
    lane.map_or(0.0, |lane| (lane.at(0.0).point_m - goal_m).norm())
}

fn millimetres(metres: f32) -> u64 {
    (f64::from(metres) * 1000.0) as u64
}

fn legs(
    network: &Network,
    reached: &BTreeMap<Node, Reached>,
    from: Place,
    to: Place,
    goal: Node,
) -> Vec<Leg> {
    let mut nodes = vec![];
    let mut at = Some(goal);
    while let Some(node) = at {
        let state = reached.get(&node);
        nodes.push((node, state.is_some_and(|state| state.by_change)));
        at = state.and_then(|state| state.from);
    }
    nodes.reverse();
    let mut legs = Vec::new();
    let mut first = 0;
    while first < nodes.len() {
        let count = nodes[first + 1..].iter().take_while(|(_, by_change)| *by_change).count();
        let run: Vec<LaneId> =
            nodes[first..=first + count].iter().map(|(node, _)| node.0).collect();
        let begins_m = begin(network, from, nodes[first].0);
        let is_last = first + count + 1 == nodes.len();
        across(network, &run, (begins_m, is_last.then_some(to.at_m)), &mut legs);
        first += count + 1;
    }
    legs
}

/// Adds the legs over lanes that lie side by side: changes as early as markings allow, then the
/// rest, to the end of the last lane if no place on it is given.
pub(crate) fn across(
    network: &Network,
    run: &[LaneId],
    (begins_m, ends_m): (f32, Option<f32>),
    legs: &mut Vec<Leg>,
) {
    let mut at_m = begins_m;
    for (index, pair) in run.windows(2).enumerate() {
        let &[own, onto] = pair else { continue };
        let (Some(lane), Some(target)) = (network.lane(own), network.lane(onto)) else { continue };
        let mut sides = [lane.left, lane.right].into_iter().flatten();
        let beside = sides.find(|beside| beside.lane == onto);
        let (from_m, to_m) = beside.map_or((at_m, lane.length_m()), |b: Beside| (b.from_m, b.to_m));
        let changes = (run.len() - 1 - index) as f32;
        let begin_m = at_m.max(from_m).min(lane.length_m());
        let room_m = ((to_m - begin_m) / changes).max(0.0);
        let to_goal_m = ends_m.map_or(f32::INFINITY, |ends_m| ends_m - begin_m).max(CHANGE_M_MIN);
        let way_m = room_m.min(CHANGE_M_MAX).min(to_goal_m);
        let end_m = (begin_m + way_m).min(lane.length_m());
        if begin_m > at_m {
            legs.push(Leg { lane: own, from_m: at_m, to_m: begin_m, onto: None });
        }
        legs.push(Leg { lane: own, from_m: begin_m, to_m: end_m, onto: Some(onto) });
        at_m = lane.abreast_m(end_m, target);
    }
    if let Some(lane) = run.last() {
        let length_m = network.lane(*lane).map_or(0.0, |lane| lane.length_m());
        let to_m = ends_m.unwrap_or(length_m).max(at_m);
        legs.push(Leg { lane: *lane, from_m: at_m, to_m, onto: None });
    }
}

#[cfg(test)]
mod tests {
    use roads::Map;

    use super::*;

    /// Three roads in a row, of which the middle one's lane has no width.
    fn past_a_lane_without_width() -> Network {
        let road = |id: u32, x: f64, length: f64, link: &str, width: f64| {
            format!(
                r#"<road name="" length="{length}" id="{id}" junction="-1"><link>{link}</link>
<planView><geometry s="0" x="{x}" y="0" hdg="0" length="{length}"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
<right><lane id="-1" type="driving" level="false">
<link><predecessor id="-1"/><successor id="-1"/></link>
<width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>"#
            )
        };
        let to = |tag: &str, id: u32, contact: &str| {
            format!(r#"<{tag} elementType="road" elementId="{id}" contactPoint="{contact}"/>"#)
        };
        let text = format!(
            r#"<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4" name="m"
version="1" north="0" south="0" east="0" west="0"/>{}{}{}</OpenDRIVE>"#,
            road(1, 0.0, 50.0, &to("successor", 2, "start"), 3.5),
            road(2, 50.0, 20.0, &(to("predecessor", 1, "end") + &to("successor", 3, "start")), 0.0),
            road(3, 70.0, 50.0, &to("predecessor", 2, "end"), 3.5),
        );
        Network::new(&Map::parse("narrow", &text).unwrap())
    }

    #[test]
    fn no_way_leads_over_a_lane_without_width() {
        let network = past_a_lane_without_width();
        assert_eq!(network.lane_count(), 3);
        let place = |lane: LaneId| Place { lane, at_m: 10.0 };
        assert!(network.lane(0).unwrap().next == [1] && network.lane(1).unwrap().next == [2]);
        assert!(plan(&network, place(0), place(2)).is_none());
        assert!(reach(&network, place(0)).plan(&network, place(2)).is_none());
    }

    #[test]
    fn one_search_for_all_goals_finds_ways_as_short_as_one_for_each() {
        let text = roads::town::build("Town03_Opt").unwrap();
        let map = Map::parse("Town03_Opt", &text).unwrap();
        let network = Network::new(&map);
        let places: Vec<Place> = network
            .places(60.0)
            .iter()
            .step_by(7)
            .map(|pose| network.vehicle_place(&map, pose).unwrap())
            .collect();
        let mut found = 0;
        for from in &places {
            let reach = reach(&network, *from);
            for to in &places {
                let one = plan(&network, *from, *to).map(|(cost_m, _)| cost_m);
                let all = reach.plan(&network, *to).map(|(cost_m, _)| cost_m);
                let apart_m = one.zip(all).map(|(one, all)| (one - all).abs());
                assert_eq!(one.is_some(), all.is_some(), "{from:?} to {to:?}");
                assert!(apart_m.unwrap_or(0.0) < 0.1, "{from:?} to {to:?}: {one:?}, {all:?}");
                found += usize::from(one.is_some());
            }
        }
        assert!(found > 100, "{found}");
    }
}
