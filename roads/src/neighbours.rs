//! Lanes beside a lane, the lines between them, and who may cross those.

use crate::kinds::{LaneChange, LaneType};
use crate::model::{Mark, MarkChange, Model, Road, Section};
use crate::place::{LaneInfo, LaneMark, Waypoint};

/// A side of the traffic on a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
}

fn section_of<'m>(model: &'m Model, waypoint: &Waypoint) -> Option<(&'m Road, &'m Section)> {
    let road = model.road(waypoint.road)?;
    Some((road, road.sections.get(waypoint.section as usize)?))
}

pub(crate) fn neighbour(model: &Model, waypoint: &Waypoint, side: Side) -> Option<Waypoint> {
    let (road, section) = section_of(model, waypoint)?;
    let id = waypoint.lane;
    let outward = (side == Side::Right) != road.left_hand;
    let lane = match (id, outward) {
        (0, _) => return None,
        (1, false) => -1,
        (-1, false) => 1,
        (id, true) => id.checked_add(id.signum())?,
        (id, false) => id - id.signum(),
    };
    section.lane(lane)?;
    Some(Waypoint { lane, ..*waypoint })
}

pub(crate) fn same_direction_driving(
    model: &Model,
    waypoint: &Waypoint,
    side: Side,
) -> Option<Waypoint> {
    let beside = neighbour(model, waypoint, side)?;
    let (_, section) = section_of(model, waypoint)?;
    let driving = section.lane(beside.lane)?.lane_type == LaneType::Driving;
    (driving && beside.lane.signum() == waypoint.lane.signum()).then_some(beside)
}

pub(crate) fn lane_info(model: &Model, waypoint: &Waypoint) -> LaneInfo {
    let mut info = LaneInfo {
        lane_type: LaneType::None,
        width_m: 0.0,
        is_right_hand_traffic: true,
        is_junction: false,
        junction_id: None,
        speed_limit_mps: None,
        left_mark: None,
        right_mark: None,
        lane_change: LaneChange::None,
    };
    let Some((road, section)) = section_of(model, waypoint) else { return info };
    let Some(lane) = section.lane(waypoint.lane) else { return info };
    let inner_id = waypoint.lane - waypoint.lane.signum();
    let own = lane.mark(waypoint.s);
    let inner = section.lane(inner_id).and_then(|lane| lane.mark(waypoint.s));
    let seen = |mark: Option<&Mark>| mark.map(|mark| lane_mark(mark, road.left_hand));
    info.lane_type = lane.lane_type;
    info.width_m = lane.width.value(waypoint.s);
    info.is_right_hand_traffic = !road.left_hand;
    info.is_junction = road.junction.is_some();
    info.junction_id = road.junction.and_then(|id| u32::try_from(id).ok());
    info.speed_limit_mps = road.speed_limit_mps(waypoint.s);
    let (outward, inward) = permissions(road.left_hand, waypoint.lane, own, inner);
    if road.left_hand {
        (info.left_mark, info.right_mark) = (seen(own), seen(inner));
        info.lane_change = LaneChange::from_sides(inward, outward);
    } else {
        (info.left_mark, info.right_mark) = (seen(inner), seen(own));
        info.lane_change = LaneChange::from_sides(outward, inward);
    }
    info
}

fn lane_mark(mark: &Mark, left_hand: bool) -> LaneMark {
    let lane_change = match (mark.change, left_hand) {
        (MarkChange::Both, _) => LaneChange::Both,
        (MarkChange::None, _) => LaneChange::None,
        (MarkChange::Increase, false) | (MarkChange::Decrease, true) => LaneChange::Right,
        (MarkChange::Decrease, false) | (MarkChange::Increase, true) => LaneChange::Left,
    };
    LaneMark { mark_type: mark.mark_type, color: mark.color, lane_change, width_m: mark.width_m }
}

/// Permission to leave outward and inward. The asymmetries are the client library's.
fn permissions(
    left_hand: bool,
    lane: i32,
    own: Option<&Mark>,
    inner: Option<&Mark>,
) -> (bool, bool) {
    let permits = |mark: Option<&Mark>, direction: MarkChange| {
        mark.is_none_or(|mark| mark.change == MarkChange::Both || mark.change == direction)
    };
    let (outward, inward) = match (left_hand, lane < 0) {
        (false, true) if lane == -1 => (MarkChange::Increase, MarkChange::Decrease),
        (false, true) => (MarkChange::Increase, MarkChange::Increase),
        (false, false) => (MarkChange::Decrease, MarkChange::Decrease),
        (true, true) => (MarkChange::Increase, MarkChange::Decrease),
        (true, false) => (MarkChange::Decrease, MarkChange::Increase),
    };
    (permits(own, outward), permits(inner, inward))
}
