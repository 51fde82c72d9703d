//! A route as a row of points, and where a vehicle is beside it.

use agents::WayPoint;
use nalgebra::ComplexField;

/// Distance between points, in metres; the last two may be nearer.
pub(crate) const STEP_M: f32 = 1.0;
/// Segments looked at on either side of where a vehicle was before.
const REACH: usize = 32;

/// One point of a route, on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RoutePoint {
    /// From the start.
    pub at_m: f32,
    pub x_m: f32,
    pub y_m: f32,
    /// Positive to the left.
    pub curvature_per_m: f32,
    /// From the middle of the lane to its edge.
    pub half_width_m: f32,
    /// 0 where none is known.
    pub limit_mps: f32,
}

/// The way from a start to a goal; at least two points.
#[derive(Debug)]
pub(crate) struct Route {
    points: Vec<RoutePoint>,
}

/// A vehicle seen from its route.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Abreast {
    /// The segment, counted from the start.
    pub segment: usize,
    /// From the start.
    pub at_m: f32,
    /// Left of the route.
    pub left_m: f32,
    /// Direction of the route.
    pub cos: f32,
    pub sin: f32,
    pub half_width_m: f32,
    pub limit_mps: f32,
}

impl Route {
    /// - **Domain:** `half_width_m` tells a point's half width of the lane.
    ///
    /// `None` for a way without length.
    pub(crate) fn new(way: &[WayPoint], half_width_m: impl Fn(&WayPoint) -> f32) -> Option<Self> {
        let mut points: Vec<RoutePoint> = Vec::with_capacity(way.len());
        for point in way {
            let apart = |last: &RoutePoint| point.at_m - last.at_m > 0.01;
            if points.last().is_none_or(apart) {
                points.push(RoutePoint {
                    at_m: point.at_m,
                    x_m: point.point_m.x,
                    y_m: point.point_m.y,
                    curvature_per_m: point.curvature_per_m,
                    half_width_m: half_width_m(point),
                    limit_mps: point.limit_mps,
                });
            }
        }
        (points.len() >= 2).then_some(Self { points })
    }

    pub(crate) fn length_m(&self) -> f32 {
        self.goal().at_m
    }

    pub(crate) fn goal(&self) -> RoutePoint {
        self.points.last().copied().unwrap_or_default()
    }

    /// The route at a distance from its start, kept within its ends. `segment` is one near there.
    pub(crate) fn at(&self, at_m: f32, segment: usize) -> RoutePoint {
        let last = self.points.len().saturating_sub(2);
        // Points are a step apart, but for the last one.
        let steps = ((at_m - self.start_of(segment)) / STEP_M).floor();
        let mut index = if steps < 0.0 {
            segment.saturating_sub((-steps) as usize)
        } else {
            segment + steps as usize
        };
        index = index.min(last);
        let (Some(from), Some(to)) = (self.points.get(index), self.points.get(index + 1)) else {
            return RoutePoint::default();
        };
        let share = ((at_m - from.at_m) / (to.at_m - from.at_m)).clamp(0.0, 1.0);
        let between = |from: f32, to: f32| from + (to - from) * share;
        RoutePoint {
            at_m: between(from.at_m, to.at_m),
            x_m: between(from.x_m, to.x_m),
            y_m: between(from.y_m, to.y_m),
            curvature_per_m: between(from.curvature_per_m, to.curvature_per_m),
            half_width_m: between(from.half_width_m, to.half_width_m),
            limit_mps: from.limit_mps,
        }
    }

    fn start_of(&self, segment: usize) -> f32 {
        self.points.get(segment).map_or(0.0, |point| point.at_m)
    }

    /// Where a point is beside the route, near the segment where it was before. Ways that cross
    /// themselves are told apart by that.
    pub(crate) fn abreast(&self, x_m: f32, y_m: f32, before: usize) -> Abreast {
        let last = self.points.len().saturating_sub(2);
        let (first, end) = (before.saturating_sub(REACH / 4), (before + REACH).min(last));
        let mut best = (f32::INFINITY, Abreast::default());
        for segment in first..=end {
            let (Some(from), Some(to)) = (self.points.get(segment), self.points.get(segment + 1))
            else {
                break;
            };
            let (way_x, way_y) = (to.x_m - from.x_m, to.y_m - from.y_m);
            let (x, y) = (x_m - from.x_m, y_m - from.y_m);
            let square = way_x * way_x + way_y * way_y;
            let share = (x * way_x + y * way_y) / square.max(1.0e-9);
            let near = share.clamp(0.0, 1.0);
            let (off_x, off_y) = (x - way_x * near, y - way_y * near);
            let away = off_x * off_x + off_y * off_y;
            if away < best.0 {
                let length_m = ComplexField::sqrt(square.max(1.0e-9));
                let (cos, sin) = (way_x / length_m, way_y / length_m);
                best = (
                    away,
                    Abreast {
                        segment,
                        at_m: from.at_m + (to.at_m - from.at_m) * near,
                        left_m: y * cos - x * sin,
                        cos,
                        sin,
                        half_width_m: from.half_width_m
                            + (to.half_width_m - from.half_width_m) * near,
                        limit_mps: from.limit_mps,
                    },
                );
            } else if away > best.0 + 400.0 {
                // 20 m farther than the nearest: a bend does not come back from there.
                break;
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use schemas::Vec3;

    use super::*;

    /// 50 m along x, then 50 m along y.
    fn corner() -> Route {
        let way: Vec<WayPoint> = (0..=100u8)
            .map(|at| {
                let at_m = f32::from(at);
                let point_m = Vec3::new(at_m.min(50.0), (at_m - 50.0).max(0.0), 0.0);
                WayPoint {
                    at_m,
                    point_m,
                    heading_rad: 0.0,
                    curvature_per_m: 0.0,
                    limit_mps: 8.0,
                    junction: None,
                }
            })
            .collect();
        Route::new(&way, |_| 1.75).unwrap()
    }

    #[test]
    fn a_point_is_found_beside_the_segment_that_it_is_next_to() {
        let route = corner();
        let place = route.abreast(20.5, 1.5, 18);
        assert_eq!((place.segment, place.at_m, place.left_m), (20, 20.5, 1.5));
        assert_eq!((place.cos, place.sin, place.half_width_m), (1.0, 0.0, 1.75));
        let place = route.abreast(51.0, 20.25, 62);
        assert_eq!((place.segment, place.at_m, place.left_m), (70, 70.25, -1.0));
        assert_eq!(route.abreast(60.0, 200.0, 90).at_m, 100.0, "beyond the end");
        assert_eq!(route.abreast(-9.0, 0.0, 3).at_m, 0.0, "before the start");
    }

    #[test]
    fn points_ahead_lie_on_the_route_and_end_at_its_goal() {
        let route = corner();
        assert_eq!(route.length_m(), 100.0);
        let point = route.at(60.5, 20);
        assert_eq!((point.x_m, point.y_m, point.limit_mps), (50.0, 10.5, 8.0));
        let point = route.at(140.0, 99);
        assert_eq!((point.x_m, point.y_m), (50.0, 50.0));
        assert_eq!(route.at(1.5, 20).x_m, 1.5);
    }
}
