//! Places on curves in the plane, and arcs, by a sum that is the same on every machine and has no
//! branch that cannot be foreseen.

/// A place on a curve in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlanPose {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) heading_rad: f64,
}

/// Sine and cosine.
pub(crate) fn unit(heading_rad: f64) -> [f64; 2] {
    let (sin, cos) = heading_rad.sin_cos();
    [sin, cos]
}

/// The pose `d` metres along an arc, or along a line where the curvature is 0, with sine and cosine
/// of the heading there. `[sin, cos]` are those at the start.
///
/// It goes along the chord, whose direction is half way between those at its ends.
#[inline]
pub(crate) fn arc(
    start: PlanPose,
    [sin, cos]: [f64; 2],
    curvature: f64,
    d: f64,
) -> (PlanPose, [f64; 2]) {
    let turn_rad = curvature * d;
    let half_rad = 0.5 * turn_rad;
    let (per_radian, cos_half) = sine_per_radian_and_cosine(half_rad);
    let sin_half = half_rad * per_radian;
    let chord_m = d * per_radian;
    let end = PlanPose {
        x: start.x + chord_m * (cos * cos_half - sin * sin_half),
        y: start.y + chord_m * (sin * cos_half + cos * sin_half),
        heading_rad: start.heading_rad + turn_rad,
    };
    let (sin_turn, cos_turn) = (2.0 * sin_half * cos_half, 1.0 - 2.0 * sin_half * sin_half);
    (end, [sin * cos_turn + cos * sin_turn, cos * cos_turn - sin * sin_turn])
}

/// Up to this angle the series below leave out less than the last bit.
const SERIES_MAX_RAD: f64 = 1.0;

#[inline]
fn sine_per_radian_and_cosine(angle_rad: f64) -> (f64, f64) {
    if angle_rad.abs() > SERIES_MAX_RAD {
        let [sin, cos] = unit(angle_rad);
        return (sin / angle_rad, cos);
    }
    let square = angle_rad * angle_rad;
    (sum(SINE_PER_RADIAN, square), sum(COSINE, square))
}

/// Factors of the even powers.
type Series = [f64; 9];

const SINE_PER_RADIAN: Series = factors(1);
const COSINE: Series = factors(0);

/// `1 / first!`, `-1 / (first + 2)!`, `1 / (first + 4)!` and so on.
const fn factors(first: u64) -> Series {
    let mut factors = [1.0; 9];
    let mut index = 1;
    while index < factors.len() {
        let last = 2 * index as u64 + first;
        factors[index] = -factors[index - 1] / (last * (last - 1)) as f64;
        index += 1;
    }
    factors
}

/// In pairs, which do not wait for each other.
#[inline]
fn sum([a, b, c, d, e, f, g, h, i]: Series, x: f64) -> f64 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = (a + b * x) + (c + d * x) * x2;
    let high = (e + f * x) + (g + h * x) * x2;
    low + (high + i * x4) * x4
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORIGIN: PlanPose = PlanPose { x: 0.0, y: 0.0, heading_rad: 0.0 };

    #[test]
    fn a_quarter_arc_ends_where_its_circle_does() {
        let (end, _) = arc(ORIGIN, [0.0, 1.0], 0.1, std::f64::consts::FRAC_PI_2 / 0.1);
        assert!((end.x - 10.0).abs() < 1e-12 && (end.y - 10.0).abs() < 1e-12, "{end:?}");
    }

    #[test]
    fn arcs_of_every_turn_lie_on_their_circle() {
        let start = PlanPose { x: 3.0, y: -2.0, heading_rad: 0.7 };
        let [sin, cos] = unit(start.heading_rad);
        for curvature in [0.02, -0.02] {
            for step in 0..1000 {
                let d = 0.37 * f64::from(step);
                let (end, direction) = arc(start, [sin, cos], curvature, d);
                let wanted = unit(start.heading_rad + curvature * d);
                let x = start.x + (wanted[0] - sin) / curvature;
                let y = start.y - (wanted[1] - cos) / curvature;
                assert!((end.x - x).hypot(end.y - y) < 1e-12, "{curvature} {d}: {end:?}");
                let off = (direction[0] - wanted[0]).hypot(direction[1] - wanted[1]);
                assert!(off < 1e-14, "{curvature} {d}: {off}");
            }
        }
    }

    /// Bit for bit, also where curvature and distance are too small for one to feel the other.
    #[test]
    fn an_arc_without_curvature_is_a_line() {
        let start = PlanPose { x: 3.0, y: -2.0, heading_rad: 0.7 };
        let [sin, cos] = unit(start.heading_rad);
        let d = 12.3;
        let line = PlanPose { x: start.x + d * cos, y: start.y + d * sin, ..start };
        assert_eq!(arc(start, [sin, cos], 0.0, d), (line, [sin, cos]));
        assert_eq!(arc(start, [sin, cos], 1e-300, d), (line, [sin, cos]));
    }
}
