//! Triangles a ray compares four at a time.

use schemas::Vec3;

use super::bounds::Bounds;
use super::bvh::{Bvh, Stack, WIDTH};
use super::ray::{Hit, Ray};

/// Tolerance at the edges of triangles in parts of their size, so that no ray slips between two.
const EDGE: f32 = 1.0e-5;

/// A triangle of the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Metres, world frame.
    pub corners: [Vec3; 3],
    /// CARLA's semantic tag.
    pub tag: u8,
}

/// Four triangles side by side, by axis and lane.
#[derive(Clone, Copy, Debug, Default)]
struct Pack {
    corner_m: [[f32; WIDTH]; 3],
    edge_a_m: [[f32; WIDTH]; 3],
    edge_b_m: [[f32; WIDTH]; 3],
    tags: [u8; WIDTH],
}

/// Triangles that never move, met from both sides.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    bvh: Bvh,
    packs: Vec<Pack>,
}

impl Mesh {
    pub(crate) fn new(faces: &[Face]) -> Self {
        let bounds: Vec<Bounds> = faces.iter().map(|face| Bounds::around(face.corners)).collect();
        let mut packs: Vec<Pack> = Vec::with_capacity(faces.len() / 2);
        let bvh = Bvh::new(&bounds, WIDTH, |items| {
            let mut pack = Pack::default();
            for (lane, &item) in items.iter().enumerate() {
                pack.set(lane, &faces[item as usize]);
            }
            packs.push(pack);
            (packs.len() - 1) as u32
        });
        Self { bvh, packs }
    }

    /// The nearest triangle within `reach_m`.
    // Not within its callers either ([`Bvh::walk`]).
    #[inline(never)]
    pub(crate) fn nearest(&self, ray: &Ray, reach_m: f32, stack: &mut Stack) -> Option<Hit> {
        let mut nearest = None;
        self.bvh.walk(ray, reach_m, stack, |pack, reach_m| {
            let distances_m = self.packs[pack as usize].cross(ray);
            let mut reach_m = reach_m;
            for (lane, distance_m) in distances_m.into_iter().enumerate() {
                if distance_m < reach_m {
                    reach_m = distance_m;
                    nearest = Some((pack, lane));
                }
            }
            reach_m
        });
        let (pack, lane) = nearest?;
        Some(self.packs[pack as usize].hit(lane, ray))
    }

    /// Adds every triangle within `reach_m` to `hits`.
    pub(crate) fn all(&self, ray: &Ray, reach_m: f32, stack: &mut Stack, hits: &mut Vec<Hit>) {
        self.bvh.walk(ray, reach_m, stack, |pack, reach_m| {
            let pack = &self.packs[pack as usize];
            let distances_m = pack.cross(ray);
            let met = (0..WIDTH).filter(|&lane| distances_m[lane] <= reach_m);
            hits.extend(met.map(|lane| pack.hit(lane, ray)));
            reach_m
        });
    }
}

impl Pack {
    fn set(&mut self, lane: usize, face: &Face) {
        let [a, b, c] = face.corners;
        for axis in 0..3 {
            self.corner_m[axis][lane] = a[axis];
            self.edge_a_m[axis][lane] = b[axis] - a[axis];
            self.edge_b_m[axis][lane] = c[axis] - a[axis];
        }
        self.tags[lane] = face.tag;
    }

    /// Distance to each triangle, infinite where the ray misses it; empty lanes are always missed.
    ///
    /// - **Source:** Möller, Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    fn cross(&self, ray: &Ray) -> [f32; WIDTH] {
        let mut distances_m = [f32::INFINITY; WIDTH];
        for (lane, distance_m) in distances_m.iter_mut().enumerate() {
            let at = |of: &[[f32; WIDTH]; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
            let (edge_a_m, edge_b_m) = (at(&self.edge_a_m), at(&self.edge_b_m));
            let p = ray.direction.cross(&edge_b_m);
            // Infinite along the plane and for empty lanes; then every comparison below fails.
            let inverse = 1.0 / edge_a_m.dot(&p);
            let from_corner_m = ray.origin_m - at(&self.corner_m);
            let u = from_corner_m.dot(&p) * inverse;
            let q = from_corner_m.cross(&edge_a_m);
            let v = ray.direction.dot(&q) * inverse;
            let t_m = edge_b_m.dot(&q) * inverse;
            let met = (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1.0 + EDGE) & (t_m > 0.0);
            *distance_m = if met { t_m } else { f32::INFINITY };
        }
        distances_m
    }

    fn hit(&self, lane: usize, ray: &Ray) -> Hit {
        let at = |of: &[[f32; WIDTH]; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
        let up = at(&self.edge_a_m).cross(&at(&self.edge_b_m)).normalize();
        Hit {
            distance_m: self.cross(ray)[lane],
            normal: if up.dot(&ray.direction) > 0.0 { -up } else { up },
            tag: self.tags[lane],
            actor: None,
        }
    }
}
