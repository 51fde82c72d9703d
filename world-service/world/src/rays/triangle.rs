//! The point of a triangle that is closest to a point.
//!
//! **Source:** Ericson, "Real-time collision detection", 2005, section 5.1.5.

use schemas::Vec3;

/// - **Domain:** corners that are not in one line.
pub(super) fn closest_m([a, b, c]: [Vec3; 3], point: Vec3) -> Vec3 {
    let (ab, ac) = (b - a, c - a);
    let from_a = point - a;
    let (a_along, a_aside) = (ab.dot(&from_a), ac.dot(&from_a));
    if a_along <= 0.0 && a_aside <= 0.0 {
        return a;
    }
    let from_b = point - b;
    let (b_along, b_aside) = (ab.dot(&from_b), ac.dot(&from_b));
    if b_along >= 0.0 && b_aside <= b_along {
        return b;
    }
    let beyond_ab = a_along * b_aside - b_along * a_aside;
    if beyond_ab <= 0.0 && a_along >= 0.0 && b_along <= 0.0 {
        return a + ab * (a_along / (a_along - b_along));
    }
    let from_c = point - c;
    let (c_along, c_aside) = (ab.dot(&from_c), ac.dot(&from_c));
    if c_aside >= 0.0 && c_along <= c_aside {
        return c;
    }
    let beyond_ac = c_along * a_aside - a_along * c_aside;
    if beyond_ac <= 0.0 && a_aside >= 0.0 && c_aside <= 0.0 {
        return a + ac * (a_aside / (a_aside - c_aside));
    }
    let beyond_bc = b_along * c_aside - c_along * b_aside;
    let (to_c, to_b) = (b_aside - b_along, c_along - c_aside);
    if beyond_bc <= 0.0 && to_c >= 0.0 && to_b >= 0.0 {
        return b + (c - b) * (to_c / (to_c + to_b));
    }
    let scale = 1.0 / (beyond_ab + beyond_ac + beyond_bc);
    a + ab * (beyond_ac * scale) + ac * (beyond_ab * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_point_is_a_corner_on_a_side_or_within() {
        let corners = [Vec3::zeros(), Vec3::x() * 4.0, Vec3::y() * 4.0];
        for (point, closest) in [
            ([-1.0, -2.0, 3.0], [0.0, 0.0, 0.0]),
            ([7.0, -1.0, 0.0], [4.0, 0.0, 0.0]),
            ([-1.0, 9.0, 0.0], [0.0, 4.0, 0.0]),
            ([1.0, -2.0, 1.0], [1.0, 0.0, 0.0]),
            ([-2.0, 3.0, 1.0], [0.0, 3.0, 0.0]),
            ([4.0, 4.0, 1.0], [2.0, 2.0, 0.0]),
            ([1.0, 2.0, -5.0], [1.0, 2.0, 0.0]),
        ] {
            let found = closest_m(corners, Vec3::from(point));
            assert!((found - Vec3::from(closest)).norm() < 1.0e-6, "{point:?}: {found}");
        }
    }
}
