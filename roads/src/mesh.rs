//! Triangles of a map: what wheels stand on and what a camera sees.

mod ground;
mod render;
mod strip;

pub use ground::{GroundMesh, ground};
pub use render::{Surface, TownMesh, render};

/// What a triangle is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Material {
    /// Road surface.
    Asphalt,
    /// White paint on the road.
    MarkingWhite,
    /// Yellow paint on the road.
    MarkingYellow,
    /// Kerb stones.
    Curb,
    /// Paving of sidewalks.
    Sidewalk,
    /// Lawn and open ground.
    Grass,
    /// Paint of pedestrian crossings.
    Crosswalk,
    /// Outer walls of buildings.
    Wall,
    /// Window panes.
    Window,
    /// Roofs of buildings.
    Roof,
    /// Painted metal: posts, lamps, barriers.
    Metal,
    /// Bark.
    Trunk,
    /// Leaves.
    Foliage,
}

impl Material {
    /// Friction coefficient of a dry tyre on it; 0.9 on asphalt.
    #[must_use]
    pub const fn friction(self) -> f32 {
        match self {
            Self::Grass => 0.5,
            Self::MarkingWhite | Self::MarkingYellow | Self::Crosswalk => 0.8,
            _ => 0.9,
        }
    }
}
