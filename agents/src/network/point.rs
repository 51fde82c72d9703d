//! A place in the middle of a lane.

use nalgebra::ComplexField;
use schemas::Vec3;

use super::wrapped;

/// The middle of a lane at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LanePoint {
    /// From the lane's entry.
    pub at_m: f32,
    pub point_m: Vec3,
    pub heading_rad: f32,
    /// Positive to the left.
    pub curvature_per_m: f32,
    /// 0 where none is known.
    pub limit_mps: f32,
    pub width_m: f32,
}

impl LanePoint {
    /// Between two points, at a distance from the lane's entry.
    #[inline(always)]
    pub(super) fn between(from: &Self, to: &Self, at_m: f32) -> Self {
        let span_m = (to.at_m - from.at_m).max(1.0e-6);
        let share = ((at_m - from.at_m) / span_m).clamp(0.0, 1.0);
        let turn_rad = wrapped(to.heading_rad - from.heading_rad);
        Self {
            at_m: from.at_m + span_m * share,
            point_m: to.point_m * share + from.point_m * (1.0 - share),
            heading_rad: from.heading_rad + turn_rad * share,
            curvature_per_m: from.curvature_per_m
                + (to.curvature_per_m - from.curvature_per_m) * share,
            limit_mps: from.limit_mps,
            width_m: from.width_m + (to.width_m - from.width_m) * share,
        }
    }

    /// Unit vector along the lane, seen from above.
    pub(crate) fn heading(&self) -> Vec3 {
        Vec3::new(ComplexField::cos(self.heading_rad), ComplexField::sin(self.heading_rad), 0.0)
    }
}
