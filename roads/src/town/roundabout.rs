//! A roundabout: a ring of one-way roads with a junction at every arm.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::course::{Bend, Pose};
use super::plan::{Beside, Control, End, Plan};
use super::profile::{Edge, LANE_M, Profile};

/// Lanes of the ring.
const LANES: i32 = 2;
/// Radius of the island, in metres.
const ISLAND_M: f64 = 20.0;
/// Half of the angle of the ring that belongs to an arm's junction.
const HALF_RAD: f64 = 0.42;
/// Distance of an arm's beginning from the ring's outer edge, in metres.
const ARM_GAP_M: f64 = 12.0;

/// Builds a roundabout around a place and returns the ends of its arms, in the order of
/// `leaving_rad` (ascending), to connect streets to.
pub(super) fn build(plan: &mut Plan, middle: [f64; 2], leaving_rad: &[f64]) -> Vec<End> {
    let on_ring = |angle_rad: f64| Pose::new(middle, angle_rad).ahead(ISLAND_M);
    let nodes: Vec<usize> = leaving_rad
        .iter()
        .map(|angle_rad| plan.node_with(on_ring(*angle_rad).at, Control::Yield))
        .collect();
    let ring = Profile::one_way(LANES, Edge::Sidewalk, 30);
    let arms = nodes.iter().zip(leaving_rad);
    for (index, (node, angle_rad)) in arms.clone().enumerate() {
        let next = (index + 1) % nodes.len();
        let (Some(next_node), Some(next_rad)) = (nodes.get(next), leaving_rad.get(next)) else {
            continue;
        };
        let from_rad = angle_rad + HALF_RAD;
        let turn_rad = (next_rad - HALF_RAD - from_rad).rem_euclid(TAU);
        let start = on_ring(from_rad).turned(FRAC_PI_2);
        let end = on_ring(from_rad + turn_rad).turned(FRAC_PI_2);
        // The tangents at both ends meet outside of the middle of the arc.
        let corner =
            Pose::new(middle, from_rad + turn_rad / 2.0).ahead(ISLAND_M / (turn_rad / 2.0).cos());
        let bend = Bend { at: corner.at, radius_m: ISLAND_M };
        let ends = (End::at(*node, start), End::at(*next_node, end.reversed()));
        plan.connect(ends.0, ends.1, &[bend], ring).beside = Beside::Nothing;
    }
    let arm_m = ISLAND_M + f64::from(LANES) * LANE_M + ARM_GAP_M;
    arms.map(|(node, angle_rad)| End::at(*node, Pose::new(middle, *angle_rad).ahead(arm_m)))
        .collect()
}
