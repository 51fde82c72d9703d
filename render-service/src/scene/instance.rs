//! From the actors of a frame to what is drawn of them.

use bodies::Placed;
use raster::Lamp;
use schemas::{ActorId, ActorState, Frame, Vec3, skeleton};

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

/// Shapes of every actor of a frame that is shown, in the frame's order.
pub(crate) fn bodies(frame: &Frame) -> Vec<Body> {
    let shown = frame.actors.iter().filter(|actor| ::bodies::is_shown(actor));
    shown.map(|actor| body(actor, frame)).collect()
}

fn body(actor: &ActorState, frame: &Frame) -> Body {
    let limbs = skeleton::limbs(actor, frame.walker_pose(actor.id));
    let placed = ::bodies::place(actor, frame.type_of(actor), frame.sim_secs, &limbs);
    let (centre_m, half_m) = if limbs.is_empty() {
        (actor.box_centre_m, actor.box_half_extent_m)
    } else {
        let [low_m, high_m] = ::bodies::bounds(actor, &limbs);
        ((low_m + high_m) / 2.0, (high_m - low_m) / 2.0)
    };
    let centre = actor.world_from_actor * nalgebra::Point3::from(centre_m);
    let sources = placed.sources.iter();
    // Limbs, mirrors and riders reach out of the box.
    Body {
        actor: Some(actor.id),
        centre_m: centre.coords,
        radius_m: half_m.norm() * 1.1 + 0.6,
        lamps: sources.map(|source| beams::lamp(&actor.world_from_actor, source)).collect(),
        parts: placed.parts,
    }
}
