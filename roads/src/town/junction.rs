//! Junctions: one connecting road per approach and exit, crosswalks and stop lines.

use super::corner::Corner;
use super::course::{join, length_m};
use super::draft::{
    ConnectionDraft, Cubic, JunctionDraft, LaneDraft, LaneKind, LineKind, LinkTo, ObjectDraft,
    Piece, RoadDraft, SectionDraft, TownDraft,
};
use super::movement::{Movement, all_movements};
use super::plan::{Arm, Control, Plan};
use super::priority;
use super::profile::{LANE_M, Side};

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
    let control = plan.nodes.get(node).map_or(Control::Free, |node| node.control);
    let corners = Corner::all(&arms);
    let mut connections = Vec::new();
    for (corner, movements) in corners.iter().zip(all_movements(control, &arms)) {
        let is_driven_around = movements.iter().any(|movement| movement.at_kerb);
        let mut ways: Vec<Way> =
            movements.iter().map(|movement| driving_way(corner, movement, draft)).collect();
        if !is_driven_around && corner.has_sidewalk() {
            let pieces = corner.pieces();
            let lanes = corner.lanes(1, length_m(&pieces), draft);
            ways.push(Way { to: corner.to, pieces, lanes });
        }
        for way in ways {
            connections.push(connect(plan, node, corner.from, way, draft));
        }
    }
    draft.junctions.push(JunctionDraft {
        id: junction_id(node),
        connections,
        controllers: Vec::new(),
    });
    let waiting = priority::waiting(control, &arms);
    let corners_before = corners.iter().cycle().skip(corners.len().saturating_sub(1));
    for ((arm, after), before) in arms.iter().zip(&corners).zip(corners_before) {
        if before.has_sidewalk() && after.has_sidewalk() {
            paint_crosswalk(arm, draft);
        }
        let waits = waiting.iter().any(|(other, _)| other.street == arm.street);
        if waits {
            paint_stop_line(arm, draft);
        }
    }
    priority::rule(control, node, &arms, draft);
}

/// A way through a junction, as it will be written.
struct Way {
    to: Arm,
    pieces: Vec<Piece>,
    lanes: Vec<LaneDraft>,
}

/// Lanes of one movement, with shoulder and sidewalk where it leads around the corner. Where its
/// lanes do not count from 1, lanes without width come before them.
fn driving_way(corner: &Corner, movement: &Movement, town: &TownDraft) -> Way {
    let (from_sign, to_sign) = (movement.from.inbound_sign(), -movement.to.inbound_sign());
    let lane = |side: Option<Side>, driving| side.map_or(driving, |side| side.lane_number(driving));
    let first = movement.first_number();
    let driving = (1..=movement.lanes).map(|number| LaneDraft {
        id: 1 - first - number,
        kind: LaneKind::Driving,
        widths: vec![Cubic::flat(0.0, LANE_M)],
        line: LineKind::None,
        predecessor: Some(
            from_sign * lane(movement.from.inbound(), movement.from_lane + number - 1),
        ),
        successor: Some(to_sign * lane(movement.to.outbound(), movement.to_lane + number - 1)),
    });
    let mut lanes: Vec<LaneDraft> =
        (1..first).map(LaneDraft::without_width).chain(driving).collect();
    let pieces = pieces(movement);
    if movement.at_kerb {
        lanes.extend(corner.lanes(first + movement.lanes, length_m(&pieces), town));
    }
    Way { to: movement.to, pieces, lanes }
}

/// Adds the connecting road of a way.
fn connect(
    plan: &Plan,
    node: usize,
    from: Arm,
    way: Way,
    draft: &mut TownDraft,
) -> ConnectionDraft {
    let id = next_connecting_id(plan, draft);
    let linked = |lane: &LaneDraft| lane.predecessor.map(|incoming| (incoming, lane.id));
    let lanes = way.lanes.iter().filter_map(linked).collect();
    draft.roads.push(RoadDraft {
        id,
        junction: Some(junction_id(node)),
        limit_kmh: from.profile.limit_kmh,
        predecessor: LinkTo::Road { id: from.street, at_end: from.ends_here },
        successor: LinkTo::Road { id: way.to.street, at_end: way.to.ends_here },
        pieces: way.pieces,
        rises: vec![Cubic::flat(0.0, plan.height_m(node))],
        centre_line: false,
        sections: vec![SectionDraft { start_s: 0.0, lanes: way.lanes }],
        objects: Vec::new(),
        signals: Vec::new(),
        held_by: None,
    });
    ConnectionDraft { incoming: from.street, connecting: id, lanes }
}

/// The least id above those of all connecting roads so far that is no named way's.
fn next_connecting_id(plan: &Plan, draft: &TownDraft) -> u32 {
    let before = draft.roads.get(plan.streets.len()..).and_then(<[RoadDraft]>::last);
    let mut id = before.map_or(CONNECTING_ID_FIRST, |road| road.id + 1);
    while plan.named.iter().any(|way| way.number == id) {
        id += 1;
    }
    id
}

/// The left border of the movement's first lane.
fn pieces(movement: &Movement) -> Vec<Piece> {
    let border_m = |side: Option<Side>, lane: i32| {
        -side.map_or(0.0, |side| side.median_m) - f64::from(lane - 1) * LANE_M
    };
    let [from, to] = [movement.from.inbound(), movement.to.outbound()];
    let start = movement.from.entering().left(border_m(from, movement.from_lane));
    let end = movement.to.pose.left(border_m(to, movement.to_lane));
    join(start, end)
}

/// The crosswalk over an arm, from the sidewalk of one corner to that of the other.
fn paint_crosswalk(arm: &Arm, draft: &mut TownDraft) {
    let Some(street) = draft.road_mut(arm.street) else { return };
    let reach_m = |side: Option<Side>| side.map_or(0.0, Side::kerb_m) + CROSSWALK_OVERLAP_M;
    let across = [-reach_m(Some(arm.profile.right)), reach_m(arm.profile.left)];
    let length_m = street.length_m();
    let crosswalk = flat(arm, length_m, "crosswalk", "SimpleCrosswalk", CROSSWALK_M, across);
    street.objects.push(crosswalk);
}

fn paint_stop_line(arm: &Arm, draft: &mut TownDraft) {
    let Some(street) = draft.road_mut(arm.street) else { return };
    let Some(side) = arm.inbound() else { return };
    let sign = f64::from(arm.inbound_sign());
    let [inner_m, outer_m] = side.driving_m().map(|across_m| sign * across_m);
    let across = [inner_m.min(outer_m), inner_m.max(outer_m)];
    let along = [-1.0 - STOP_LINE_M, -1.0];
    street.objects.push(flat(arm, street.length_m(), "roadMark", "StopLine", along, across));
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
