//! From the actors of a frame to what is drawn of them.

use bodies::Placed;
use raster::{Lamp, Occluder};
use schemas::{ActorId, ActorKind, ActorState, Frame, Vec3, skeleton};

mod beams;
mod numerals;
pub(crate) mod signal;
pub(crate) mod street_lamp;

/// Cosine of the angle to the vertical by which something still stands.
const UPRIGHT: f32 = 0.8;

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
    /// What it keeps the light of the sky from the ground with, if it stands.
    pub occluder: Option<Occluder>,
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
        occluder: occluder(actor, &placed.parts),
        parts: placed.parts,
    }
}

/// The box of a vehicle or person that stands upright.
fn occluder(actor: &ActorState, parts: &[Placed]) -> Option<Occluder> {
    let turn = actor.world_from_actor.rotation;
    let (ahead, up) = (turn * Vec3::x(), turn * Vec3::z());
    let stands = matches!(actor.kind, ActorKind::Vehicle | ActorKind::Walker) && up.z > UPRIGHT;
    stands.then(|| {
        let half_m = actor.box_half_extent_m;
        let centre = actor.world_from_actor * nalgebra::Point3::from(actor.box_centre_m);
        let place_m = centre.coords - up * half_m.z;
        let level = ahead.xy().normalize();
        let height_m = 2.0 * half_m.z.min(half_m.x).min(half_m.y);
        let (tall_m, colour) = (2.0 * half_m.z, mean_colour(actor.kind, parts));
        let (ahead, half_m) = ([level.x, level.y], [half_m.x, half_m.y]);
        Occluder { place_m: place_m.into(), ahead, half_m, height_m, tall_m, colour }
    })
}

/// Mean colour of a vehicle's paint, glass and tyres, or of a person's clothes.
fn mean_colour(kind: ActorKind, parts: &[Placed]) -> [f32; 3] {
    let Some(part) = parts.first() else { return [0.0; 3] };
    let [first, _, third, fourth] = part.instance.tints;
    [0, 1, 2].map(|channel| {
        let of = |tint: [u8; 4]| f32::from(tint[channel]) / 255.0;
        match kind {
            ActorKind::Walker => 0.5 * (of(third) + of(fourth)),
            _ => 0.7 * of(first) + 0.01,
        }
    })
}
