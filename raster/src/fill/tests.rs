//! What triangles cover, and how near they are there.

use fearless_simd::{Level, dispatch};

use super::*;

/// Goal: nearness is a number at every pixel. Method: corners that are as good as one place,
/// with a nearness each.
#[test]
fn a_triangle_without_a_width_is_equally_near_everywhere() {
    let point = |x: f32, y: f32, nearness: f32| Point { snapped: [x, y], exact: [x, y], nearness };
    for width in [0.0, 1e-38, 1e-33] {
        let corners = [point(0.0, 0.0, 1.0), point(width, 0.0, 12.0), point(0.0, 1.0, 3.0)];
        let plane = Plane::new(&corners, 1.5);
        assert_eq!((plane.across, plane.down, plane.nearness), (0.0, 0.0, 1.0), "{width}");
    }
    let corners = [point(0.0, 0.0, 1.0), point(4.0, 0.0, 3.0), point(0.0, 2.0, 2.0)];
    let plane = Plane::new(&corners, 0.0);
    assert_eq!((plane.across, plane.down), (0.5, 0.5));
}

/// A number from 0 to 1 that follows from another.
fn random(seed: u32) -> f32 {
    let mixed = seed.wrapping_mul(0x9e37_79b1) ^ (seed >> 3);
    ((mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) >> 8) as f32 / 16_777_216.0
}

/// Goal: a triangle is left out if and only if it covers no pixel's middle. Method: small
/// triangles on a grid that has middles on corners and sides, eight together and drawn alone.
#[test]
fn small_triangles_are_left_out_where_they_cover_nothing() {
    fn of_eight<S: Simd>(simd: S, eight: &[[[f32; 2]; 3]; LANES]) -> [bool; LANES] {
        let part = |corner: usize, axis: usize| {
            f32x8::load_array(simd, eight.map(|corners| corners[corner][axis]))
        };
        let corners = [0, 1, 2].map(|at| [part(at, 0), part(at, 1)]);
        let ends = eight.map(ends_of);
        let end = |which: usize| f32x8::load_array(simd, ends.map(|ends| ends[which]));
        let areas = f32x8::load_array(simd, eight.map(doubled_area));
        let [a, b, c] = corners;
        let is_clockwise = areas.simd_gt(splat(simd, 0.0));
        let ends = [end(0), end(1), end(2), end(3)];
        let shows = covers_an_end(simd, (a, b, c), is_clockwise, ends).to_bitmask();
        std::array::from_fn(|lane| shows >> lane & 1 == 1)
    }
    fn is_filled<S: Simd>(simd: S, corners: [[f32; 2]; 3]) -> bool {
        let mut target = Target::default();
        target.clear(16, 0..16, true);
        let [a, b, c] = corners.map(|place| Point { snapped: place, exact: place, nearness: 1.0 });
        let points = if doubled_area(corners) > 0.0 { [a, b, c] } else { [a, c, b] };
        let plane = Plane::new(&points, 0.0);
        fill(simd, &mut target, (&points, ends_of(corners)), &plane, 1)
    }
    let mut count = [0; 2];
    for seed in 0..4_000u32 {
        let eight: [[[f32; 2]; 3]; LANES] = std::array::from_fn(|lane| {
            let part = |at: u32| random(seed * 64 + lane as u32 * 8 + at);
            let grid = |at: u32, size: f32| (part(at) * size * 4.0).floor() / 4.0;
            let (x, y) = (3.0 + grid(6, 4.0), 3.0 + grid(7, 4.0));
            [0, 2, 4].map(|at| [x + grid(at, 2.5), y + grid(at + 1, 2.5)])
        });
        let shows = dispatch!(Level::new(), simd => of_eight(simd, &eight));
        for (corners, shows) in eight.into_iter().zip(shows) {
            let [left, right, top, bottom] = ends_of(corners);
            if doubled_area(corners) == 0.0 || left > right || top > bottom {
                continue;
            }
            let is_filled = dispatch!(Level::new(), simd => is_filled(simd, corners));
            let is_small = right - left <= 1.0 && bottom - top <= 1.0;
            assert!(shows == is_filled || !is_small, "{corners:?}");
            count[usize::from(shows)] += usize::from(is_small);
        }
    }
    assert!(count[0] > 1_000 && count[1] > 1_000, "{count:?}");
}
