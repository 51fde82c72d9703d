//! Places in lanes for parked cars, and ways that end in them.

use agents::{Network, WayPoint};
use nalgebra::{ComplexField, Point3};
use roads::{LaneType, LaneTypes, Map};
use schemas::{Pose, Vec3};

use super::pairs::Place;

/// Way between the places that are looked at.
const APART_M: f32 = 8.0;
/// Where the lane must be as wide as a car, along the street from the place.
const ALONG_M: [f32; 5] = [-20.0, -10.0, 0.0, 5.0, 10.0];
const WIDTH_M_MIN: f64 = 2.1;
/// The lane runs as straight as this.
const ASIDE_M: f32 = 0.2;
/// Over how much of its end a way moves aside, and how much of that it goes straight on at last.
const ASIDE_OVER_M: f32 = 12.0;
const STRAIGHT_M: f32 = 2.5;

/// Places on driving lanes with room for a row of parked cars to their right.
pub(super) fn places(map: &Map, network: &Network) -> Vec<Place> {
    let found = network.places(APART_M).into_iter().filter_map(|pose| {
        let right_m = beside_m(map, &pose)?;
        Some(Place { pose, spot: network.spot(map, &pose)?, right_m })
    });
    found.collect()
}

/// How far to the right the middle of such a lane is.
fn beside_m(map: &Map, pose: &Pose) -> Option<f32> {
    let position_m = pose.translation.vector;
    let driving = map.nearest(Point3::from(position_m).cast(), LaneTypes::DRIVING)?;
    let lane = map.right(&driving).filter(|lane| is_wide(map, lane))?;
    let middle_m: Vec3 = map.pose(&lane).translation.vector.cast();
    let forward = pose.rotation * Vec3::x();
    let holds = |ahead_m: &f32| {
        let point_m = middle_m + forward * *ahead_m;
        let found = map.nearest(Point3::from(point_m).cast(), LaneType::Parking.into());
        found.filter(|found| is_wide(map, found)).is_some_and(|found| {
            let here_m: Vec3 = map.pose(&found).translation.vector.cast();
            (here_m - point_m).norm() < ASIDE_M
        })
    };
    let right_m = (middle_m - position_m).dot(&(pose.rotation * -Vec3::y()));
    (right_m > 0.0 && ALONG_M.iter().all(holds)).then_some(right_m)
}

fn is_wide(map: &Map, lane: &roads::Waypoint) -> bool {
    let lane = map.lane(lane);
    lane.lane_type == LaneType::Parking && lane.width_m >= WIDTH_M_MIN
}

/// Lets a way end so much to the right, along a polynomial without jumps of curvature.
pub(super) fn turn_in(points: &mut [WayPoint], right_m: f32) {
    let Some(end_m) = points.last().map(|point| point.at_m).filter(|_| right_m > 0.0) else {
        return;
    };
    let from_m = end_m - STRAIGHT_M - ASIDE_OVER_M;
    for point in points {
        let share = ((point.at_m - from_m) / ASIDE_OVER_M).clamp(0.0, 1.0);
        let rest = 1.0 - share;
        let square = share * share;
        let aside_m = right_m * square * share * (10.0 - 15.0 * share + 6.0 * square);
        let slope = right_m / ASIDE_OVER_M * 30.0 * square * rest * rest;
        let bend = 60.0 * share * rest * (rest - share);
        let (sin, cos) =
            (ComplexField::sin(point.heading_rad), ComplexField::cos(point.heading_rad));
        point.point_m += Vec3::new(sin, -cos, 0.0) * aside_m;
        point.heading_rad -= ComplexField::atan(slope);
        point.curvature_per_m -= right_m / (ASIDE_OVER_M * ASIDE_OVER_M) * bend;
    }
}

#[cfg(test)]
mod tests {
    use roads::Waypoint;

    use super::*;

    #[test]
    fn a_way_ends_aside_without_a_kink() {
        let on = Waypoint { road: 1, section: 0, lane: -1, s: 0.0 };
        let straight = |at: u8| WayPoint {
            at_m: f32::from(at),
            point_m: Vec3::new(f32::from(at), 0.0, 0.0),
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            limit_mps: 8.0,
            junction: None,
            on,
        };
        let mut way: Vec<WayPoint> = (0..=40).map(straight).collect();
        turn_in(&mut way, 3.0);
        assert_eq!((way[25].point_m.y, way[38].point_m.y, way[40].point_m.y), (0.0, -3.0, -3.0));
        assert!(way.windows(2).all(|pair| pair[1].point_m.y <= pair[0].point_m.y));
        for three in way.windows(3) {
            let [before, here, after] = [0, 1, 2].map(|at| three[at].point_m.y);
            let second = after - 2.0 * here + before;
            assert!((second - three[1].curvature_per_m).abs() < 0.01, "{second} {:?}", three[1]);
        }
    }
}
