//! Which ways through a junction come near each other.

use std::collections::BTreeMap;

use schemas::Vec3;

use super::{Conflict, Lane, LaneId, LanePoint, Network};

/// Vehicles on lanes whose middles come nearer than this would touch, in metres.
const NEAR_M: f32 = 2.7;
/// No car turns more tightly. Who comes out of a tighter bend is beside its lane, by so much at
/// most.
const CURVATURE_PER_M_MAX: f32 = 0.2;
const BESIDE_M_MAX: f32 = 2.0;
/// Half the length of a car. Its corners swing out of a bend by curvature · half length² / 2.
const HALF_M: f32 = 2.3;
/// Lanes higher or lower than this cross without meeting.
const STOREY_M: f32 = 3.0;

/// Finds the conflicts of all lanes of junctions. Lanes that part at their beginning do not count:
/// there, one vehicle follows the other.
pub(super) fn find(network: &mut Network) {
    let mut by_junction: BTreeMap<u32, Vec<LaneId>> = BTreeMap::new();
    for (id, lane) in (0..).zip(&network.lanes) {
        if let Some(junction) = lane.junction {
            by_junction.entry(junction).or_default().push(id);
        }
    }
    let mut found: Vec<(LaneId, Conflict)> = Vec::new();
    for lanes in by_junction.values() {
        for (index, a) in lanes.iter().enumerate() {
            for b in lanes.iter().skip(index + 1) {
                let met = network.lane(*a).zip(network.lane(*b)).and_then(|(a, b)| meet(a, b));
                let Some([(from_a_m, until_a_m), (from_b_m, until_b_m)]) = met else { continue };
                found.push((*a, Conflict { lane: *b, from_m: from_a_m, until_m: until_a_m }));
                found.push((*b, Conflict { lane: *a, from_m: from_b_m, until_m: until_b_m }));
            }
        }
    }
    for (lane, conflict) in found {
        if let Some(lane) = network.lanes.get_mut(lane as usize) {
            lane.conflicts.push(conflict);
        }
    }
    for lane in &mut network.lanes {
        lane.conflicts.sort_unstable_by_key(|conflict| conflict.lane);
    }
}

/// Where on each of two lanes the other one comes near and is left behind, if they meet.
fn meet(a: &Lane, b: &Lane) -> Option<[(f32, f32); 2]> {
    let parts = a.previous.iter().any(|before| b.previous.contains(before));
    let follows = a.next.iter().any(|next| b.previous.is_empty() && b.next.contains(next));
    if parts && !follows {
        return None;
    }
    let [beside_a, beside_b] = [a, b].map(Beside::of);
    let mut met: Option<[(f32, f32); 2]> = None;
    for from in &a.points {
        for to in &b.points {
            let apart = from.point_m - to.point_m;
            // Most are far from each other.
            if apart.xy().norm_squared() > (NEAR_M + BESIDE_M_MAX).powi(2) {
                continue;
            }
            let beside_m = beside_a.at_m(from.at_m).max(beside_b.at_m(to.at_m));
            let swing_m = swing_m(from, &-apart) + swing_m(to, &apart);
            let near_m = NEAR_M + beside_m.max(swing_m);
            if apart.xy().norm_squared() < near_m * near_m && apart.z.abs() < STOREY_M {
                let here = [(from.at_m, from.at_m), (to.at_m, to.at_m)];
                let [on_a, on_b] = met.unwrap_or(here);
                met = Some([widened(on_a, from.at_m), widened(on_b, to.at_m)]);
            }
        }
    }
    met
}

/// How far the corners of a car swing out of its lane towards what lies in a direction.
fn swing_m(at: &LanePoint, towards: &Vec3) -> f32 {
    let along = at.heading();
    let outwards = (along.x * towards.y - along.y * towards.x) * at.curvature_per_m < 0.0;
    let bend_per_m = at.curvature_per_m.abs().min(CURVATURE_PER_M_MAX);
    if outwards { bend_per_m * HALF_M * HALF_M / 2.0 } else { 0.0 }
}

/// How far vehicles come to be beside a lane that bends more tightly than they turn.
struct Beside {
    /// Where that begins; endless if it does nowhere.
    from_m: f32,
    away_m: f32,
}

impl Beside {
    /// They head off the lane by what they turn less than it, and turn back as tightly as they can.
    fn of(lane: &Lane) -> Self {
        let mut found = Self { from_m: f32::INFINITY, away_m: 0.0 };
        let mut off_rad = 0.0_f32;
        for pair in lane.points.windows(2) {
            let [at, next] = pair else { continue };
            let step_m = next.at_m - at.at_m;
            let bend_per_m = f32::midpoint(at.curvature_per_m.abs(), next.curvature_per_m.abs());
            if bend_per_m > CURVATURE_PER_M_MAX {
                found.from_m = found.from_m.min(at.at_m);
            }
            let before_rad = off_rad;
            off_rad = (off_rad + (bend_per_m - CURVATURE_PER_M_MAX) * step_m).max(0.0);
            let more_m = f32::midpoint(before_rad, off_rad) * step_m;
            found.away_m = (found.away_m + more_m).min(BESIDE_M_MAX);
        }
        found
    }

    fn at_m(&self, at_m: f32) -> f32 {
        if at_m >= self.from_m { self.away_m } else { 0.0 }
    }
}

fn widened((from_m, until_m): (f32, f32), at_m: f32) -> (f32, f32) {
    (from_m.min(at_m), until_m.max(at_m))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lane straight ahead, as far to the left as said, that bends so much from 10 m on.
    fn lane(left_m: f32, curvature_per_m: f32, length_m: f32) -> Lane {
        let point = |at_m: f32| LanePoint {
            at_m,
            point_m: Vec3::new(at_m, left_m, 0.0),
            heading_rad: 0.0,
            curvature_per_m: if at_m < 10.0 { 0.0 } else { curvature_per_m },
            limit_mps: 0.0,
            width_m: 3.5,
        };
        let points = (0..=(length_m / 2.0) as u16).map(|step| point(2.0 * f32::from(step)));
        Lane { points: points.collect(), ..Lane::default() }
    }

    #[test]
    fn who_comes_out_of_a_bend_too_tight_for_cars_may_be_on_the_lane_beside() {
        let beside = |left_m| lane(left_m, 0.0, 16.0);
        assert_eq!(meet(&lane(0.0, 0.19, 16.0), &beside(3.5)), None);
        // 0.05 rad/m too tight for 6 m: half of 0.05 · 6² m.
        let tight = lane(0.0, 0.25, 16.0);
        assert_eq!(meet(&tight, &beside(3.5)), Some([(10.0, 16.0), (10.0, 16.0)]));
        assert_eq!(meet(&tight, &beside(3.65)), None);
        // Three times as much too tight, and 2 m away at most.
        let tighter = lane(0.0, 0.35, 16.0);
        assert_eq!(meet(&tighter, &beside(4.5)), Some([(10.0, 16.0), (10.0, 16.0)]));
        assert_eq!(meet(&tighter, &beside(4.75)), None);
        // Lanes are drawn with bends of no length.
        let drawn = Lane { points: lane(0.0, 0.35, 10.0).points, ..Lane::default() };
        assert_eq!(meet(&drawn, &lane(3.0, 0.0, 10.0)), None);
    }

    /// Two ways about 3 m apart, as of two who turn left from opposite sides.
    #[test]
    fn who_turn_away_from_each_other_swing_towards_each_other() {
        let bent = |left_m, curvature_per_m| lane(left_m, curvature_per_m, 16.0);
        assert_eq!(meet(&bent(3.0, 0.1), &bent(0.0, -0.1)), Some([(10.0, 16.0); 2]));
        assert_eq!(meet(&bent(3.0, -0.1), &bent(0.0, 0.1)), None, "towards each other");
        assert_eq!(meet(&bent(3.0, 0.1), &bent(0.0, 0.1)), None, "beside each other");
    }
}
