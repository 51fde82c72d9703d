//! Junctions: one connecting road per approach and exit, crosswalks and stop lines.

use super::draft::{
    ConnectionDraft, JunctionDraft, LaneDraft, LaneKind, LineKind, LinkTo, ObjectDraft, Piece,
    RoadDraft, TownDraft,
};
use super::plan::{Arm, Compass, GUTTER_M, LANE_M, Plan, SIDEWALK_M};
use super::street::{ahead, distance};

/// Ids of junctions start here, above those of all streets and connecting roads.
const JUNCTION_ID_FIRST: u32 = 10_000;
/// Ids of connecting roads start here, above those of all streets.
const CONNECTING_ID_FIRST: u32 = 1_000;
/// Crosswalks lie between these distances inside the junction, in metres.
const CROSSWALK_M: [f64; 2] = [0.7, 3.7];
/// How far crosswalks reach onto the sidewalks, so that walkers step onto them, in metres.
const CROSSWALK_OVERLAP_M: f64 = 1.5;
/// Width of stop lines, in metres.
const STOP_LINE_M: f64 = 0.4;

/// The OpenDRIVE id of a junction of the plan.
pub(super) fn junction_id(node: usize) -> u32 {
    JUNCTION_ID_FIRST + u32::try_from(node).unwrap_or(0)
}

/// A way through a junction, for neighbouring lanes counted from the middle outward, from 1.
struct Movement {
    from: Arm,
    to: Arm,
    from_lane: i32,
    to_lane: i32,
    lanes: i32,
    /// Whether gutter and sidewalk run along its right side.
    at_kerb: bool,
}

/// Adds the roads and crosswalks of one junction.
pub(super) fn build(plan: &Plan, node: usize, draft: &mut TownDraft) {
    let arms = plan.arms(node);
    let mut connections = Vec::new();
    for from in &arms {
        for movement in movements(&arms, *from) {
            let connecting_before = draft.roads.iter().filter(|r| r.junction.is_some()).count();
            let id = CONNECTING_ID_FIRST + u32::try_from(connecting_before).unwrap_or(0);
            let road = connecting_road(plan, node, &movement, id);
            connections.push(ConnectionDraft {
                incoming: from.street,
                connecting: id,
                lanes: road
                    .lanes
                    .iter()
                    .filter_map(|lane| lane.predecessor.map(|incoming| (incoming, lane.id)))
                    .collect(),
            });
            draft.roads.push(road);
        }
    }
    for arm in &arms {
        if let Some(street) = draft.roads.iter_mut().find(|road| road.id == arm.street) {
            let length_m = street.length_m();
            street.objects.push(crosswalk(*arm, length_m));
            street.objects.push(stop_line(*arm, length_m));
        }
    }
    draft.junctions.push(JunctionDraft { id: junction_id(node), connections });
}

/// Which lanes of an approach lead where.
///
/// The inner lane turns left or goes straight, the outer one right or straight. A street that ends
/// here sends all but its outer lane left; a street that begins here takes all but its outer lane
/// from the left turn, so that each of its lanes can be reached.
fn movements(arms: &[Arm], from: Arm) -> Vec<Movement> {
    let heading = from.leaving.opposite();
    let arm = |leaving: Compass| arms.iter().find(|arm| arm.leaving == leaving).copied();
    let (left, straight, right) = (arm(heading.left()), arm(heading), arm(heading.right()));
    let begins_here = |to: Arm| arm(to.leaving.opposite()).is_none();
    let count = from.profile.lanes();
    let left_lanes = left.map_or(0, |to| {
        let wanted = match (begins_here(to), straight) {
            (true, _) => to.profile.lanes() - 1,
            (false, None) => count - 1,
            (false, Some(_)) => 1,
        };
        wanted.min(count).min(to.profile.lanes())
    });
    let left = left.map(|to| Movement {
        from,
        to,
        from_lane: 1,
        to_lane: 1,
        lanes: left_lanes,
        at_kerb: false,
    });
    let at_kerb = right.is_none();
    let straight = straight.map(|to| {
        let first = left_lanes.max(1);
        Movement { from, to, from_lane: first, to_lane: first, lanes: count - first + 1, at_kerb }
    });
    let right = right.map(|to| Movement {
        from,
        to,
        from_lane: count,
        to_lane: to.profile.lanes(),
        lanes: 1,
        at_kerb: true,
    });
    [left, straight, right].into_iter().flatten().collect()
}

fn connecting_road(plan: &Plan, node: usize, movement: &Movement, id: u32) -> RoadDraft {
    let Movement { from, to, .. } = *movement;
    // Approaching traffic uses negative lanes where the street's reference line ends here.
    let from_sign = if from.ends_here { -1 } else { 1 };
    let to_sign = if to.ends_here { 1 } else { -1 };
    let lane = |number: i32, kind, width_m, line| LaneDraft {
        id: -number,
        kind,
        width_m,
        line,
        predecessor: Some(from_sign * (movement.from_lane + number - 1)),
        successor: Some(to_sign * (movement.to_lane + number - 1)),
    };
    let mut lanes: Vec<LaneDraft> = (1..=movement.lanes)
        .map(|number| lane(number, LaneKind::Driving, LANE_M, LineKind::None))
        .collect();
    if movement.at_kerb {
        let next = movement.lanes + 1;
        lanes.push(lane(next, LaneKind::Shoulder, GUTTER_M, LineKind::Kerb));
        lanes.push(lane(next + 1, LaneKind::Sidewalk, SIDEWALK_M, LineKind::None));
    }
    RoadDraft {
        id,
        junction: Some(junction_id(node)),
        limit_kmh: from.profile.limit_kmh(),
        predecessor: LinkTo::Road { id: from.street, at_end: from.ends_here },
        successor: LinkTo::Road { id: to.street, at_end: to.ends_here },
        pieces: pieces(plan, node, movement),
        centre_line: false,
        lanes,
        objects: Vec::new(),
    }
}

/// The left border of the movement's first lane: a line, or an arc with a line before or after it.
fn pieces(plan: &Plan, node: usize, movement: &Movement) -> Vec<Piece> {
    let reach_m = plan.reach_m(node);
    let middle = plan.at(node);
    let (inward, outward) = (movement.from.leaving.opposite(), movement.to.leaving);
    let border = |lane: i32| f64::from(lane - 1) * LANE_M;
    let (from_m, to_m) = (border(movement.from_lane), border(movement.to_lane));
    let start = ahead(ahead(middle, inward.unit(), -reach_m), inward.right().unit(), from_m);
    let end = ahead(ahead(middle, outward.unit(), reach_m), outward.right().unit(), to_m);
    let line = |at: [f64; 2], heading: Compass, length_m: f64| Piece {
        x: at[0],
        y: at[1],
        heading_rad: heading.heading_rad(),
        length_m,
        curvature: 0.0,
    };
    if inward == outward {
        return vec![line(start, inward, distance(start, end))];
    }
    // Both tangents meet in a corner; the arc takes the shorter of them whole.
    let turn = if inward.left() == outward { 1.0 } else { -1.0 };
    let (before_m, after_m) = (reach_m + turn * to_m, reach_m + turn * from_m);
    let radius_m = before_m.min(after_m);
    let arc_start = ahead(start, inward.unit(), before_m - radius_m);
    let arc_end = ahead(end, outward.unit(), radius_m - after_m);
    let arc = Piece {
        x: arc_start[0],
        y: arc_start[1],
        heading_rad: inward.heading_rad(),
        length_m: radius_m * std::f64::consts::FRAC_PI_2,
        curvature: turn / radius_m,
    };
    [line(start, inward, before_m - radius_m), arc, line(arc_end, outward, after_m - radius_m)]
        .into_iter()
        .filter(|piece| piece.length_m > 0.01)
        .collect()
}

fn crosswalk(arm: Arm, street_length_m: f64) -> ObjectDraft {
    let half_m = arm.profile.kerb_m() + CROSSWALK_OVERLAP_M;
    let [near, far] = CROSSWALK_M;
    flat(arm, street_length_m, "crosswalk", "SimpleCrosswalk", [near, far], [-half_m, half_m])
}

fn stop_line(arm: Arm, street_length_m: f64) -> ObjectDraft {
    // Approaching traffic keeps to the right of the reference line where that ends here.
    let across_m = f64::from(arm.profile.lanes()) * LANE_M;
    let across = if arm.ends_here { [-across_m, 0.0] } else { [0.0, across_m] };
    flat(arm, street_length_m, "roadMark", "StopLine", [-1.0 - STOP_LINE_M, -1.0], across)
}

/// A rectangle on the ground at a street's end; `along` counts into the junction.
fn flat(
    arm: Arm,
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
