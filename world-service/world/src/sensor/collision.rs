//! Contacts of the carrier: `sensor.other.collision`.

use schemas::{Collision, Measurement};

use super::mount::{Carrier, Surroundings};
use crate::rays::tag;

/// How far the scenery of a contact may be from the place of the contact.
const CONTACT_REACH_M: f32 = 0.5;

/// One measurement for each other thing that the carrier touched in this tick.
pub(super) fn measure(carrier: &Carrier, around: &Surroundings) -> Vec<Measurement> {
    let carrier = carrier.id;
    let contacts = around.collisions.iter().filter_map(|collision| {
        let Collision { actor, other, impulse_ns, .. } = *collision;
        if actor == carrier {
            let tag = other.map_or_else(|| scenery_tag(collision, around), |id| (around.tag)(id));
            Some(Measurement::Collision { other, tag, impulse_ns })
        } else if other == Some(carrier) {
            let tag = (around.tag)(actor);
            Some(Measurement::Collision { other: Some(actor), tag, impulse_ns: -impulse_ns })
        } else {
            None
        }
    });
    contacts.collect()
}

fn scenery_tag(collision: &Collision, around: &Surroundings) -> u8 {
    let rays = around.sight.scene();
    let tag = rays.town.scenery_tag_at(collision.position_m, CONTACT_REACH_M, rays.hidden);
    tag.unwrap_or(tag::ROADS)
}
