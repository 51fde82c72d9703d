//! Reference lines and cubic profiles: from a road coordinate to a place (OpenDRIVE plan view).

use std::sync::Arc;

use crate::arc::{PlanPose, arc, unit};
use crate::limits;

/// One cubic record `a + b t + c t² + d t³` with `t` counted from its own start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cubic {
    pub(crate) start_s: f64,
    pub(crate) a: f64,
    pub(crate) b: f64,
    pub(crate) c: f64,
    pub(crate) d: f64,
}

impl Cubic {
    pub(crate) fn value(&self, s: f64) -> f64 {
        let t = s - self.start_s;
        self.a + t * (self.b + t * (self.c + t * self.d))
    }

    pub(crate) fn slope(&self, s: f64) -> f64 {
        let t = s - self.start_s;
        self.b + t * (2.0 * self.c + t * 3.0 * self.d)
    }

    pub(crate) fn coefficients(&self) -> Coefficients {
        [self.a, self.b, self.c, self.d]
    }

    /// The same curve, counted from another start.
    fn counted_from(&self, start_s: f64) -> Self {
        let t = start_s - self.start_s;
        Self {
            start_s,
            a: self.value(start_s),
            b: self.slope(start_s),
            c: self.c + 3.0 * self.d * t,
            d: self.d,
        }
    }

    /// The sum with a share of another curve that counts from the same start.
    pub(crate) fn plus(&self, other: &Self, share: f64) -> Self {
        Self {
            start_s: self.start_s,
            a: self.a + share * other.a,
            b: self.b + share * other.b,
            c: self.c + share * other.c,
            d: self.d + share * other.d,
        }
    }
}

/// Cubic records in the order of their starts. Empty means 0 everywhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Profile(pub(crate) Vec<Cubic>);

impl Profile {
    /// Value and slope at `s`: the last record that starts at or before it is in force.
    pub(crate) fn at(&self, s: f64) -> (f64, f64) {
        let index = self.0.partition_point(|record| record.start_s <= s).saturating_sub(1);
        self.0.get(index).map_or((0.0, 0.0), |record| (record.value(s), record.slope(s)))
    }

    /// The same in a lane section that ends at `end_s`: a record that begins there belongs to the
    /// next section, to which it may jump.
    pub(crate) fn at_within(&self, s: f64, end_s: f64) -> (f64, f64) {
        let record = self.0.get(self.index_within(s, end_s));
        record.map_or((0.0, 0.0), |record| (record.value(s), record.slope(s)))
    }

    fn index_within(&self, s: f64, end_s: f64) -> usize {
        let begun = |record: &Cubic| record.start_s <= s && record.start_s < end_s;
        self.0.partition_point(begun).saturating_sub(1)
    }

    pub(crate) fn value(&self, s: f64) -> f64 {
        self.at(s).0
    }

    /// Where records start within a stretch, but for its ends.
    pub(crate) fn starts_within(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = f64> {
        let first = self.0.partition_point(|record| record.start_s <= from_s);
        let later = self.0.get(first..).unwrap_or_default().iter();
        later.map(|record| record.start_s).take_while(move |s| *s < to_s)
    }

    /// The record in force at `s`, counted from there.
    pub(crate) fn cubic_at(&self, s: f64) -> Cubic {
        let index = self.0.partition_point(|record| record.start_s <= s).saturating_sub(1);
        let none = Cubic { start_s: s, a: 0.0, b: 0.0, c: 0.0, d: 0.0 };
        self.0.get(index).map_or(none, |record| record.counted_from(s))
    }

    /// The same in a lane section that ends at `end_s`.
    pub(crate) fn cubic_within(&self, s: f64, end_s: f64) -> Cubic {
        let none = Cubic { start_s: s, a: 0.0, b: 0.0, c: 0.0, d: 0.0 };
        self.0.get(self.index_within(s, end_s)).map_or(none, |record| record.counted_from(s))
    }

    /// Whether no record bends, so that the profile is made of straight pieces.
    pub(crate) fn is_linear(&self) -> bool {
        self.0.iter().all(|record| record.c == 0.0 && record.d == 0.0)
    }
}

/// One `geometry` element.
#[derive(Clone, Debug)]
pub(crate) struct Geometry {
    pub(crate) start_s: f64,
    pub(crate) length_m: f64,
    pub(crate) start: PlanPose,
    /// Sine and cosine of the heading at the start.
    start_unit: [f64; 2],
    /// Of a line or an arc, so that nobody need ask which of them it is: that cannot be foreseen.
    /// Not a number for other shapes.
    curvature: f64,
    pub(crate) shape: Shape,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    Line,
    Arc { curvature: f64 },
    Spiral { curvature_start: f64, curvature_end: f64 },
    Polynomial(Arc<Table>),
}

impl Geometry {
    pub(crate) fn new(start_s: f64, length_m: f64, start: PlanPose, shape: Shape) -> Self {
        let curvature = match shape {
            Shape::Line => 0.0,
            Shape::Arc { curvature } => curvature,
            Shape::Spiral { .. } | Shape::Polynomial(_) => f64::NAN,
        };
        Self { start_s, length_m, start, start_unit: unit(start.heading_rad), curvature, shape }
    }

    /// No less than the reference line turns within the geometry, in radians.
    pub(crate) fn turn_max_rad(&self) -> f64 {
        match &self.shape {
            Shape::Line => 0.0,
            Shape::Arc { curvature } => (curvature * self.length_m).abs(),
            Shape::Spiral { curvature_start, curvature_end } => {
                curvature_start.abs().max(curvature_end.abs()) * self.length_m
            }
            Shape::Polynomial(table) => table.turn_rad(),
        }
    }

    /// The pose `distance_m` after the start, with sine and cosine of the heading there. It is kept
    /// within the geometry, unless that is a polynomial.
    #[inline]
    pub(crate) fn at_with_direction(&self, distance_m: f64) -> (PlanPose, [f64; 2]) {
        if self.curvature.is_nan() {
            return self.at_other(distance_m);
        }
        let d = distance_m.max(0.0).min(self.length_m);
        arc(self.start, self.start_unit, self.curvature, d)
    }

    /// As [`Geometry::at_with_direction`], by the shape.
    #[inline(never)]
    fn at_other(&self, distance_m: f64) -> (PlanPose, [f64; 2]) {
        let d = distance_m.max(0.0).min(self.length_m);
        match &self.shape {
            Shape::Line | Shape::Arc { .. } => arc(self.start, self.start_unit, self.curvature, d),
            Shape::Spiral { curvature_start, curvature_end } => {
                let end = spiral(self.start, *curvature_start, *curvature_end, self.length_m, d);
                (end, unit(end.heading_rad))
            }
            // The client goes on beyond the end of these, and of these only.
            Shape::Polynomial(table) => self.on_polynomial(table, distance_m.max(0.0)),
        }
    }

    #[inline(never)]
    fn on_polynomial(&self, table: &Table, d: f64) -> (PlanPose, [f64; 2]) {
        let PlanPose { x, y, heading_rad } = self.start;
        let [sin, cos] = self.start_unit;
        let (u, v, turn_rad) = table.at(d);
        let heading_rad = heading_rad + turn_rad;
        let end = PlanPose { x: x + u * cos - v * sin, y: y + u * sin + v * cos, heading_rad };
        (end, unit(heading_rad))
    }
}

/// Integrates the direction of a clothoid with five Gauss points per panel; a panel turns by at
/// most half a radian, which keeps the error below a micrometre on roads.
#[inline(never)]
fn spiral(start: PlanPose, k0: f64, k1: f64, length_m: f64, d: f64) -> PlanPose {
    const POINTS: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let theta = |u: f64| start.heading_rad + u * (k0 + (k1 - k0) * u / (2.0 * length_m));
    let turned_rad = d * k0.abs().max(k1.abs());
    let panels = spiral_panels(turned_rad);
    let half = d / (2.0 * panels as f64);
    let (mut x, mut y) = (start.x, start.y);
    for panel in 0..panels {
        let middle = half * (2 * panel + 1) as f64;
        for (offset, weight) in POINTS {
            let (sin, cos) = theta(middle + half * offset).sin_cos();
            x += weight * half * cos;
            y += weight * half * sin;
        }
    }
    PlanPose { x, y, heading_rad: theta(d) }
}

/// Panels in which a clothoid that turns so far is integrated.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the value is clamped to a small positive range before the conversion"
)]
pub(crate) fn spiral_panels(turned_rad: f64) -> usize {
    (turned_rad * 2.0).ceil().clamp(1.0, limits::SPIRAL_PANELS_MAX as f64) as usize
}

/// A polynomial curve as the client library tabulates it: summed chord length, local place and
/// derivatives, interpolated linearly.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    entries: Vec<Entry>,
    parametric: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Entry {
    chord_m: f64,
    u: f64,
    v: f64,
    du: f64,
    dv: f64,
}

/// Coefficients a to d of one polynomial.
pub(crate) type Coefficients = [f64; 4];

/// Value and slope.
#[inline]
pub(crate) fn evaluate([a, b, c, d]: Coefficients, p: f64) -> (f64, f64) {
    (a + p * (b + p * (c + p * d)), b + p * (2.0 * c + p * 3.0 * d))
}

impl Table {
    /// `poly3`: v over u, in steps of 0.3 m until the chords pass the length.
    pub(crate) fn poly3(v: Coefficients, length_m: f64) -> Self {
        const STEP_M: f64 = 0.3;
        let mut entries: Vec<Entry> = Vec::new();
        let mut u = 0.0;
        loop {
            let (value, slope) = evaluate(v, u);
            push(&mut entries, Entry { chord_m: 0.0, u, v: value, du: 1.0, dv: slope });
            // Every chord is at least one step long, so the length bounds the loop.
            if entries
                .last()
                .is_none_or(|last| last.chord_m.is_nan() || last.chord_m > length_m + STEP_M)
            {
                return Self { entries, parametric: false };
            }
            u += STEP_M;
        }
    }

    /// `paramPoly3` with p from 0 to `p_max`, in equal steps of about half a metre.
    pub(crate) fn param_poly3(u: Coefficients, v: Coefficients, p_max: f64, length_m: f64) -> Self {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "lengths are limited to a million metres and positive"
        )]
        let steps = (length_m / 0.5).floor().max(5.0) as usize;
        let mut entries: Vec<Entry> = Vec::with_capacity(steps + 1);
        for step in 0..=steps {
            let p = p_max * step as f64 / steps as f64;
            let ((u, du), (v, dv)) = (evaluate(u, p), evaluate(v, p));
            push(&mut entries, Entry { chord_m: 0.0, u, v, du, dv });
            if entries.last().is_some_and(|last| last.chord_m > length_m) {
                break;
            }
        }
        Self { entries, parametric: true }
    }

    /// The sum of all turns from entry to entry, in radians.
    fn turn_rad(&self) -> f64 {
        let turn = |pair: &[Entry]| match pair {
            [a, b] => (a.du * b.dv - a.dv * b.du).atan2(a.du * b.du + a.dv * b.dv).abs(),
            _ => 0.0,
        };
        self.entries.windows(2).map(turn).sum()
    }

    fn at(&self, d: f64) -> (f64, f64, f64) {
        let last_pair = self.entries.len().saturating_sub(2);
        let after = self.entries.partition_point(|entry| entry.chord_m <= d);
        let index = after.saturating_sub(1).min(last_pair);
        let Some([from, to]) = self.entries.get(index..index + 2) else {
            return (d, 0.0, 0.0);
        };
        let span = to.chord_m - from.chord_m;
        let rate = if span > 0.0 { (d - from.chord_m) / span } else { 0.0 };
        let mix = |a: f64, b: f64| a + (b - a) * rate;
        let dv = mix(from.dv, to.dv);
        let turn_rad = if self.parametric { dv.atan2(mix(from.du, to.du)) } else { dv.atan() };
        (mix(from.u, to.u), mix(from.v, to.v), turn_rad)
    }
}

fn push(entries: &mut Vec<Entry>, mut entry: Entry) {
    if let Some(last) = entries.last() {
        entry.chord_m = last.chord_m + (entry.u - last.u).hypot(entry.v - last.v);
    }
    entries.push(entry);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn origin() -> PlanPose {
        PlanPose { x: 0.0, y: 0.0, heading_rad: 0.0 }
    }

    #[test]
    fn a_spiral_without_change_of_curvature_is_an_arc() {
        let as_spiral = spiral(origin(), 0.02, 0.02, 80.0, 60.0);
        let (as_arc, _) = arc(origin(), [0.0, 1.0], 0.02, 60.0);
        assert!((as_spiral.x - as_arc.x).abs() < 1e-9, "{as_spiral:?} {as_arc:?}");
        assert!((as_spiral.y - as_arc.y).abs() < 1e-9);
    }

    /// **Source:** the client, for a road that is longer than its geometries.
    #[test]
    fn only_polynomials_go_on_beyond_their_end() {
        let end_x = |shape: Shape| {
            let start = origin();
            Geometry::new(0.0, 20.0, start, shape).at_with_direction(39.0).0.x
        };
        let table = Table::param_poly3([0.0, 20.0, 0.0, 0.0], [0.0; 4], 1.0, 20.0);
        assert!((end_x(Shape::Polynomial(Arc::new(table))) - 39.0).abs() < 1e-9);
        let table = Table::poly3([0.0; 4], 20.0);
        assert!((end_x(Shape::Polynomial(Arc::new(table))) - 39.0).abs() < 1e-9);
        assert_eq!(end_x(Shape::Line), 20.0);
        let spiral = Shape::Spiral { curvature_start: 0.0, curvature_end: 1e-9 };
        assert!((end_x(spiral) - 20.0).abs() < 1e-6);
    }

    #[test]
    fn a_parametric_line_is_followed_by_its_length() {
        let table = Table::param_poly3([0.0, 20.0, 0.0, 0.0], [0.0; 4], 1.0, 20.0);
        let (u, v, turn_rad) = table.at(7.3);
        assert!((u - 7.3).abs() < 1e-12 && v == 0.0 && turn_rad == 0.0);
    }
}
