//! From the actors of a frame to what is drawn of them.

use bodies::Placed;
use raster::Lamp;
use schemas::{ActorId, ActorState, Frame, PosedLimb, Vec3};

mod beams;
mod numerals;
pub(crate) mod signal;
pub(crate) mod street_lamp;

/// The shapes of one actor and the box around them.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// `None` for a part of the town.
    pub actor: Option<ActorId>,
    /// Of the box around the actor, in the world.
    pub centre_m: Vec3,
    /// Of a ball around the box.
    pub radius_m: f32,
    /// Its parts.
    pub parts: Vec<Placed>,
    /// What it throws light with.
    pub lamps: Vec<Lamp>,
}

/// Shapes of every actor of a frame that is shown, in the frame's order, and limbs where somebody
/// put them.
pub(crate) fn bodies(frame: &Frame, limbs: &[PosedLimb]) -> Vec<Body> {
    let shown = frame.actors.iter().filter(|actor| ::bodies::is_shown(actor));
    shown.map(|actor| body(actor, (frame, limbs))).collect()
}

fn body(actor: &ActorState, (frame, limbs): (&Frame, &[PosedLimb])) -> Body {
    let placed = ::bodies::place(actor, frame.type_of(actor), frame.sim_secs, limbs);
    let centre = actor.world_from_actor * nalgebra::Point3::from(actor.box_centre_m);
    let sources = placed.sources.iter();
    // Limbs, mirrors and riders reach out of the box.
    Body {
        actor: Some(actor.id),
        centre_m: centre.coords,
        radius_m: actor.box_half_extent_m.norm() * 1.1 + 0.6,
        lamps: sources.map(|source| beams::lamp(&actor.world_from_actor, source)).collect(),
        parts: placed.parts,
    }
}
