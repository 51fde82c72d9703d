//! Triangles a ray compares four at a time.

use schemas::Vec3;

use super::bounds::Bounds;
use super::bvh::{Bvh, PacketStack, Stack, WIDTH};
use super::packet::{Nearest, Packet, RAYS, each};
use super::ray::{Hit, Ray};

/// Tolerance at the edges of triangles in parts of their size, so that no ray slips between two.
const EDGE: f32 = 1.0e-5;

/// A triangle, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Metres in the world for the ground, the shape's own unit for a shape.
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
    /// Lanes that are not empty.
    count: usize,
}

/// Triangles that never move within their frame.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    bvh: Bvh,
    packs: Vec<Pack>,
    bounds: Bounds,
    /// Rays meet triangles whose volume with them is more: positive from outside.
    volume_min: f32,
}

impl Mesh {
    pub(crate) fn met_from_both_sides(faces: &[Face]) -> Self {
        Self::new(faces, f32::NEG_INFINITY)
    }

    /// As pictures show triangles of bodies.
    pub(crate) fn met_from_outside(faces: &[Face]) -> Self {
        Self::new(faces, 0.0)
    }

    fn new(faces: &[Face], volume_min: f32) -> Self {
        let bounds: Vec<Bounds> = faces.iter().map(|face| Bounds::around(face.corners)).collect();
        let mut packs: Vec<Pack> = Vec::with_capacity(faces.len() / 2);
        let bvh = Bvh::new(&bounds, WIDTH, |items| {
            let mut pack = Pack { count: items.len(), ..Pack::default() };
            for (lane, &item) in items.iter().enumerate() {
                pack.set(lane, &faces[item as usize]);
            }
            packs.push(pack);
            (packs.len() - 1) as u32
        });
        let bounds = bounds.iter().fold(Bounds::empty(), |all, one| all.union(one));
        Self { bvh, packs, bounds, volume_min }
    }

    /// Around all triangles.
    pub(crate) fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// The nearest triangle within `reach_m`.
    // Not within its callers either ([`Bvh::walk`]).
    #[inline(never)]
    pub(crate) fn nearest(&self, ray: &Ray, reach_m: f32, stack: &mut Stack) -> Option<Hit> {
        let mut nearest = None;
        self.bvh.walk(ray, reach_m, stack, |pack, reach_m, _| {
            let distances_m = self.packs[pack as usize].cross(ray, self.volume_min);
            let mut reach_m = reach_m;
            for (lane, distance_m) in distances_m.into_iter().enumerate() {
                if distance_m < reach_m {
                    reach_m = distance_m;
                    nearest = Some((pack, lane, distance_m));
                }
            }
            reach_m
        });
        let (pack, lane, distance_m) = nearest?;
        Some(self.packs[pack as usize].hit(lane, distance_m, ray))
    }

    /// What the rays of a packet meet nearer than what they met before.
    #[inline(never)]
    pub(crate) fn nearest_of(
        &self,
        packet: &Packet,
        nearest: &mut Nearest,
        stack: &mut PacketStack,
    ) {
        let mut met = [None; RAYS];
        self.bvh.walk_packet(packet, nearest, stack, |pack, mask, nearest, _| {
            for ray in each(mask) {
                let distances_m = self.packs[pack as usize].cross(packet.ray(ray), self.volume_min);
                for (lane, distance_m) in distances_m.into_iter().enumerate() {
                    if nearest.is_nearer(ray, distance_m) {
                        met[ray] = Some((pack, lane, distance_m));
                    }
                }
            }
        });
        for (ray, met) in met.into_iter().enumerate() {
            let Some((pack, lane, distance_m)) = met else { continue };
            nearest.set(ray, self.packs[pack as usize].hit(lane, distance_m, packet.ray(ray)));
        }
    }

    /// Adds every triangle within `reach_m` to `hits`.
    pub(crate) fn all(&self, ray: &Ray, reach_m: f32, stack: &mut Stack, hits: &mut Vec<Hit>) {
        self.bvh.walk(ray, reach_m, stack, |pack, reach_m, _| {
            let pack = &self.packs[pack as usize];
            let distances_m = pack.cross(ray, self.volume_min);
            let met = (0..WIDTH).filter(|&lane| distances_m[lane] <= reach_m);
            hits.extend(met.map(|lane| pack.hit(lane, distances_m[lane], ray)));
            reach_m
        });
    }

    /// Visits the corners of triangles near a box, with their tags.
    pub(crate) fn triangles_near(&self, bounds: &Bounds, mut visit: impl FnMut([Vec3; 3], u8)) {
        self.bvh.overlapping(bounds, |pack| {
            let pack = &self.packs[pack as usize];
            for lane in 0..pack.count {
                let corners = pack.corners(lane);
                if Bounds::around(corners).overlaps(bounds) {
                    visit(corners, pack.tags[lane]);
                }
            }
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

    fn corners(&self, lane: usize) -> [Vec3; 3] {
        let at = |of: &[[f32; WIDTH]; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
        let corner_m = at(&self.corner_m);
        [corner_m, corner_m + at(&self.edge_a_m), corner_m + at(&self.edge_b_m)]
    }

    /// Distance to each triangle, infinite where the ray misses it; empty lanes are always missed.
    ///
    /// - **Source:** Möller, Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    fn cross(&self, ray: &Ray, volume_min: f32) -> [f32; WIDTH] {
        let mut distances_m = [f32::INFINITY; WIDTH];
        for (lane, distance_m) in distances_m.iter_mut().enumerate() {
            let at = |of: &[[f32; WIDTH]; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
            let (edge_a_m, edge_b_m) = (at(&self.edge_a_m), at(&self.edge_b_m));
            let p = ray.direction.cross(&edge_b_m);
            // Infinite along the plane and for empty lanes; then every comparison below fails.
            let volume = edge_a_m.dot(&p);
            let inverse = 1.0 / volume;
            let from_corner_m = ray.origin_m - at(&self.corner_m);
            let u = from_corner_m.dot(&p) * inverse;
            let q = from_corner_m.cross(&edge_a_m);
            let v = ray.direction.dot(&q) * inverse;
            let t_m = edge_b_m.dot(&q) * inverse;
            let is_within = (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1.0 + EDGE);
            let met = is_within & (t_m > 0.0) & (volume > volume_min);
            *distance_m = if met { t_m } else { f32::INFINITY };
        }
        distances_m
    }

    fn hit(&self, lane: usize, distance_m: f32, ray: &Ray) -> Hit {
        let at = |of: &[[f32; WIDTH]; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]);
        let up = at(&self.edge_a_m).cross(&at(&self.edge_b_m)).normalize();
        Hit {
            distance_m,
            normal: if up.dot(&ray.direction) > 0.0 { -up } else { up },
            tag: self.tags[lane],
            actor: None,
        }
    }
}
