//! Places on flat convex polygons, seen from above.

use nalgebra::{Point3, Vector2};

/// The place on a convex polygon nearest to a point seen from above, with the polygon's height
/// there. Corners are counter-clockwise; without corners the point itself.
pub(super) fn closest(corners: &[Point3<f64>], point: Point3<f64>) -> Point3<f64> {
    let Some((first, rest)) = corners.split_first() else { return point };
    for pair in rest.windows(2) {
        if let [b, c] = pair
            && let Some(z) = height_in([first, b, c], &point)
        {
            return Point3::new(point.x, point.y, z);
        }
    }
    let nexts = corners.iter().cycle().skip(1);
    let on_edges = corners.iter().zip(nexts).map(|(from, to)| on_edge(from, to, &point));
    let gap2 = |place: &Point3<f64>| (place.xy() - point.xy()).norm_squared();
    on_edges.min_by(|a, b| gap2(a).total_cmp(&gap2(b))).unwrap_or(*first)
}

/// The height of a triangle at a point within it.
fn height_in([a, b, c]: [&Point3<f64>; 3], point: &Point3<f64>) -> Option<f64> {
    let area = cross(b.xy() - a.xy(), c.xy() - a.xy());
    if area <= 0.0 {
        return None;
    }
    let of_b = cross(point.xy() - a.xy(), c.xy() - a.xy()) / area;
    let of_c = cross(b.xy() - a.xy(), point.xy() - a.xy()) / area;
    let inside = of_b >= 0.0 && of_c >= 0.0 && of_b + of_c <= 1.0;
    inside.then(|| a.z + of_b * (b.z - a.z) + of_c * (c.z - a.z))
}

fn on_edge(from: &Point3<f64>, to: &Point3<f64>, point: &Point3<f64>) -> Point3<f64> {
    let along = to.xy() - from.xy();
    let length2 = along.norm_squared();
    let rate = if length2 > 0.0 {
        ((point.xy() - from.xy()).dot(&along) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    from + (to - from) * rate
}

/// Twice the signed area between two directions.
pub(super) fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Area of a polygon seen from above, in square metres.
pub(super) fn area_m2(corners: &[Point3<f64>]) -> f64 {
    let Some((first, rest)) = corners.split_first() else { return 0.0 };
    let pairs = rest.windows(2).filter_map(|pair| Some((pair.first()?, pair.last()?)));
    pairs.map(|(b, c)| cross(b.xy() - first.xy(), c.xy() - first.xy()) / 2.0).sum()
}
