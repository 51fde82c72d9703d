//! From the actors of a frame to placed and coloured shapes.

use bytemuck::{Pod, Zeroable};
use nalgebra::Matrix4;
use raster::Lamp;
use schemas::{ActorId, ActorKind, ActorState, Frame, PosedLimb, SemanticTag, TagId, Vec3};

use super::shape::Shape;

mod beams;
mod clothes;
mod doors;
mod lamps;
mod numerals;
mod prop;
pub(crate) mod signal;
pub(crate) mod street_lamp;
mod walker;
mod wheeled;

/// Place and colours of one shape, as the GPU reads them.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Instance {
    /// The upper three rows of world from shape.
    pub world_from_shape: [[f32; 4]; 3],
    /// Four linear colours, 8 bits a channel; alpha is the part that glows.
    pub tints: [[u8; 4]; 4],
    /// A packed [`TagId`]; 0 where the vertices say it.
    pub label: u32,
}

/// One shape of an actor in the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Which.
    pub shape: Shape,
    /// Where and how.
    pub instance: Instance,
}

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

/// Shapes of every actor of a frame, in the frame's order, and limbs where somebody put them.
/// Actors with a pose that is no number are left out.
pub(crate) fn bodies(frame: &Frame, limbs: &[PosedLimb]) -> Vec<Body> {
    let drawable = |actor: &&ActorState| {
        let numbers = actor.world_from_actor.to_homogeneous();
        let extent = actor.box_half_extent_m;
        numbers
            .iter()
            .chain(extent.iter())
            .chain(actor.box_centre_m.iter())
            .all(|part| part.is_finite())
            && extent.iter().all(|part| *part > 0.0)
    };
    frame.actors.iter().filter(drawable).map(|actor| body(actor, (frame, limbs))).collect()
}

fn body(actor: &ActorState, (frame, limbs): (&Frame, &[PosedLimb])) -> Body {
    let type_id = frame.type_of(actor);
    let tag = SemanticTag::of_actor(actor.kind, type_id);
    let mut placer = Placer {
        world_from_actor: actor.world_from_actor.to_homogeneous(),
        label: TagId::of_actor(tag, actor.id),
        parts: Vec::new(),
        lamps: Vec::new(),
    };
    match actor.kind {
        ActorKind::Vehicle => wheeled::place(&mut placer, actor, type_id, frame.sim_secs),
        ActorKind::Walker => walker::place(&mut placer, actor, limbs),
        ActorKind::Prop => prop::place(&mut placer, actor, type_id),
        // The map's lights and signs belong to the town; the rest has no body.
        ActorKind::TrafficLight
        | ActorKind::TrafficSign
        | ActorKind::Sensor
        | ActorKind::Marker => {}
    }
    let centre = actor.world_from_actor * nalgebra::Point3::from(actor.box_centre_m);
    // Limbs, mirrors and riders reach out of the box.
    Body {
        actor: Some(actor.id),
        centre_m: centre.coords,
        radius_m: actor.box_half_extent_m.norm() * 1.1 + 0.6,
        parts: placer.parts,
        lamps: placer.lamps,
    }
}

/// From the box of -1 to 1 to the actor's own box.
fn box_scale(actor: &ActorState) -> Matrix4<f32> {
    Matrix4::new_translation(&actor.box_centre_m)
        * Matrix4::new_nonuniform_scaling(&actor.box_half_extent_m)
}

/// Collects the parts of one actor.
struct Placer {
    world_from_actor: Matrix4<f32>,
    /// Of the parts that are put next.
    label: u32,
    parts: Vec<Placed>,
    lamps: Vec<Lamp>,
}

impl Placer {
    fn put(&mut self, shape: Shape, actor_from_shape: Matrix4<f32>, tints: [[u8; 4]; 4]) {
        self.put_in_world(shape, self.world_from_actor * actor_from_shape, tints);
    }

    fn put_in_world(&mut self, shape: Shape, matrix: Matrix4<f32>, tints: [[u8; 4]; 4]) {
        let row = |at: usize| [matrix[(at, 0)], matrix[(at, 1)], matrix[(at, 2)], matrix[(at, 3)]];
        let world_from_shape = [row(0), row(1), row(2)];
        let instance = Instance { world_from_shape, tints, label: self.label };
        self.parts.push(Placed { shape, instance });
    }
}

impl Instance {
    /// A shape that is already in the world, such as a town.
    pub(crate) const IN_PLACE: Self = Self {
        world_from_shape: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        tints: [[255, 255, 255, 0]; 4],
        label: 0,
    };
}

/// Linear colour of an sRGB `0xRRGGBB`.
fn linear(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| {
        let encoded = ((rgb >> shift) & 0xff) as f32 / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
}

/// A tint without glow.
fn opaque(colour: [f32; 3]) -> [u8; 4] {
    glowing(colour, 0.0)
}

/// A tint of which a part glows by itself.
fn glowing([r, g, b]: [f32; 3], part: f32) -> [u8; 4] {
    [r, g, b, part].map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}
