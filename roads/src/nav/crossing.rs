//! Pedestrian crossings, long enough to reach the sidewalks.

use nalgebra::{Point3, Vector3};

/// How far crossings are drawn out at both ends, in metres: maps end them at the kerb, and a
/// walker's place on the sidewalk begins its radius behind that.
const REACH_M: f64 = 0.6;

/// The corners of a crossing, moved outward along its longest side.
pub(super) fn drawn_out(corners: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let nexts = corners.iter().cycle().skip(1);
    let sides = corners.iter().zip(nexts).map(|(from, to)| to - from);
    let longest = sides.fold(Vector3::zeros(), |longest: Vector3<f64>, side| {
        if side.norm_squared() > longest.norm_squared() { side } else { longest }
    });
    let along = longest.try_normalize(1e-6).unwrap_or_else(Vector3::zeros);
    let places = corners.iter().map(|corner| corner.coords.dot(&along));
    let [low, high] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| {
        [low.min(place), high.max(place)]
    });
    let middle = (low + high) / 2.0;
    let outward = |corner: &Point3<f64>| {
        let side = if corner.coords.dot(&along) < middle { -REACH_M } else { REACH_M };
        corner + along * side
    };
    corners.iter().map(outward).collect()
}
