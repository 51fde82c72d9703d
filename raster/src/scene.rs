//! What is in the world.

use crate::coat::Coat;
use crate::lamp::Lamp;
use crate::model::Model;
use crate::occluder::Occluder;

/// What may be seen.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Models at their places.
    pub placed: &'a [Placed<'a>],
    /// Whether a thing of the models is hidden; `None` if none is.
    pub is_hidden: Option<&'a (dyn Fn(u32) -> bool + Sync)>,
    /// At the places of their numbers.
    pub materials: &'a [Material],
    /// That are lit, those that matter most first; no more than [`LAMPS_MAX`](crate::LAMPS_MAX).
    pub lamps: &'a [Lamp],
    /// That stand on the ground, the nearest first; no more than
    /// [`OCCLUDERS_MAX`](crate::OCCLUDERS_MAX).
    pub occluders: &'a [Occluder],
    /// On things of the models, ordered by thing; no more than 65,535 count.
    pub coats: &'a [Coat],
}

impl Scene<'_> {
    /// Nothing.
    pub const EMPTY: Self = Self {
        placed: &[],
        is_hidden: None,
        materials: &[],
        lamps: &[],
        occluders: &[],
        coats: &[],
    };
}

/// A model in the world.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// What.
    pub model: &'a Model,
    /// Where: the upper three rows of world from model; a turn after a stretch along the axes.
    pub world_from_model: [[f32; 4]; 3],
    /// Four linear colours, 8 bits a channel; alpha is the part that glows.
    pub tints: [[u8; 4]; 4],
    /// What it belongs to; 0 where its corners say it.
    pub label: u32,
}

/// What a triangle is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Linear reflectance.
    pub colour: [f32; 3],
    /// 0 dull to 1 mirror-like.
    pub gloss: f32,
    /// How it is drawn.
    pub family: Family,
    /// Which pattern the ground has.
    pub pattern: u8,
    /// Which of a placement's four colours multiplies its own; 4 and more: none.
    pub tint: u8,
}

/// How a material is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Patterns from the place in the world.
    Ground,
    /// Windows from the coordinates of the facade.
    Facade,
    /// Paint, glass, light.
    Body,
}
