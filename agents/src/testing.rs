//! What tests of several modules begin with.

use schemas::{ActorId, Vec3};

use crate::scene::Body;

/// The first actor: a vehicle with half this length, width and height in metres, which drives
/// forward, a unit vector, at a speed.
pub(crate) fn vehicle(half_m: [f32; 3], centre_m: Vec3, forward: Vec3, speed_mps: f32) -> Body {
    Body {
        id: ActorId::FIRST,
        is_walker: false,
        is_urgent: false,
        centre_m,
        forward,
        half_m: half_m.into(),
        velocity_mps: forward * speed_mps,
    }
}
