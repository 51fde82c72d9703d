//! Whether two boxes on the ground touch.

use agents::Body;
use nalgebra::ComplexField;

/// A box seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Outline {
    /// Middle.
    pub x_m: f32,
    pub y_m: f32,
    /// Of its length's direction.
    pub cos: f32,
    pub sin: f32,
    pub half_length_m: f32,
    pub half_width_m: f32,
}

impl Outline {
    /// That of a body; people are as wide as they are long.
    pub(super) fn of(body: &Body) -> Self {
        let level = ComplexField::sqrt(
            (body.forward.x * body.forward.x + body.forward.y * body.forward.y).max(1.0e-9),
        );
        Self {
            x_m: body.centre_m.x,
            y_m: body.centre_m.y,
            cos: body.forward.x / level,
            sin: body.forward.y / level,
            half_length_m: body.half_m.x,
            half_width_m: body.half_m.y,
        }
    }

    /// By separating axes: those of both boxes.
    ///
    /// - **Source:** Gottschalk, Lin, Manocha, "OBBTree", SIGGRAPH 1996, in the plane.
    pub(super) fn touches(&self, other: &Self) -> bool {
        let (x_m, y_m) = (other.x_m - self.x_m, other.y_m - self.y_m);
        // Shares of one box's axes along the other's.
        let along = (self.cos * other.cos + self.sin * other.sin).abs();
        let across = (self.cos * other.sin - self.sin * other.cos).abs();
        let apart = |axes: &Self, from: &Self| {
            let ahead_m = (x_m * axes.cos + y_m * axes.sin).abs();
            let left_m = (y_m * axes.cos - x_m * axes.sin).abs();
            ahead_m > axes.half_length_m + from.half_length_m * along + from.half_width_m * across
                || left_m
                    > axes.half_width_m + from.half_length_m * across + from.half_width_m * along
        };
        !apart(self, other) && !apart(other, self)
    }

    /// Half sizes of the upright rectangle around it.
    pub(super) fn around_m(&self) -> (f32, f32) {
        let (cos, sin) = (self.cos.abs(), self.sin.abs());
        (
            self.half_length_m * cos + self.half_width_m * sin,
            self.half_length_m * sin + self.half_width_m * cos,
        )
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

    use super::*;

    fn car(x_m: f32, y_m: f32, heading_rad: f32) -> Outline {
        let (sin, cos) = heading_rad.sin_cos();
        Outline { x_m, y_m, cos, sin, half_length_m: 2.5, half_width_m: 1.0 }
    }

    #[test]
    fn boxes_touch_where_no_axis_separates_them() {
        let own = car(0.0, 0.0, 0.0);
        for (other, wanted) in [
            (car(4.9, 0.0, 0.0), true),
            (car(5.1, 0.0, 0.0), false),
            (car(0.0, 1.9, 0.0), true),
            (car(0.0, 2.1, 0.0), false),
            (car(3.4, 0.0, FRAC_PI_2), true),
            (car(3.6, 0.0, FRAC_PI_2), false),
            // Corner to corner: only the turned box's own axis separates these.
            (car(4.2, 2.6, FRAC_PI_4), true),
            (car(4.6, 3.2, FRAC_PI_4), false),
        ] {
            assert_eq!(own.touches(&other), wanted, "{other:?}");
            assert_eq!(other.touches(&own), wanted, "{other:?}");
        }
    }
}
