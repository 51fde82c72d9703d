//! Pedestrian crossings, and where lanes lead onto them.

use nalgebra::Point3;
use roads::Map;
use schemas::Vec3;

use super::{LaneId, Network, Stop, StopLine};

/// Crossings higher or lower than this are another storey's.
const STOREY_M: f32 = 3.0;
/// Steps in which a lane is followed onto a crossing.
const STEP_M: f32 = 0.5;

/// A pedestrian crossing.
#[derive(Clone, Debug)]
pub(crate) struct Crossing {
    corners_m: Vec<Vec3>,
    pub middle_m: Vec3,
    /// From the middle to the farthest corner.
    pub radius_m: f32,
}

impl Crossing {
    /// `None` for an outline that is no surface.
    fn new(corners: &[Point3<f64>]) -> Option<Self> {
        let corners_m: Vec<Vec3> =
            corners.iter().map(|corner| nalgebra::convert(corner.coords)).collect();
        if corners_m.len() < 3 {
            return None;
        }
        let (low, high) = corners_m
            .iter()
            .fold((corners_m[0], corners_m[0]), |(low, high), at| (low.inf(at), high.sup(at)));
        let middle_m = (low + high) / 2.0;
        let away = corners_m.iter().map(|corner| (corner - middle_m).xy().norm());
        let radius_m = away.fold(0.0, f32::max);
        Some(Self { corners_m, middle_m, radius_m })
    }

    /// From a point to the crossing, seen from above; 0 on it, endless on another storey.
    pub(crate) fn away_m(&self, point_m: &Vec3) -> f32 {
        if (point_m.z - self.middle_m.z).abs() > STOREY_M {
            return f32::INFINITY;
        }
        let nexts = self.corners_m.iter().cycle().skip(1);
        let (mut inside, mut least_m) = (false, f32::INFINITY);
        for (from, to) in self.corners_m.iter().zip(nexts) {
            if (from.y > point_m.y) != (to.y > point_m.y) {
                let x = from.x + (point_m.y - from.y) / (to.y - from.y) * (to.x - from.x);
                inside ^= point_m.x < x;
            }
            let (way, beside) = ((to - from).xy(), (point_m - from).xy());
            let share = (beside.dot(&way) / way.norm_squared().max(1.0e-9)).clamp(0.0, 1.0);
            least_m = least_m.min((beside - way * share).norm());
        }
        if inside { 0.0 } else { least_m }
    }
}

/// Adds the crossings of a map, and a line to stop at where a lane comes onto one.
pub(super) fn mark(network: &mut Network, map: &Map) {
    for corners in map.crosswalks() {
        let Some(crossing) = Crossing::new(&corners) else { continue };
        let index = network.crossings.len() as u32;
        let near = network.near(&crossing.middle_m, crossing.radius_m + 2.0);
        let entered: Vec<(LaneId, f32)> = near
            .iter()
            .filter_map(|near| {
                let (id, lane) = (near.place.lane, network.lane(near.place.lane)?);
                let reach_m = crossing.radius_m + 2.0;
                let mut at_m = (near.place.at_m - reach_m).max(0.0);
                let until_m = (near.place.at_m + reach_m).min(lane.length_m());
                while crossing.away_m(&lane.at(at_m).point_m) > 0.0 {
                    at_m += STEP_M;
                    if at_m > until_m {
                        return None;
                    }
                }
                Some((id, at_m))
            })
            .collect();
        for (id, at_m) in entered {
            if let Some(lane) = network.lanes.get_mut(id as usize) {
                lane.stops.push(StopLine { at_m, why: Stop::Crossing(index) });
            }
        }
        network.crossings.push(crossing);
    }
    for lane in &mut network.lanes {
        lane.stops.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
    }
}
