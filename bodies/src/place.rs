//! From an actor to placed and coloured shapes.

use std::sync::LazyLock;

use bytemuck::{Pod, Zeroable};
use nalgebra::Matrix4;
use schemas::{ActorKind, ActorState, PosedLimb, SemanticTag, TagId, Vec3};

use crate::shape::Shape;

mod clothes;
mod doors;
mod lamps;
mod prop;
mod reach;
mod source;
mod walker;
mod wheeled;

pub use reach::bounds;
pub use source::{Shine, Source};

/// Place and colours of one shape.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// The upper three rows of world from shape.
    pub world_from_shape: [[f32; 4]; 3],
    /// Four linear colours, 8 bits a channel; alpha is the part that glows.
    pub tints: [[u8; 4]; 4],
    /// A packed [`TagId`]; 0 where the vertices say it.
    pub label: u32,
}

/// One shape of an actor in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Which.
    pub shape: Shape,
    /// Where and how.
    pub instance: Instance,
}

/// Room for the parts of most things.
const PARTS: usize = 16;

/// Collects the parts of one thing.
#[derive(Clone, Debug)]
pub struct Placer {
    world_from_actor: Matrix4<f32>,
    /// A packed [`TagId`] of the parts that are put next.
    pub label: u32,
    /// What was put.
    pub parts: Vec<Placed>,
    /// What throws light, in the thing's own frame.
    pub sources: Vec<Source>,
}

/// Whether an actor has a body: a vehicle, walker or prop of some size whose pose is of numbers.
pub fn is_shown(actor: &ActorState) -> bool {
    let has_body = match actor.kind {
        ActorKind::Vehicle | ActorKind::Walker | ActorKind::Prop => true,
        // The map's lights and signs belong to the town.
        ActorKind::TrafficLight
        | ActorKind::TrafficSign
        | ActorKind::Sensor
        | ActorKind::Marker => false,
    };
    let (extent, centre) = (actor.box_half_extent_m, actor.box_centre_m);
    let pose = &actor.world_from_actor;
    let turn_and_place = pose.rotation.coords.iter().chain(pose.translation.vector.iter());
    let mut numbers = turn_and_place.chain(extent.iter()).chain(centre.iter());
    has_body && numbers.all(|part| part.is_finite()) && extent.iter().all(|part| *part > 0.0)
}

/// The shapes of an actor of a type at a moment, with its limbs where somebody put them
/// ([`skeleton::limbs`](schemas::skeleton::limbs)); none of an actor that is not
/// [shown](is_shown).
///
/// - **Frame:** shapes in the world, sources of light in the actor's.
/// - **Cost:** a microsecond or two.
pub fn place(actor: &ActorState, type_id: &str, sim_secs: f64, limbs: &[PosedLimb]) -> Placer {
    let tag = SemanticTag::of_actor(actor.kind, type_id);
    let label = TagId::of_actor(tag, actor.id);
    let mut placer = Placer::new(actor.world_from_actor.to_homogeneous(), label);
    if !is_shown(actor) {
        return placer;
    }
    match actor.kind {
        ActorKind::Vehicle => wheeled::place(&mut placer, actor, type_id, sim_secs),
        ActorKind::Walker => walker::place(&mut placer, actor, limbs),
        _ => prop::place(&mut placer, actor, type_id),
    }
    placer
}

/// From the box of -1 to 1 to the actor's own box.
fn box_scale(actor: &ActorState) -> Matrix4<f32> {
    Matrix4::new_translation(&actor.box_centre_m)
        * Matrix4::new_nonuniform_scaling(&actor.box_half_extent_m)
}

impl Placer {
    /// Without parts.
    pub fn new(world_from_actor: Matrix4<f32>, label: u32) -> Self {
        let parts = Vec::with_capacity(PARTS);
        Self { world_from_actor, label, parts, sources: Vec::new() }
    }

    /// Puts a shape at a place of the thing's own frame.
    pub fn put(&mut self, shape: Shape, actor_from_shape: Matrix4<f32>, tints: [[u8; 4]; 4]) {
        self.put_in_world(shape, self.world_from_actor * actor_from_shape, tints);
    }

    fn put_in_world(&mut self, shape: Shape, matrix: Matrix4<f32>, tints: [[u8; 4]; 4]) {
        let row = |at: usize| [matrix[(at, 0)], matrix[(at, 1)], matrix[(at, 2)], matrix[(at, 3)]];
        let world_from_shape = [row(0), row(1), row(2)];
        let instance = Instance { world_from_shape, tints, label: self.label };
        self.parts.push(Placed { shape, instance });
    }

    fn shine(&mut self, shine: Shine, at_m: Vec3, ahead: Vec3) {
        self.sources.push(Source { shine, at_m, ahead });
    }
}

impl Instance {
    /// A shape that is already in the world, such as a town.
    pub const IN_PLACE: Self = Self {
        world_from_shape: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        tints: [[255, 255, 255, 0]; 4],
        label: 0,
    };
}

/// Channels of 8 bits, sRGB to linear.
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|at| {
        let encoded = at as f32 / 255.0;
        if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    })
});

/// Linear colour of an sRGB `0xRRGGBB`.
pub fn linear(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| LINEAR[(rgb >> shift) as usize & 0xff])
}

/// A tint without glow.
pub fn opaque(colour: [f32; 3]) -> [u8; 4] {
    glowing(colour, 0.0)
}

/// A tint of which a part glows by itself.
pub fn glowing([r, g, b]: [f32; 3], part: f32) -> [u8; 4] {
    [r, g, b, part].map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}
