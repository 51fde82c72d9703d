//! Axis-aligned boxes.

use schemas::Vec3;

/// A box along the world's axes, metres; empty when `low_m` is above `high_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub low_m: Vec3,
    pub high_m: Vec3,
}

impl Bounds {
    pub(crate) fn empty() -> Self {
        Self { low_m: Vec3::repeat(f32::INFINITY), high_m: Vec3::repeat(f32::NEG_INFINITY) }
    }

    /// The least box around some points.
    pub(crate) fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::empty(), |bounds, point| Self {
            low_m: bounds.low_m.inf(&point),
            high_m: bounds.high_m.sup(&point),
        })
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self { low_m: self.low_m.inf(&other.low_m), high_m: self.high_m.sup(&other.high_m) }
    }

    pub(crate) fn grown(&self, by_m: f32) -> Self {
        Self { low_m: self.low_m.add_scalar(-by_m), high_m: self.high_m.add_scalar(by_m) }
    }

    pub(crate) fn centre_m(&self) -> Vec3 {
        (self.low_m + self.high_m) / 2.0
    }

    /// Half of the surface in square metres, which is in proportion to how many rays meet the box;
    /// 0 of the empty box.
    pub(crate) fn half_area_m2(&self) -> f32 {
        let size_m = (self.high_m - self.low_m).sup(&Vec3::zeros());
        size_m.x * size_m.y + size_m.y * size_m.z + size_m.z * size_m.x
    }

    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|axis| {
            self.low_m[axis] <= other.high_m[axis] && other.low_m[axis] <= self.high_m[axis]
        })
    }
}
