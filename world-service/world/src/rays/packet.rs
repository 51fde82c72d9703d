//! Rays from one point that run close together: they go through a tree as one, and each compares
//! itself only with what is in the leaves.

use schemas::Vec3;

use super::bounds::Bounds;
use super::ray::{Hit, Ray};

/// Most rays of a packet.
pub(crate) const RAYS: usize = 16;

/// Some of the rays of a packet, a bit for each.
pub(super) type Mask = u32;

/// Rays from one point.
#[derive(Clone, Debug)]
pub(crate) struct Packet {
    rays: [Ray; RAYS],
    count: usize,
    /// By axis, then ray; beyond `count` that of the first ray.
    inverse: [[f32; RAYS]; 3],
    /// The least and the greatest along each axis; `None` where rays run both ways.
    span: [Option<[f32; 2]>; 3],
}

/// What the rays of a packet met so far.
#[derive(Clone, Debug)]
pub(crate) struct Nearest {
    /// Distance to it, or the range; beyond the packet's rays one that nothing has.
    reach_m: [f32; RAYS],
    hits: [Option<Hit>; RAYS],
    /// Rays that met two things equally far, so that the order decides.
    tied: Mask,
}

impl Packet {
    /// - **Domain:** one to [`RAYS`] rays of the same origin.
    pub(crate) fn new(count: usize, ray: impl Fn(usize) -> Ray) -> Self {
        let mut rays = [ray(0); RAYS];
        for (at, place) in rays.iter_mut().enumerate().take(count).skip(1) {
            *place = ray(at);
        }
        let inverse = [0, 1, 2].map(|axis: usize| rays.map(|ray| ray.inverse[axis]));
        let span = inverse.map(|inverse| {
            let (mut least, mut greatest) = (inverse[0], inverse[0]);
            for value in inverse {
                least = lesser(value, least);
                greatest = greater(value, greatest);
            }
            (least.is_sign_negative() == greatest.is_sign_negative()).then_some([least, greatest])
        });
        Self { rays, count, inverse, span }
    }

    pub(crate) fn ray(&self, at: usize) -> &Ray {
        &self.rays[at]
    }

    pub(super) fn origin_m(&self) -> &Vec3 {
        &self.rays[0].origin_m
    }

    pub(super) fn span(&self, axis: usize) -> Option<[f32; 2]> {
        self.span[axis]
    }

    /// The rays that meet a box no farther than what each met so far: those for which a single ray
    /// would go on.
    pub(super) fn meeting(&self, bounds: &Bounds, nearest: &Nearest) -> Mask {
        let mut near_m = [0.0; RAYS];
        let mut far_m = nearest.reach_m;
        for axis in 0..3 {
            let origin_m = self.origin_m()[axis];
            let (low_m, high_m) = (bounds.low_m[axis] - origin_m, bounds.high_m[axis] - origin_m);
            for (ray, inverse) in self.inverse[axis].into_iter().enumerate() {
                let (a_m, b_m) = (low_m * inverse, high_m * inverse);
                near_m[ray] = greater(lesser(a_m, b_m), near_m[ray]);
                far_m[ray] = lesser(greater(a_m, b_m), far_m[ray]);
            }
        }
        let meets = |ray: usize| Mask::from(near_m[ray] <= far_m[ray]) << ray;
        (0..RAYS).fold(0, |mask, ray| mask | meets(ray))
    }
}

impl Nearest {
    /// Nothing yet within `reach_m` of each ray.
    pub(crate) fn within(reach_m: f32, packet: &Packet) -> Self {
        Self::new(packet.count, |_| reach_m)
    }

    pub(super) fn new(count: usize, reach_m: impl Fn(usize) -> f32) -> Self {
        let reach_m =
            std::array::from_fn(|ray| if ray < count { reach_m(ray) } else { f32::NEG_INFINITY });
        Self { reach_m, hits: [None; RAYS], tied: 0 }
    }

    pub(super) fn reach_m(&self, ray: usize) -> f32 {
        self.reach_m[ray]
    }

    pub(super) fn longest_m(&self) -> f32 {
        self.reach_m.into_iter().fold(f32::NEG_INFINITY, |longest, reach| greater(reach, longest))
    }

    /// Whether something is nearer to a ray's origin than all before; notes its distance if so.
    pub(super) fn is_nearer(&mut self, ray: usize, distance_m: f32) -> bool {
        let reach_m = &mut self.reach_m[ray];
        let bit = 1 << ray;
        if distance_m < *reach_m {
            *reach_m = distance_m;
            self.tied &= !bit;
            return true;
        }
        self.tied |= if distance_m == *reach_m { bit } else { 0 };
        false
    }

    pub(super) fn set(&mut self, ray: usize, hit: Hit) {
        self.hits[ray] = Some(hit);
    }

    /// What one of the rays met that another packet has, too.
    pub(super) fn take(&mut self, ray: usize, from: &Self, at: usize, to: impl Fn(Hit) -> Hit) {
        if let Some(hit) = from.hits[at] {
            self.reach_m[ray] = hit.distance_m;
            self.hits[ray] = Some(to(hit));
            self.tied &= !(1 << ray);
        }
        self.tied |= (from.tied >> at & 1) << ray;
    }

    /// What a ray met, or `None` if that depends on the order in which things are visited.
    pub(crate) fn hit(&self, ray: usize) -> Option<Option<Hit>> {
        (self.tied >> ray & 1 == 0).then_some(self.hits[ray])
    }
}

/// The rays of a mask.
pub(super) fn each(mask: Mask) -> impl Iterator<Item = usize> {
    let mut left = mask;
    std::iter::from_fn(move || {
        let ray = left.trailing_zeros() as usize;
        left &= left.wrapping_sub(1);
        (ray < RAYS).then_some(ray)
    })
}

// Not `f32::min` and `max`: without their rule for NaN these are one instruction for all lanes.

pub(super) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

pub(super) fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_equally_far_is_left_to_the_order_until_something_is_nearer() {
        let along = |at: usize| Ray::new(Vec3::zeros(), Vec3::new(1.0, 0.1 * at as f32, 0.0));
        let packet = Packet::new(2, along);
        let mut nearest = Nearest::within(10.0, &packet);
        let hit = |distance_m| Hit { distance_m, normal: -Vec3::x(), tag: 1, actor: None };
        let mut meet = |ray: usize, distance_m: f32| {
            if nearest.is_nearer(ray, distance_m) {
                nearest.set(ray, hit(distance_m));
            }
            nearest.hit(ray)
        };
        assert_eq!(meet(0, 5.0), Some(Some(hit(5.0))));
        assert_eq!(meet(0, 6.0), Some(Some(hit(5.0))));
        assert_eq!(meet(0, 5.0), None);
        assert_eq!(meet(0, 4.0), Some(Some(hit(4.0))));
        assert_eq!(meet(1, 11.0), Some(None));
        assert_eq!(meet(2, 1.0), Some(None), "there is no third ray");
    }
}
