//! Junctions: one connecting road per approach and exit, crosswalks and stop lines.

use super::course::join;
use super::draft::{
    ConnectionDraft, JunctionDraft, LaneDraft, LaneKind, LineKind, LinkTo, ObjectDraft, Piece,
    Rise, RoadDraft, SectionDraft, TownDraft,
};
use super::movement::{Movement, movements};
use super::plan::{Arm, Control, Plan};
use super::priority;
use super::profile::{Edge, LANE_M};

/// Ids of junctions start here, above those of all streets and connecting roads.
const JUNCTION_ID_FIRST: u32 = 10_000;
/// Ids of connecting roads start here, above those of all streets.
const CONNECTING_ID_FIRST: u32 = 1_000;
/// Crosswalks lie between these distances inside the junction, in metres.
const CROSSWALK_M: [f64; 2] = [0.7, 3.7];
/// How far crosswalks reach onto the sidewalks, so that walkers step onto them, in metres.
pub(super) const CROSSWALK_OVERLAP_M: f64 = 1.5;
/// Width of stop lines, in metres.
const STOP_LINE_M: f64 = 0.4;

/// The OpenDRIVE id of a junction of the plan.
pub(super) fn junction_id(node: usize) -> u32 {
    JUNCTION_ID_FIRST + u32::try_from(node).unwrap_or(0)
}

/// Adds the roads, crosswalks, lights and signs of one junction.
pub(super) fn build(plan: &Plan, node: usize, draft: &mut TownDraft) {
    let arms = plan.arms(node);
    let streets = plan.streets.len();
    let mut connections = Vec::new();
    for index in 0..arms.len() {
        for movement in movements(&arms, index) {
            let connecting_before = u32::try_from(draft.roads.len() - streets).unwrap_or(0);
            let id = CONNECTING_ID_FIRST + connecting_before;
            let road = connecting_road(plan, node, &movement, id);
            let lanes = road.sections.iter().flat_map(|section| &section.lanes);
            connections.push(ConnectionDraft {
                incoming: movement.from.street,
                connecting: id,
                lanes: lanes
                    .filter_map(|lane| lane.predecessor.map(|incoming| (incoming, lane.id)))
                    .collect(),
            });
            draft.roads.push(road);
        }
    }
    draft.junctions.push(JunctionDraft {
        id: junction_id(node),
        connections,
        controllers: Vec::new(),
    });
    let control = plan.nodes.get(node).map_or(Control::Free, |node| node.control);
    let waiting = priority::waiting(control, &arms);
    for arm in &arms {
        let waits = waiting.iter().any(|(other, _)| other.street == arm.street);
        paint(arm, waits, draft);
    }
    priority::rule(control, node, &arms, draft);
}

fn connecting_road(plan: &Plan, node: usize, movement: &Movement, id: u32) -> RoadDraft {
    let Movement { from, to, .. } = *movement;
    let (from_sign, to_sign) = (from.inbound_sign(), -to.inbound_sign());
    let lane = |number: i32, kind, width_m, line| LaneDraft {
        id: -number,
        kind,
        width_m,
        line,
        predecessor: Some(from_sign * (movement.from_lane + number - 1)),
        successor: Some(to_sign * (movement.to_lane + number - 1)),
    };
    let mut lanes: Vec<LaneDraft> = (1..=movement.lanes)
        .map(|number| lane(number, LaneKind::Driving, [LANE_M; 2], LineKind::None))
        .collect();
    let edges = [from.inbound(), to.outbound()].map(|side| side.map(|side| side.edge));
    if let ([Some(before), Some(after)], true) = (edges, movement.at_kerb) {
        let both = [before, after];
        let line = if both == [Edge::Sidewalk; 2] { LineKind::Kerb } else { LineKind::None };
        let next = movement.lanes + 1;
        lanes.push(lane(next, LaneKind::Shoulder, both.map(Edge::shoulder_m), line));
        if both == [Edge::Sidewalk; 2] {
            let width_m = both.map(Edge::sidewalk_m);
            lanes.push(lane(next + 1, LaneKind::Sidewalk, width_m, LineKind::None));
        }
    }
    let pieces = pieces(movement);
    let length_m = pieces.iter().map(|piece| piece.length_m).sum();
    RoadDraft {
        id,
        junction: Some(junction_id(node)),
        limit_kmh: from.profile.limit_kmh,
        predecessor: LinkTo::Road { id: from.street, at_end: from.ends_here },
        successor: LinkTo::Road { id: to.street, at_end: to.ends_here },
        pieces,
        rises: vec![Rise { start_s: 0.0, abcd: [plan.height_m(node), 0.0, 0.0, 0.0] }],
        centre_line: false,
        sections: vec![SectionDraft { start_s: 0.0, length_m, lanes }],
        objects: Vec::new(),
        signals: Vec::new(),
        held_by: None,
    }
}

/// The left border of the movement's first lane.
fn pieces(movement: &Movement) -> Vec<Piece> {
    let border_m = |lane: i32| -f64::from(lane - 1) * LANE_M;
    let start = movement.from.entering().left(border_m(movement.from_lane));
    let end = movement.to.pose.left(border_m(movement.to_lane));
    join(start, end)
}

/// Crosswalk of an arm, where there are sidewalks to cross between, and its stop line.
fn paint(arm: &Arm, waits: bool, draft: &mut TownDraft) {
    let Some(street) = draft.road_mut(arm.street) else { return };
    let length_m = street.length_m();
    if let (Some(left), right) = (arm.profile.left, arm.profile.right)
        && left.edge == Edge::Sidewalk
        && right.edge == Edge::Sidewalk
    {
        let across = [-right.kerb_m() - CROSSWALK_OVERLAP_M, left.kerb_m() + CROSSWALK_OVERLAP_M];
        let crosswalk = flat(arm, length_m, "crosswalk", "SimpleCrosswalk", CROSSWALK_M, across);
        street.objects.push(crosswalk);
    }
    if waits {
        let across_m = f64::from(arm.inbound_sign() * arm.lanes_in()) * LANE_M;
        let across = [across_m.min(0.0), across_m.max(0.0)];
        let along = [-1.0 - STOP_LINE_M, -1.0];
        street.objects.push(flat(arm, length_m, "roadMark", "StopLine", along, across));
    }
}

/// A rectangle on the ground at a street's end; `along` counts into the junction.
fn flat(
    arm: &Arm,
    street_length_m: f64,
    object_type: &'static str,
    name: &'static str,
    along: [f64; 2],
    across: [f64; 2],
) -> ObjectDraft {
    let (s, sign) = if arm.ends_here { (street_length_m, 1.0) } else { (0.0, -1.0) };
    let [u0, u1] = if arm.ends_here { along } else { [sign * along[1], sign * along[0]] };
    let [v0, v1] = across;
    ObjectDraft {
        object_type,
        name,
        s,
        t: 0.0,
        z_offset_m: 0.0,
        heading_rad: 0.0,
        length_m: v1 - v0,
        width_m: u1 - u0,
        height_m: 0.0,
        outline: vec![[u0, v0], [u1, v0], [u1, v1], [u0, v1], [u0, v0]],
    }
}
