//! What the ego has hit, each thing once.

use schemas::{ActorId, ActorKind, Collision, Frame};
use serde::Serialize;

use crate::limits::COLLISIONS_MAX;

/// The type that scenery is reported under, which is no actor.
const SCENERY: &str = "static.scenery";

/// The first contact with one thing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Hit {
    /// Step of the episode, pictures not counted.
    pub(crate) frame: u64,
    /// 0 for static scenery.
    pub(crate) actor_id: u32,
    /// CARLA blueprint id, or `static.scenery`.
    pub(crate) actor_type: String,
    /// Closing speed at the contact, in km/h.
    pub(crate) intensity: f32,
    #[serde(skip)]
    is_pedestrian: bool,
}

/// Everything hit so far, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hits {
    list: Vec<Hit>,
}

impl Hits {
    /// Adds the first contacts among the collisions of a step.
    pub(crate) fn note(
        &mut self,
        ego: ActorId,
        frame: &Frame,
        collisions: &[Collision],
        step: u64,
        events: &mut Vec<String>,
    ) {
        for collision in collisions {
            let other = match (collision.actor == ego, collision.other) {
                (true, other) => other,
                (false, Some(other)) if other == ego => Some(collision.actor),
                (false, _) => continue,
            };
            let actor_id = other.map_or(0, ActorId::get);
            let known = self.list.iter().any(|hit| hit.actor_id == actor_id);
            if known || self.list.len() >= COLLISIONS_MAX {
                continue;
            }
            let state = other.and_then(|other| frame.actor(other));
            let actor_type = state.map_or(SCENERY, |actor| frame.type_of(actor)).to_owned();
            let speed_kmh = schemas::carla::kmh(collision.closing_speed_mps.abs());
            let intensity = if speed_kmh.is_finite() { speed_kmh } else { 0.0 };
            events.push(format!("hit {actor_type} at {intensity:.1} km/h"));
            let is_pedestrian = state.is_some_and(|actor| actor.kind == ActorKind::Walker);
            self.list.push(Hit { frame: step, actor_id, actor_type, intensity, is_pedestrian });
        }
    }

    /// In order of contact.
    pub(crate) fn list(&self) -> &[Hit] {
        &self.list
    }

    /// Distinct things hit.
    pub(crate) fn count(&self) -> u32 {
        self.list.len() as u32
    }

    /// Distinct pedestrians hit.
    pub(crate) fn pedestrians(&self) -> u32 {
        self.list.iter().filter(|hit| hit.is_pedestrian).count() as u32
    }

    /// Closing speed of the worst hit, in km/h; 0 without one.
    pub(crate) fn worst_kmh(&self) -> f32 {
        self.list.iter().map(|hit| hit.intensity).fold(0.0, f32::max)
    }

    /// Sum of closing speeds, in km/h.
    pub(crate) fn total_kmh(&self) -> f32 {
        // A sum of nothing would be -0.0.
        self.list.iter().fold(0.0, |sum, hit| sum + hit.intensity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hit_sums_to_zero_and_not_to_minus_zero() {
        assert_eq!(Hits::default().total_kmh().to_bits(), 0.0_f32.to_bits());
    }
}
