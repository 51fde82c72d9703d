//! Streets between junctions.

use super::draft::{LaneDraft, LaneKind, LineKind, LinkTo, Piece, RoadDraft};
use super::junction::junction_id;
use super::plan::{CORNER_RADIUS_M, GUTTER_M, LANE_M, Plan, Profile, SIDEWALK_M, Street};

/// The road of one street.
pub(super) fn road(plan: &Plan, street: &Street) -> RoadDraft {
    let mut lanes = side(street.profile, 1);
    lanes.extend(side(street.profile, -1));
    RoadDraft {
        id: street.id,
        junction: None,
        limit_kmh: street.profile.limit_kmh(),
        predecessor: LinkTo::Junction(junction_id(street.from.node)),
        successor: LinkTo::Junction(junction_id(street.to.node)),
        pieces: pieces(plan, street),
        centre_line: true,
        lanes,
        objects: Vec::new(),
    }
}

/// The lanes of one side, from the middle outward.
fn side(profile: Profile, sign: i32) -> Vec<LaneDraft> {
    let lanes = profile.lanes();
    let lane = |number: i32, kind, width_m, line| LaneDraft {
        id: sign * number,
        kind,
        width_m,
        line,
        predecessor: None,
        successor: None,
    };
    (1..=lanes)
        .map(|number| {
            let line = if number < lanes { LineKind::Broken } else { LineKind::Solid };
            lane(number, LaneKind::Driving, LANE_M, line)
        })
        .chain([
            lane(lanes + 1, LaneKind::Shoulder, GUTTER_M, LineKind::Kerb),
            lane(lanes + 2, LaneKind::Sidewalk, SIDEWALK_M, LineKind::None),
        ])
        .collect()
}

fn pieces(plan: &Plan, street: &Street) -> Vec<Piece> {
    let start = ahead(
        plan.at(street.from.node),
        street.from.leaving.unit(),
        plan.reach_m(street.from.node),
    );
    let end =
        ahead(plan.at(street.to.node), street.to.leaving.unit(), plan.reach_m(street.to.node));
    let first = street.from.leaving;
    let line = |from: [f64; 2], to: [f64; 2], heading_rad| Piece {
        x: from[0],
        y: from[1],
        heading_rad,
        length_m: distance(from, to),
        curvature: 0.0,
    };
    let Some(corner) = street.corner else {
        return vec![line(start, end, first.heading_rad())];
    };
    let second = street.to.leaving.opposite();
    let arc_start = ahead(corner, first.unit(), -CORNER_RADIUS_M);
    let arc_end = ahead(corner, second.unit(), CORNER_RADIUS_M);
    let turn = if first.left() == second { 1.0 } else { -1.0 };
    vec![
        line(start, arc_start, first.heading_rad()),
        Piece {
            x: arc_start[0],
            y: arc_start[1],
            heading_rad: first.heading_rad(),
            length_m: CORNER_RADIUS_M * std::f64::consts::FRAC_PI_2,
            curvature: turn / CORNER_RADIUS_M,
        },
        line(arc_end, end, second.heading_rad()),
    ]
}

pub(super) fn ahead(from: [f64; 2], unit: [f64; 2], distance_m: f64) -> [f64; 2] {
    [from[0] + unit[0] * distance_m, from[1] + unit[1] * distance_m]
}

pub(super) fn distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}
