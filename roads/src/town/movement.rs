//! Which lanes of an approach lead where.

use super::course::signed;
use super::plan::{Arm, Control, SAME_WAY_RAD, same_way};
use super::profile::LANE_M;

/// Roads of one direction that turn by less go on with the lanes that lie ahead, in radians.
const AHEAD_RAD: f64 = 0.1;

/// A way through a junction, for neighbouring lanes counted from the middle outward, from 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Movement {
    pub(super) from: Arm,
    pub(super) to: Arm,
    pub(super) from_lane: i32,
    pub(super) to_lane: i32,
    pub(super) lanes: i32,
    /// Whether gutter and sidewalk run along its right side.
    pub(super) at_kerb: bool,
}

/// The ways from each arm (counter-clockwise) to the others, so that each lane of a street that
/// leads away can be reached.
pub(super) fn all_movements(control: Control, arms: &[Arm]) -> Vec<Vec<Movement>> {
    let of = |index| movements(arms, index, &exits(control, arms, index));
    let mut all: Vec<_> = (0..arms.len()).map(of).collect();
    for exit in arms {
        for lane in 1..=exit.lanes_out() {
            fork_to(&mut all, exit, lane);
        }
    }
    all
}

/// Adds a fork of the straightest way to the nearest lane of an exit, where ways lead to the exit
/// but none to the lane. The outer one of both runs along the kerb.
fn fork_to(all: &mut [Vec<Movement>], exit: &Arm, lane: i32) {
    let ways = all.iter_mut().enumerate().flat_map(|(index, ways)| {
        ways.iter_mut().filter(|way| way.to.street == exit.street).map(move |way| (index, way))
    });
    let nearest = ways.min_by(|(_, a), (_, b)| {
        let off = |way: &Movement| (way.nearest_to(lane) - lane).abs();
        let turn_rad = |way: &Movement| way.turn_rad().abs();
        off(a).cmp(&off(b)).then(turn_rad(a).total_cmp(&turn_rad(b)))
    });
    let Some((index, nearest)) = nearest else { return };
    let to_lane = nearest.nearest_to(lane);
    if to_lane == lane {
        return;
    }
    let at_kerb = nearest.at_kerb && lane > to_lane;
    nearest.at_kerb &= !at_kerb;
    let from_lane = nearest.from_lane + to_lane - nearest.to_lane;
    let fork = Movement { from_lane, to_lane: lane, lanes: 1, at_kerb, ..*nearest };
    all[index].push(fork);
}

impl Movement {
    /// Which of the lanes that it leads to is nearest to a lane.
    fn nearest_to(&self, lane: i32) -> i32 {
        lane.clamp(self.to_lane, self.to_lane + self.lanes - 1)
    }

    fn turn_rad(&self) -> f64 {
        signed(self.to.pose.heading_rad - self.from.entering().heading_rad)
    }

    /// The number of the way's first lane, counted outward from 1. Who goes straight on keeps the
    /// number of the lane, as on CARLA's maps; ways that turn count from 1.
    pub(super) fn first_number(&self) -> i32 {
        let is_straight = self.turn_rad().abs() < SAME_WAY_RAD;
        let kept = self.from.inbound().filter(|_| is_straight);
        kept.map_or(1, |side| side.lane_number(self.from_lane))
    }
}

/// Where one may go from an arm, and the angle by which one turns to the left, in radians. A
/// divided road is crossed where there are lights, and else only left and joined to the right.
fn exits(control: Control, arms: &[Arm], index: usize) -> Vec<(&Arm, f64)> {
    let Some(from) = arms.get(index) else { return Vec::new() };
    let is_divided = arms.iter().any(|arm| arm.profile.right.median_m > 0.0);
    let may_cross = control == Control::Lights || !is_divided;
    arms.iter()
        .enumerate()
        .filter(|(other, to)| *other != index && to.lanes_out() > 0)
        .map(|(_, to)| (to, signed(to.pose.heading_rad - from.entering().heading_rad)))
        .filter(|(_, turn_rad)| may_cross || *turn_rad < SAME_WAY_RAD)
        .collect()
}

/// The ways from one arm, which is one of `arms` (counter-clockwise), to its exits.
///
/// The inner lane turns left or goes straight, the outer one right or straight; where none leads
/// right and fewer lanes go straight, it is the outer ones. A street that ends here sends all but
/// its outer lane left; a street that begins here takes all but its outer lane from the left turn,
/// so that each of its lanes can be reached. What joins from the right takes the outer lanes, a
/// road of one direction that joins from the left the inner ones. On the ring of a roundabout all
/// lanes lead out and only the inner one on, so that nobody goes around for ever and nobody leaves
/// across another's way.
fn movements(arms: &[Arm], index: usize, exits: &[(&Arm, f64)]) -> Vec<Movement> {
    let Some(from) = arms.get(index).filter(|arm| arm.lanes_in() > 0) else { return Vec::new() };
    let count = from.lanes_in();
    let next = arms.get((index + 1) % arms.len()).map(|arm| arm.street);
    let way = |to: &Arm, from_lane, to_lane, lanes| Movement {
        from: *from,
        to: *to,
        from_lane,
        to_lane,
        lanes,
        at_kerb: next == Some(to.street),
    };
    if let [(to, _)] = exits {
        let lanes = count.min(to.lanes_out());
        let outer = to.lanes_out() - lanes;
        let beside = lanes_beside(from, to).map_or(outer, |lanes| (-lanes).clamp(0, outer));
        return vec![way(to, 1, 1 + beside, lanes)];
    }
    let straight = exits
        .iter()
        .filter(|(_, turn_rad)| turn_rad.abs() < SAME_WAY_RAD)
        .min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let middle_rad = straight.map_or(0.0, |(_, turn_rad)| *turn_rad);
    let left = exits.iter().find(|(_, turn_rad)| *turn_rad > middle_rad).map(|(to, _)| *to);
    let right = exits.iter().rfind(|(_, turn_rad)| *turn_rad < middle_rad).map(|(to, _)| *to);
    let straight = straight.map(|(to, _)| *to);
    let ahead = straight.and_then(|to| lanes_ahead(from, to));
    let goes_around = left.is_none() && ahead.is_none() && goes_around(from, straight, right);

    let left = left.map(|to| {
        let wanted = match straight {
            _ if begins_here(arms, to) => to.lanes_out() - 1,
            None => count - 1,
            Some(_) => 1,
        };
        way(to, 1, 1, wanted.min(count).min(to.lanes_out()).max(1))
    });
    let straight = straight.map(|to| {
        if let Some([first, to_lane, lanes]) = ahead {
            return way(to, first, to_lane, lanes);
        }
        let first = left.as_ref().map_or(1, |left| left.lanes);
        let to_lane = first.min(to.lanes_out());
        let lanes = (count - first + 1).min(to.lanes_out() - to_lane + 1);
        // Where the street gets narrower and none leads right, inner lanes only lead left.
        let first = if right.is_none() { first.max(count - lanes + 1) } else { first };
        way(to, first, to_lane, if goes_around { 1 } else { lanes })
    });
    let right = right.map(|to| {
        let served = straight.or(left).map_or(0, |other| other.from_lane + other.lanes - 1);
        let lanes = if goes_around { count } else { (count - served).max(1) };
        let lanes = lanes.min(to.lanes_out());
        way(to, count - lanes + 1, to.lanes_out() - lanes + 1, lanes)
    });
    [left, straight, right].into_iter().flatten().collect()
}

/// How many lanes an approach's inner lane lies left of an exit's, both of one direction.
fn lanes_beside(from: &Arm, to: &Arm) -> Option<i32> {
    let [_, left_m] = to.pose.local(from.pose.at);
    #[allow(clippy::cast_possible_truncation, reason = "roads have few lanes")]
    let lanes = (left_m / LANE_M).round() as i32;
    (from.one_way() && to.one_way()).then_some(lanes)
}

/// The lanes of a road of one direction that lie ahead of another's: from which, to which, how
/// many.
fn lanes_ahead(from: &Arm, to: &Arm) -> Option<[i32; 3]> {
    let turn_rad = signed(to.pose.heading_rad - from.entering().heading_rad);
    let beside = lanes_beside(from, to).filter(|_| turn_rad.abs() < AHEAD_RAD)?;
    let [first, to_lane] = [beside, -beside].map(|lanes| 1 + lanes.max(0));
    let lanes = (from.lanes_in() - first).min(to.lanes_out() - to_lane) + 1;
    (lanes > 0).then_some([first, to_lane, lanes])
}

/// Whether an approach is part of a roundabout's ring: one way, as what goes on, around a bend,
/// with a street of both directions to the right.
fn goes_around(from: &Arm, straight: Option<&Arm>, right: Option<&Arm>) -> bool {
    straight
        .zip(right)
        .is_some_and(|(straight, right)| from.one_way() && straight.one_way() && !right.one_way())
}

/// Whether no traffic comes straight into this exit.
fn begins_here(arms: &[Arm], exit: &Arm) -> bool {
    !arms.iter().any(|arm| {
        arm.lanes_in() > 0 && same_way(arm.entering().heading_rad, exit.pose.heading_rad)
    })
}
