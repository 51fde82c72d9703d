//! Solid shapes in their own frames.

use schemas::Vec3;

/// Something solid about the origin of its frame; lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// A box by half of its size.
    Box { half_m: Vec3 },
    /// All points within a radius of a segment along z.
    Capsule { half_segment_m: f32, radius_m: f32 },
    /// A ball stretched along the axes.
    Ellipsoid { radii_m: Vec3 },
}

impl Shape {
    /// Half of the size of the least box around it.
    pub(crate) fn half_extent_m(&self) -> Vec3 {
        match *self {
            Self::Box { half_m } => half_m,
            Self::Capsule { half_segment_m, radius_m } => {
                Vec3::new(radius_m, radius_m, half_segment_m + radius_m)
            }
            Self::Ellipsoid { radii_m } => radii_m,
        }
    }

    /// Distance to where a ray enters, and the outward normal there; `None` for a ray that misses
    /// or begins inside.
    pub(crate) fn cast(&self, origin_m: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        match *self {
            Self::Box { half_m } => cast_on_box(half_m, origin_m, direction),
            Self::Capsule { half_segment_m, radius_m } => {
                cast_on_capsule(half_segment_m, radius_m, origin_m, direction)
            }
            Self::Ellipsoid { radii_m } => {
                // In a space where it is the unit ball; distances along the ray stay in proportion.
                let scaled = direction.component_div(&radii_m);
                let (distance_m, out) =
                    cast_on_ball(origin_m.component_div(&radii_m), scaled, scaled.norm_squared())?;
                Some((distance_m, out.component_div(&radii_m).normalize()))
            }
        }
    }

    /// The point of a box or capsule that is nearest to `point_m`, itself if it is inside; `None`
    /// of an ellipsoid, which nothing asks.
    pub(crate) fn closest_m(&self, point_m: Vec3) -> Option<Vec3> {
        match *self {
            Self::Box { half_m } => Some(point_m.inf(&half_m).sup(&-half_m)),
            Self::Capsule { half_segment_m, radius_m } => {
                let axis_z = point_m.z.clamp(-half_segment_m, half_segment_m);
                let axis_m = Vec3::new(0.0, 0.0, axis_z);
                let out_m = point_m - axis_m;
                let distance_m = out_m.norm();
                let inside = distance_m <= radius_m;
                Some(if inside { point_m } else { axis_m + out_m * (radius_m / distance_m) })
            }
            Self::Ellipsoid { .. } => None,
        }
    }
}

fn cast_on_box(half_m: Vec3, origin_m: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    let (mut enters_m, mut leaves_m) = (f32::NEG_INFINITY, f32::INFINITY);
    let mut normal = Vec3::zeros();
    for axis in 0..3 {
        let (from_m, along, half_m) = (origin_m[axis], direction[axis], half_m[axis]);
        if along == 0.0 {
            if from_m.abs() > half_m {
                return None;
            }
            continue;
        }
        let side = half_m.copysign(along);
        let (near_m, far_m) = ((-side - from_m) / along, (side - from_m) / along);
        if near_m > enters_m {
            enters_m = near_m;
            normal = Vec3::zeros();
            normal[axis] = -1.0_f32.copysign(along);
        }
        leaves_m = leaves_m.min(far_m);
    }
    (enters_m > 0.0 && enters_m <= leaves_m).then_some((enters_m, normal))
}

/// On the unit ball; `square` is the squared length of the direction.
fn cast_on_ball(origin: Vec3, direction: Vec3, square: f32) -> Option<(f32, Vec3)> {
    let half_b = origin.dot(&direction);
    let discriminant = half_b * half_b - square * (origin.norm_squared() - 1.0);
    if discriminant < 0.0 {
        return None;
    }
    let distance = (-half_b - discriminant.sqrt()) / square;
    (distance > 0.0).then(|| (distance, origin + direction * distance))
}

fn cast_on_capsule(
    half_segment_m: f32,
    radius_m: f32,
    origin_m: Vec3,
    direction: Vec3,
) -> Option<(f32, Vec3)> {
    let (flat_origin, flat_direction) = (origin_m.xy(), direction.xy());
    let square = flat_direction.norm_squared();
    let half_b = flat_origin.dot(&flat_direction);
    let c = flat_origin.norm_squared() - radius_m * radius_m;
    let discriminant = half_b * half_b - square * c;
    if discriminant < 0.0 {
        return None;
    }
    if square > 0.0 {
        let distance_m = (-half_b - discriminant.sqrt()) / square;
        let at_m = origin_m + direction * distance_m;
        if at_m.z.abs() <= half_segment_m {
            let out = Vec3::new(at_m.x, at_m.y, 0.0) / radius_m;
            return (distance_m > 0.0).then_some((distance_m, out));
        }
    }
    let on_cap = |centre_z: f32| {
        let from_m = origin_m - Vec3::new(0.0, 0.0, centre_z);
        let (distance, out) = cast_on_ball(from_m / radius_m, direction, 1.0)?;
        let outer_half = out.z * centre_z >= 0.0;
        outer_half.then_some((distance * radius_m, out))
    };
    let inside = origin_m.z.abs() <= half_segment_m && c < 0.0;
    if inside { None } else { on_cap(half_segment_m).or_else(|| on_cap(-half_segment_m)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAPSULE: Shape = Shape::Capsule { half_segment_m: 1.0, radius_m: 0.5 };

    #[test]
    fn rays_enter_shapes_where_their_surfaces_are() {
        let cube = Shape::Box { half_m: Vec3::new(2.0, 1.0, 0.5) };
        assert_eq!(cube.cast(Vec3::new(-5.0, 0.2, 0.1), Vec3::x()), Some((3.0, -Vec3::x())));
        assert_eq!(CAPSULE.cast(Vec3::new(0.0, 3.0, 0.9), -Vec3::y()), Some((2.5, Vec3::y())));
        assert_eq!(CAPSULE.cast(Vec3::new(0.0, 0.0, 4.0), -Vec3::z()), Some((2.5, Vec3::z())));
        assert_eq!(CAPSULE.cast(Vec3::new(0.0, 0.0, -4.0), Vec3::z()), Some((2.5, -Vec3::z())));
        let egg = Shape::Ellipsoid { radii_m: Vec3::new(1.0, 2.0, 4.0) };
        assert_eq!(egg.cast(Vec3::new(0.0, 0.0, 12.0), -Vec3::z()), Some((8.0, Vec3::z())));
    }

    #[test]
    fn rays_from_inside_or_beside_meet_nothing() {
        for shape in [
            Shape::Box { half_m: Vec3::repeat(1.0) },
            CAPSULE,
            Shape::Ellipsoid { radii_m: Vec3::repeat(1.0) },
        ] {
            for direction in [Vec3::x(), Vec3::z(), Vec3::new(0.6, 0.0, 0.8)] {
                assert_eq!(shape.cast(Vec3::zeros(), direction), None, "{shape:?}");
                assert_eq!(shape.cast(Vec3::new(0.0, 9.0, 0.0), direction), None, "{shape:?}");
            }
            assert_eq!(shape.cast(Vec3::new(5.0, 0.0, 0.0), Vec3::x()), None, "behind {shape:?}");
        }
    }

    #[test]
    fn the_closest_point_is_on_the_surface_or_the_point_itself() {
        let closest = CAPSULE.closest_m(Vec3::new(2.0, 0.0, 0.3)).unwrap();
        assert!((closest - Vec3::new(0.5, 0.0, 0.3)).norm() < 1.0e-6, "{closest}");
        let cube = Shape::Box { half_m: Vec3::repeat(1.0) };
        assert_eq!(cube.closest_m(Vec3::new(3.0, 0.5, -2.0)), Some(Vec3::new(1.0, 0.5, -1.0)));
        let inside = Vec3::new(0.1, 0.2, 0.3);
        assert_eq!(cube.closest_m(inside), Some(inside));
    }
}
