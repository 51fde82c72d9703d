//! The shortest way between two places as points, for whoever measures a drive against it.

use roads::Map;
use schemas::{Pose, Vec3};

use crate::network::{LanePoint, Network, Place};
use crate::path::Leg;
use crate::route;

/// A place on a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayPoint {
    /// From the start of the way.
    pub at_m: f32,
    /// Middle of the lane, or of the change between two lanes, on the ground.
    pub point_m: Vec3,
    /// Of the way, counter-clockwise from x; jumps by whole turns may occur between points.
    pub heading_rad: f32,
    /// Positive to the left.
    pub curvature_per_m: f32,
    /// 0 where none is known.
    pub limit_mps: f32,
    /// The junction that the lane leads through.
    pub junction: Option<u32>,
}

impl Network {
    /// The shortest way over lanes and allowed lane changes, one point every `step_m` and one at
    /// its end; `None` where no way leads there, or one of the places is beside all lanes.
    ///
    /// - **Domain:** `step_m` above 0.
    /// - **Cost:** that of a search through the lanes between the places.
    #[must_use]
    pub fn way(&self, map: &Map, from: &Pose, to: &Pose, step_m: f32) -> Option<Vec<WayPoint>> {
        let from = self.vehicle_place(map, from)?;
        let to = self.vehicle_place(map, to)?;
        let (_, legs) = route::plan(self, from, to)?;
        Some(self.sampled(&legs, step_m, to))
    }

    fn sampled(&self, legs: &[Leg], step_m: f32, end: Place) -> Vec<WayPoint> {
        let mut points = Vec::new();
        let (mut at_m, mut done_m) = (0.0, 0.0);
        for leg in legs {
            let length_m = leg.length_m().max(0.0);
            let junction = self.lane(leg.lane).and_then(|lane| lane.junction);
            while at_m < done_m + length_m {
                let point = leg.point(self, leg.from_m + at_m - done_m);
                points.extend(point.map(|point| way_point(&point, at_m, junction)));
                at_m += step_m;
            }
            done_m += length_m;
        }
        let last = self.lane(end.lane);
        points.extend(last.map(|lane| way_point(&lane.at(end.at_m), done_m, lane.junction)));
        points
    }
}

fn way_point(point: &LanePoint, at_m: f32, junction: Option<u32>) -> WayPoint {
    WayPoint {
        at_m,
        point_m: point.point_m,
        heading_rad: point.heading_rad,
        curvature_per_m: point.curvature_per_m,
        limit_mps: point.limit_mps,
        junction,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_leads_from_start_to_goal_in_even_steps_without_jumps() {
        let text = roads::town::build("Town03_Opt").unwrap();
        let map = Map::parse("Town03_Opt", &text).unwrap();
        let network = Network::new(&map);
        let places = network.places(60.0);
        let (start, goal) = (places[0], places[places.len() / 2]);
        let way = network.way(&map, &start, &goal, 1.0).unwrap();
        let ends = [(&start, way[0]), (&goal, way[way.len() - 1])];
        for (place, point) in ends {
            assert!((place.translation.vector - point.point_m).norm() < 0.5, "{point:?}");
        }
        for pair in way.windows(2) {
            let step_m = pair[1].at_m - pair[0].at_m;
            let apart_m = (pair[1].point_m - pair[0].point_m).norm();
            assert!(step_m <= 1.001 && (apart_m - step_m).abs() < 0.2, "{pair:?}");
        }
        assert!(way.iter().any(|point| point.junction.is_some()));
    }
}
