//! Places on the mesh.

use nalgebra::Point3;

use super::surface::{area_m2, closest};
use super::{Area, CORNERS_MAX, NavMesh};
use crate::town::random::Random;

impl NavMesh {
    /// The polygon nearest to a point, and the place on it nearest to that point seen from above;
    /// `None` for an empty mesh.
    ///
    /// **Cost:** logarithmic in the number of polygons for points on or near the mesh.
    #[must_use]
    pub fn nearest(&self, point: Point3<f64>) -> Option<(u32, Point3<f64>)> {
        self.tree.nearest(&point, |polygon| Some(self.closest(polygon, point)))
    }

    /// As [`NavMesh::nearest`] among polygons of one area.
    #[must_use]
    pub fn nearest_in(&self, point: Point3<f64>, area: Area) -> Option<(u32, Point3<f64>)> {
        self.tree.nearest(&point, |polygon| {
            let found = self.polygons.get(polygon as usize)?;
            (found.area == area).then(|| self.closest(polygon, point))
        })
    }

    /// The place on a polygon nearest to a point seen from above. It is asked thousands of times in
    /// a tick, so that corners are gathered in place.
    fn closest(&self, polygon: u32, point: Point3<f64>) -> Point3<f64> {
        let corners = self.polygons.get(polygon as usize).map_or(&[][..], |found| &found.corners);
        let mut places = [Point3::origin(); CORNERS_MAX];
        let mut count = 0;
        let known = corners.iter().filter_map(|corner| self.vertices.get(*corner as usize));
        for (place, corner) in places.iter_mut().zip(known) {
            *place = *corner;
            count += 1;
        }
        closest(places.get(..count).unwrap_or_default(), point)
    }

    /// A place on a sidewalk, each square metre as likely as any other; `None` without sidewalks.
    ///
    /// **Determinism:** the same `draw` gives the same place; any number will do.
    #[must_use]
    pub fn random_point(&self, draw: u64) -> Option<Point3<f64>> {
        let mut random = Random::new(draw);
        let (total_m2, _) = self.sidewalks.last()?;
        let wanted_m2 = random.between(0.0, *total_m2);
        let index = self.sidewalks.partition_point(|(sum_m2, _)| *sum_m2 <= wanted_m2);
        let (_, polygon) = self.sidewalks.get(index)?;
        let corners = self.outline(*polygon);
        let (first, rest) = corners.split_first()?;
        let mut left_m2 = random.between(0.0, area_m2(&corners));
        let mut triangles = rest.windows(2).filter_map(|pair| Some((pair.first()?, pair.last()?)));
        let last = rest.len().checked_sub(2)?;
        let (_, (b, c)) = triangles.by_ref().enumerate().find(|(index, (b, c))| {
            left_m2 -= area_m2(&[*first, **b, **c]);
            left_m2 < 0.0 || *index == last
        })?;
        // The half of the parallelogram beyond the triangle is folded back onto it.
        let (mut u, mut v) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        Some(first + (b - first) * u + (c - first) * v)
    }
}
