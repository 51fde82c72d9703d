//! Pulls a way through a row of edges tight, like a string.

use nalgebra::Point3;

use super::surface::cross;

/// An edge to cross, by its ends as the walker sees them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portal {
    pub(super) left: Point3<f64>,
    pub(super) right: Point3<f64>,
}

/// Corners nearer than this to the one before are left out, in metres.
const SAME_M: f64 = 1e-6;

/// The shortest way through all portals, seen from above, with both its ends.
pub(super) fn pull(from: Point3<f64>, portals: &[Portal], to: Point3<f64>) -> Vec<Point3<f64>> {
    let end = Portal { left: to, right: to };
    let portal = |index: usize| portals.get(index).copied().unwrap_or(end);
    let mut way = vec![from];
    let mut apex = from;
    let (mut left, mut right) = ((from, 0), (from, 0));
    let mut index = 0;
    while index <= portals.len() {
        let next = portal(index);
        if side(&apex, &right.0, &next.right) >= 0.0 {
            if is_same(&apex, &right.0) || side(&apex, &left.0, &next.right) < 0.0 {
                right = (next.right, index);
            } else {
                (apex, index) = left;
                way.push(apex);
                (left, right) = ((apex, index), (apex, index));
                index += 1;
                continue;
            }
        }
        if side(&apex, &left.0, &next.left) <= 0.0 {
            if is_same(&apex, &left.0) || side(&apex, &right.0, &next.left) > 0.0 {
                left = (next.left, index);
            } else {
                (apex, index) = right;
                way.push(apex);
                (left, right) = ((apex, index), (apex, index));
                index += 1;
                continue;
            }
        }
        index += 1;
    }
    way.push(to);
    way.dedup_by(|later, earlier| is_same(later, earlier));
    if way.len() == 1 {
        way.push(to);
    }
    way
}

/// Positive when `point` lies left of the line from `apex` through `through`.
fn side(apex: &Point3<f64>, through: &Point3<f64>, point: &Point3<f64>) -> f64 {
    cross(through.xy() - apex.xy(), point.xy() - apex.xy())
}

fn is_same(one: &Point3<f64>, other: &Point3<f64>) -> bool {
    (one - other).norm_squared() < SAME_M * SAME_M
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> Point3<f64> {
        Point3::new(x, y, 0.0)
    }

    fn gate(x: f64, right_y: f64, left_y: f64) -> Portal {
        Portal { left: at(x, left_y), right: at(x, right_y) }
    }

    #[test]
    fn a_way_that_is_free_is_straight() {
        let gates = [gate(1.0, -1.0, 1.0), gate(2.0, -1.0, 1.0), gate(3.0, -0.5, 3.0)];
        assert_eq!(pull(at(0.0, 0.0), &gates, at(4.0, 0.0)), [at(0.0, 0.0), at(4.0, 0.0)]);
        assert_eq!(pull(at(0.0, 0.0), &[], at(4.0, 0.0)), [at(0.0, 0.0), at(4.0, 0.0)]);
    }

    #[test]
    fn a_way_bends_at_the_corners_that_stand_in_it() {
        let gates = [gate(1.0, 2.0, 3.0), gate(2.0, 2.0, 3.0), gate(3.0, -3.0, -2.0)];
        let way = pull(at(0.0, 0.0), &gates, at(4.0, 0.0));
        assert_eq!(way, [at(0.0, 0.0), at(1.0, 2.0), at(2.0, 2.0), at(3.0, -2.0), at(4.0, 0.0)]);
    }

    #[test]
    fn a_way_to_where_one_stands_has_both_ends() {
        assert_eq!(pull(at(1.0, 1.0), &[], at(1.0, 1.0)), [at(1.0, 1.0), at(1.0, 1.0)]);
    }
}
