//! The lane a vehicle follows.

use nalgebra::{Isometry3, Vector3};
use roads::{LaneTypes, Map, Waypoint};
use schemas::{Pose, Vec3};
use serde::{Deserialize, Serialize};

/// A lane farther away than this is not the vehicle's.
const LANE_DISTANCE_M_MAX: f64 = 6.0;
/// Sideways acceleration that curves ahead are taken with on a dry road, and braking towards them.
const CURVE_MPS2: f64 = 3.0;
const CURVE_BRAKING_MPS2: f64 = 2.5;
/// Spacing of the places ahead whose curvature counts, along the road's reference line.
const PREVIEW_STEP_M: f64 = 4.0;
const PREVIEW_COUNT_MAX: usize = 12;
/// Chord over which curvature is measured, along the road's reference line; on the lane it counts
/// as at least so long.
const CHORD_M: f64 = 2.0;
const CHORD_M_MIN: f64 = 0.2;

/// So far beyond a fork ways are told apart.
const FORK_M: f64 = 12.0;

/// A place on a lane that moves along with the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Track {
    at: Waypoint,
    /// The lane ends here.
    ended: bool,
}

/// The vehicle seen from its place on the lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    /// Left of the lane's middle.
    pub left_m: f32,
    /// Velocity along the lane and to its left.
    pub along_mps: f32,
    pub left_mps: f32,
    /// Of the lane, positive when it turns left.
    pub curvature_per_m: f32,
}

impl Track {
    /// The driving lane that the vehicle is on, if it leads its way.
    pub(crate) fn nearest(map: &Map, world_from_vehicle: &Pose) -> Option<Self> {
        let position: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let at = map.nearest(position.into(), LaneTypes::DRIVING)?;
        let lane = map.pose(&at);
        let near = (lane.translation.vector - position).xy().norm() <= LANE_DISTANCE_M_MAX;
        let heading: Vector3<f64> = nalgebra::convert(world_from_vehicle.rotation * Vec3::x());
        (near && heading_of(&lane).dot(&heading) > 0.0).then_some(Self { at, ended: false })
    }

    pub(crate) fn left(&self, map: &Map) -> Option<Self> {
        Some(Self { at: map.left_driving(&self.at)?, ended: false })
    }

    pub(crate) fn right(&self, map: &Map) -> Option<Self> {
        Some(Self { at: map.right_driving(&self.at)?, ended: false })
    }

    /// Moves the place abreast of the vehicle; at a fork the straightest way is taken.
    pub(crate) fn advance(&mut self, map: &Map, world_from_vehicle: &Pose) {
        let lane = map.pose(&self.at);
        let position: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let ahead_m = heading_of(&lane).dot(&(position - lane.translation.vector));
        if ahead_m > 0.01 {
            match straightest(map, &self.at, &lane, ahead_m) {
                Some(next) => self.at = next,
                None => self.ended = true,
            }
        }
    }

    pub(crate) fn place(&self, map: &Map, world_from_vehicle: &Pose, velocity: Vec3) -> Place {
        let lane = map.pose(&self.at);
        let position: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let velocity: Vector3<f64> = nalgebra::convert(velocity);
        let left = lane.rotation * Vector3::y();
        Place {
            left_m: left.dot(&(position - lane.translation.vector)) as f32,
            along_mps: heading_of(&lane).dot(&velocity) as f32,
            left_mps: left.dot(&velocity) as f32,
            curvature_per_m: curvature_per_m(map, &self.at, &lane) as f32,
        }
    }

    /// Fastest speed from which the curves ahead and the lane's end can be met with this grip.
    pub(crate) fn speed_limit_mps(&self, map: &Map, speed_mps: f32, grip: f32) -> f32 {
        if self.ended {
            return 0.0;
        }
        let speed = f64::from(speed_mps);
        let grip = f64::from(grip);
        let (curve_mps2, braking_mps2) = (CURVE_MPS2 * grip, CURVE_BRAKING_MPS2 * grip);
        let preview_m = speed * speed / (2.0 * braking_mps2) + 2.0 * PREVIEW_STEP_M;
        let mut limit = f64::INFINITY;
        let mut at = self.at;
        let mut lane = map.pose(&at);
        let mut distance_m = 0.0;
        for _ in 0..PREVIEW_COUNT_MAX {
            if distance_m > preview_m {
                break;
            }
            let curvature = curvature_per_m(map, &at, &lane).abs().max(1.0e-6);
            let braked = 2.0 * braking_mps2 * distance_m;
            limit = f64::min(limit, (curve_mps2 / curvature + braked).sqrt());
            match straightest(map, &at, &lane, PREVIEW_STEP_M) {
                Some(next) => {
                    let there = map.pose(&next);
                    distance_m += way_m(&lane, &there);
                    (at, lane) = (next, there);
                }
                None => {
                    limit = f64::min(limit, braked.sqrt());
                    break;
                }
            }
        }
        limit as f32
    }
}

fn heading_of(lane: &Isometry3<f64>) -> Vector3<f64> {
    lane.rotation * Vector3::x()
}

/// The way on that turns least; the first of equals.
fn straightest(
    map: &Map,
    from: &Waypoint,
    lane: &Isometry3<f64>,
    distance_m: f64,
) -> Option<Waypoint> {
    let mut ways = map.next(from, distance_m);
    if ways.len() < 2 {
        return ways.pop();
    }
    let heading = heading_of(lane);
    let along = |at: &Waypoint| heading_of(&map.pose(at)).dot(&heading);
    let mut best: Option<(f64, Waypoint)> = None;
    for candidate in ways {
        // All ways begin straight on.
        let beyond = map.next(&candidate, FORK_M);
        let straight = beyond.iter().map(along).reduce(f64::max).unwrap_or(along(&candidate));
        if best.is_none_or(|(least, _)| straight > least) {
            best = Some((straight, candidate));
        }
    }
    best.map(|(_, waypoint)| waypoint)
}

/// Of the lane's middle, positive to the left; 0 at its end.
fn curvature_per_m(map: &Map, at: &Waypoint, lane: &Isometry3<f64>) -> f64 {
    let Some(next) = straightest(map, at, lane, CHORD_M) else { return 0.0 };
    let there = map.pose(&next);
    let (from, to) = (heading_of(lane), heading_of(&there));
    // The sine of the turn; on the curves of roads it equals the turn to within a percent.
    let turn = from.x * to.y - from.y * to.x;
    turn / way_m(lane, &there).max(CHORD_M_MIN)
}

/// From one pose of a lane to another near it, seen from above.
fn way_m(from: &Isometry3<f64>, to: &Isometry3<f64>) -> f64 {
    (to.translation.vector - from.translation.vector).xy().norm()
}

#[cfg(test)]
mod tests {
    use schemas::level_pose;

    use super::*;

    /// 100 m straight along x, 40 m to the left with a radius of 25 m in the road's middle, and
    /// 60 m straight on. One lane 4 m wide to the right of it.
    const BEND: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="bend" version="1" north="0" south="0" east="0" west="0"/>
  <road name="bend" length="200" id="1" junction="-1">
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>
      <geometry s="100" x="100" y="0" hdg="0" length="40"><arc curvature="0.04"/></geometry>
      <geometry s="140" x="124.9893" y="25.7300" hdg="1.6" length="60"><line/></geometry>
    </planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;
    /// Of the lane's middle.
    const RADIUS_M: f64 = 27.0;

    #[test]
    fn curvature_is_that_of_the_lane_outside_and_inside_of_the_roads_curve() {
        let right = BEND.replace("0.04", "-0.04").replace("25.7300", "-25.7300");
        let right = right.replace(r#"hdg="1.6""#, r#"hdg="-1.6""#);
        for (text, wanted_m) in [(BEND, 27.0), (right.as_str(), -23.0)] {
            let map = Map::parse("bend", text).unwrap();
            let pose = level_pose(Vec3::new(104.0, -2.0, 0.0), 0.0);
            let track = Track::nearest(&map, &pose).unwrap();
            let found = f64::from(track.place(&map, &pose, Vec3::zeros()).curvature_per_m);
            assert!((found * wanted_m - 1.0).abs() < 0.005, "{found}, {wanted_m} m");
        }
    }

    fn limit_mps(x_m: f32, speed_mps: f32) -> f32 {
        limit_with_grip_mps(x_m, speed_mps, 1.0)
    }

    fn limit_with_grip_mps(x_m: f32, speed_mps: f32, grip: f32) -> f32 {
        let map = Map::parse("bend", BEND).unwrap();
        let track = Track::nearest(&map, &level_pose(Vec3::new(x_m, -2.0, 0.0), 0.0)).unwrap();
        track.speed_limit_mps(&map, speed_mps, grip)
    }

    #[test]
    fn before_a_curve_it_is_as_fast_as_easy_braking_allows_and_in_it_as_its_radius_does() {
        let curve_mps2 = CURVE_MPS2 * RADIUS_M;
        for before_m in [4.0, 12.0, 20.0, 32.0f32] {
            let wanted_mps = (curve_mps2 + 2.0 * CURVE_BRAKING_MPS2 * f64::from(before_m)).sqrt();
            let found_mps = f64::from(limit_mps(100.0 - before_m, 15.0));
            // Places are 4 m apart, and the chord of the curvature begins 2 m before the bend.
            assert!(found_mps < wanted_mps + 0.1, "{before_m} m: {found_mps} of {wanted_mps}");
            assert!(found_mps > wanted_mps - 1.2, "{before_m} m: {found_mps} of {wanted_mps}");
        }
        let within_mps = f64::from(limit_mps(101.0, 9.0));
        assert!((within_mps - curve_mps2.sqrt()).abs() < 0.2, "{within_mps}");
        let wet_mps = f64::from(limit_with_grip_mps(101.0, 9.0, 0.64));
        assert!((wet_mps - 0.8 * curve_mps2.sqrt()).abs() < 0.2, "{wet_mps}");
        let before_mps = [1.0, 0.64].map(|grip| limit_with_grip_mps(80.0, 15.0, grip));
        assert!((before_mps[1] / before_mps[0] - 0.8).abs() < 0.01, "{before_mps:?}");
    }

    #[test]
    fn a_curve_beyond_its_braking_distance_slows_nobody() {
        assert!(limit_mps(60.0, 8.0) > 50.0, "12.8 m and two steps ahead count at 8 m/s");
        assert!(limit_mps(60.0, 15.0) < 17.5);
    }
}
