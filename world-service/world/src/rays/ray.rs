//! A half-line and what it meets.

use schemas::{ActorId, Vec3};

/// Components of a direction below this count as this, so that their inverse is a number.
const COMPONENT_MIN: f32 = 1.0e-12;

/// Hits of one thing within this distance are one.
const SAME_M: f32 = 1.0e-3;

/// From a point in a direction, world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin_m: Vec3,
    /// Unit in the world; in the frame of a shape of any length.
    pub direction: Vec3,
    /// One over each component of the direction.
    pub inverse: Vec3,
}

impl Ray {
    /// - **Domain:** a `direction` of length 1 in the world.
    pub(crate) fn new(origin_m: Vec3, direction: Vec3) -> Self {
        let inverse = direction.map(|component| {
            let size = component.abs().max(COMPONENT_MIN);
            1.0 / size.copysign(component)
        });
        Self { origin_m, direction, inverse }
    }

    pub(crate) fn at(&self, distance_m: f32) -> Vec3 {
        self.origin_m + self.direction * distance_m
    }
}

/// Where a ray enters something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// From the ray's origin.
    pub distance_m: f32,
    /// Unit, world frame, against the ray.
    pub normal: Vec3,
    /// CARLA's semantic tag.
    pub tag: u8,
    /// `None` for ground and scenery.
    pub actor: Option<ActorId>,
}

impl Hit {
    /// Whether this farther hit belongs to the same thing as one just before it.
    pub(super) fn is_part_of(&self, before: &Self) -> bool {
        self.actor == before.actor
            && (self.actor.is_some() || self.distance_m - before.distance_m < SAME_M)
    }
}
