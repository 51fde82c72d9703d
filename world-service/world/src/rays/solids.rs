//! Solid shapes with places in the world: the scenery.

use nalgebra::Matrix3;
use schemas::{HiddenScenery, Pose, Vec3};

use super::bounds::Bounds;
use super::bvh::{Bvh, PacketStack, Stack};
use super::packet::{Nearest, Packet, each};
use super::ray::{Hit, Ray};
use super::shape::Shape;

/// One solid shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid {
    pub shape: Shape,
    centre_m: Vec3,
    /// Columns: the shape's axes.
    world_from_shape: Matrix3<f32>,
    /// CARLA's semantic tag.
    pub tag: u8,
    /// The place in the scenery of the thing of which it is a part.
    place: u32,
}

/// Shapes findable by rays and places.
#[derive(Clone, Debug)]
pub(crate) struct Solids {
    solids: Vec<Solid>,
    bvh: Bvh,
}

impl Solid {
    pub(crate) fn new(shape: Shape, world_from_shape: &Pose, tag: u8, place: u32) -> Self {
        Self {
            shape,
            centre_m: world_from_shape.translation.vector,
            world_from_shape: world_from_shape.rotation.to_rotation_matrix().into_inner(),
            tag,
            place,
        }
    }

    fn is_hidden(&self, hidden: &HiddenScenery) -> bool {
        hidden.contains(self.place)
    }

    fn bounds(&self) -> Bounds {
        let reach_m = self.world_from_shape.abs() * self.shape.half_extent_m();
        Bounds { low_m: self.centre_m - reach_m, high_m: self.centre_m + reach_m }
    }

    fn cast(&self, ray: &Ray) -> Option<Hit> {
        let origin_m = self.world_from_shape.tr_mul(&(ray.origin_m - self.centre_m));
        let direction = self.world_from_shape.tr_mul(&ray.direction);
        let (distance_m, normal) = self.shape.cast(origin_m, direction)?;
        let normal = self.world_from_shape * normal;
        Some(Hit { distance_m, normal, tag: self.tag, actor: None })
    }

    /// The point of the shape nearest to a point, world frame.
    pub(crate) fn closest_m(&self, point_m: Vec3) -> Option<Vec3> {
        let closest_m =
            self.shape.closest_m(self.world_from_shape.tr_mul(&(point_m - self.centre_m)))?;
        Some(self.centre_m + self.world_from_shape * closest_m)
    }
}

impl Solids {
    pub(crate) fn new(solids: Vec<Solid>) -> Self {
        let bounds: Vec<Bounds> = solids.iter().map(Solid::bounds).collect();
        let bvh = Bvh::new(&bounds, 1, |items| items.first().copied().unwrap_or(0));
        Self { solids, bvh }
    }

    /// The nearest shape within `reach_m` that is not hidden.
    pub(crate) fn nearest(
        &self,
        ray: &Ray,
        reach_m: f32,
        hidden: &HiddenScenery,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.bvh.walk(ray, reach_m, stack, |solid, reach_m, _| {
            let hit = self.cast(solid, ray, hidden);
            match hit.filter(|hit| hit.distance_m < reach_m) {
                Some(hit) => {
                    nearest = Some(hit);
                    hit.distance_m
                }
                None => reach_m,
            }
        });
        nearest
    }

    /// What the rays of a packet meet nearer than what they met before.
    pub(crate) fn nearest_of(
        &self,
        packet: &Packet,
        nearest: &mut Nearest,
        hidden: &HiddenScenery,
        stack: &mut PacketStack,
    ) {
        self.bvh.walk_packet(packet, nearest, stack, |solid, mask, nearest, _| {
            let solid = &self.solids[solid as usize];
            if solid.is_hidden(hidden) {
                return;
            }
            for ray in each(mask) {
                let Some(hit) = solid.cast(packet.ray(ray)) else { continue };
                if nearest.is_nearer(ray, hit.distance_m) {
                    nearest.set(ray, hit);
                }
            }
        });
    }

    /// Adds every shape within `reach_m` that is not hidden to `hits`.
    pub(crate) fn all(
        &self,
        ray: &Ray,
        reach_m: f32,
        hidden: &HiddenScenery,
        stack: &mut Stack,
        hits: &mut Vec<Hit>,
    ) {
        self.bvh.walk(ray, reach_m, stack, |solid, reach_m, _| {
            let hit = self.cast(solid, ray, hidden);
            hits.extend(hit.filter(|hit| hit.distance_m <= reach_m));
            reach_m
        });
    }

    fn cast(&self, solid: u32, ray: &Ray, hidden: &HiddenScenery) -> Option<Hit> {
        let solid = &self.solids[solid as usize];
        if solid.is_hidden(hidden) { None } else { solid.cast(ray) }
    }

    /// Visits the shapes whose boxes overlap `bounds` and that are not hidden.
    pub(crate) fn overlapping(
        &self,
        bounds: &Bounds,
        hidden: &HiddenScenery,
        mut visit: impl FnMut(&Solid),
    ) {
        self.bvh.overlapping(bounds, |solid| {
            let solid = &self.solids[solid as usize];
            if !solid.is_hidden(hidden) {
                visit(solid);
            }
        });
    }
}
