//! A route as a row of points, and where a vehicle is beside it.

use agents::WayPoint;
use nalgebra::ComplexField;

use crate::line::{self, StopLine};

/// Distance between points, in metres; the last two may be nearer.
pub(crate) const STEP_M: f32 = 1.0;
/// Segments looked at on either side of where a vehicle was before.
const REACH: usize = 32;
/// A segment so much farther away than the nearest, as the difference of squares: a bend does not
/// come back from there.
const FAR_M2: f32 = 100.0;

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
    /// From each point but the last to the next.
    segments: Vec<Segment>,
    /// Lines of lights that it crosses, in order.
    stops: Vec<Stop>,
}

/// Where a light holds whoever drives a route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stop {
    /// From the start.
    pub at_m: f32,
    /// Position among the map's lights.
    pub light: usize,
}

/// What of a piece of a route does not change from step to step.
#[derive(Clone, Copy, Debug)]
struct Segment {
    x_m: f32,
    y_m: f32,
    cos: f32,
    sin: f32,
    length_m: f32,
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
    /// From the route; more than `left_m` beyond its ends.
    pub away_m: f32,
    /// Direction of the route.
    pub cos: f32,
    pub sin: f32,
    pub half_width_m: f32,
    pub limit_mps: f32,
}

impl Route {
    /// - **Domain:** points of the way are [`STEP_M`] apart, but for the last; `half_width_m` tells
    ///   a point's half width of the lane.
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
        let segments = points.windows(2).map(|pair| Segment::between(&pair[0], &pair[1])).collect();
        (points.len() >= 2).then_some(Self { points, segments, stops: Vec::new() })
    }

    /// Whether it turns on the spot somewhere, as where a goal lies beside the lane that the way
    /// comes along: nobody can drive it.
    pub(crate) fn has_kink(&self) -> bool {
        /// 53° from one metre to the next.
        const TURN_COS_MIN: f32 = 0.6;
        self.segments.windows(2).any(|two| {
            let [from, to] = [two[0], two[1]];
            from.cos * to.cos + from.sin * to.sin < TURN_COS_MIN
        })
    }

    /// With those of the lines that it crosses and whose light holds it.
    pub(crate) fn with_lines(
        mut self,
        lines: &[StopLine],
        is_held_by: impl Fn(usize) -> bool,
    ) -> Self {
        let found = lines.iter().filter_map(|line| {
            let crossed = self.segments.iter().zip(&self.points).find_map(|(segment, from)| {
                let along = segment.cos * line.cos + segment.sin * line.sin;
                let (ahead_m, left_m) = segment.seen(line.x_m, line.y_m);
                let beside = left_m.abs() < line.half_width_m && along > line::HEADING_COS_MIN;
                let within = (0.0..segment.length_m).contains(&ahead_m);
                (beside && within).then_some(from.at_m + ahead_m)
            });
            crossed.map(|at_m| Stop { at_m, light: line.light })
        });
        let mut stops: Vec<Stop> = found.filter(|stop| is_held_by(stop.light)).collect();
        stops.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        self.stops = stops;
        self
    }

    /// The first line beyond a place.
    pub(crate) fn stop_after(&self, at_m: f32) -> Option<Stop> {
        let index = self.stops.partition_point(|stop| stop.at_m <= at_m);
        self.stops.get(index).copied()
    }

    pub(crate) fn length_m(&self) -> f32 {
        self.goal().at_m
    }

    pub(crate) fn goal(&self) -> RoutePoint {
        self.points.last().copied().unwrap_or_default()
    }

    /// The route at a distance from its start, kept within its ends.
    pub(crate) fn at(&self, at_m: f32) -> RoutePoint {
        let last = self.segments.len().saturating_sub(1);
        let index = ((at_m / STEP_M) as usize).min(last);
        let Some([from, to]) = self.points.get(index..index + 2) else {
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

    /// Cosine and sine of its direction at a distance from its start.
    pub(crate) fn facing(&self, at_m: f32) -> (f32, f32) {
        let last = self.segments.len().saturating_sub(1);
        let segment = self.segments.get(((at_m / STEP_M) as usize).min(last));
        segment.map_or((1.0, 0.0), |segment| (segment.cos, segment.sin))
    }

    /// Where a point is beside the route, near the segment where it was before. Ways that cross
    /// themselves are told apart by that.
    pub(crate) fn abreast(&self, x_m: f32, y_m: f32, before: usize) -> Abreast {
        let first = before.saturating_sub(REACH / 4);
        let end = (before + REACH + 1).min(self.segments.len());
        // Square of the distance, segment, and along it.
        let mut best = (f32::INFINITY, first, 0.0);
        for (index, segment) in self.segments.iter().enumerate().take(end).skip(first) {
            let (along_m, left_m) = segment.seen(x_m, y_m);
            let near_m = along_m.max(0.0).min(segment.length_m);
            let beyond_m = along_m - near_m;
            let away = beyond_m * beyond_m + left_m * left_m;
            if away < best.0 {
                best = (away, index, near_m);
            } else if away > best.0 + FAR_M2 {
                break;
            }
        }
        let (away, index, near_m) = best;
        let (Some(segment), Some([from, to])) =
            (self.segments.get(index), self.points.get(index..index + 2))
        else {
            return Abreast::default();
        };
        let share = near_m / segment.length_m;
        Abreast {
            segment: index,
            at_m: from.at_m + (to.at_m - from.at_m) * share,
            left_m: segment.seen(x_m, y_m).1,
            away_m: ComplexField::sqrt(away),
            cos: segment.cos,
            sin: segment.sin,
            half_width_m: from.half_width_m + (to.half_width_m - from.half_width_m) * share,
            limit_mps: from.limit_mps,
        }
    }
}

impl Segment {
    fn between(from: &RoutePoint, to: &RoutePoint) -> Self {
        let (x_m, y_m) = (to.x_m - from.x_m, to.y_m - from.y_m);
        let length_m = ComplexField::sqrt((x_m * x_m + y_m * y_m).max(1.0e-9));
        let (cos, sin) = (x_m / length_m, y_m / length_m);
        Self { x_m: from.x_m, y_m: from.y_m, cos, sin, length_m }
    }

    /// How far a point is ahead of its begin, and left of it.
    fn seen(&self, x_m: f32, y_m: f32) -> (f32, f32) {
        let (x_m, y_m) = (x_m - self.x_m, y_m - self.y_m);
        (x_m * self.cos + y_m * self.sin, y_m * self.cos - x_m * self.sin)
    }
}

#[cfg(test)]
mod tests {
    use roads::Waypoint;
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
                    on: Waypoint { road: 1, section: 0, lane: -1, s: f64::from(at) },
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
    fn lines_of_lights_are_met_in_order_by_whoever_drives_their_way() {
        let line = |light, x_m, y_m, cos: f32, sin| StopLine {
            light,
            x_m,
            y_m,
            cos,
            sin,
            half_width_m: 1.75,
        };
        let lines = [
            line(0, 50.5, 30.0, 0.0, 1.0),
            line(1, 20.25, 0.5, 1.0, 0.0),
            line(2, 20.0, 0.0, -1.0, 0.0),
            line(3, 30.0, 3.5, 1.0, 0.0),
            line(4, 40.0, 0.0, 1.0, 0.0),
        ];
        let route = corner().with_lines(&lines, |light| light != 4);
        assert_eq!(route.stop_after(0.0), Some(Stop { at_m: 20.25, light: 1 }));
        assert_eq!(route.stop_after(20.25), Some(Stop { at_m: 80.0, light: 0 }));
        assert_eq!(route.stop_after(80.5), None, "others hold another way");
    }

    #[test]
    fn points_ahead_lie_on_the_route_and_end_at_its_goal() {
        let route = corner();
        assert_eq!(route.length_m(), 100.0);
        let point = route.at(60.5);
        assert_eq!((point.x_m, point.y_m, point.limit_mps), (50.0, 10.5, 8.0));
        let point = route.at(140.0);
        assert_eq!((point.x_m, point.y_m), (50.0, 50.0));
        assert_eq!(route.at(1.5).x_m, 1.5);
        assert!(route.has_kink(), "a right angle on the spot");
        assert_eq!((route.facing(20.0), route.facing(200.0)), ((1.0, 0.0), (0.0, 1.0)));
    }
}
