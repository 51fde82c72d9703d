//! A place in the middle of a lane.

use nalgebra::ComplexField;
use schemas::Vec3;

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
    /// Unit vector along the lane, seen from above.
    pub(crate) fn heading(&self) -> Vec3 {
        Vec3::new(ComplexField::cos(self.heading_rad), ComplexField::sin(self.heading_rad), 0.0)
    }
}
