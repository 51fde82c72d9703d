//! Triangles of a map: what wheels stand on and what a camera sees.

mod building;
mod deck;
mod ground;
pub(crate) mod kerbs;
mod markings;
mod pavement;
mod plants;
mod render;
mod squares;
pub(crate) mod strip;
mod terrain;

use nalgebra::Point3;

pub(crate) use building::panes;
pub use ground::{GroundMesh, above_lane_m, decks, ground};
pub(crate) use markings::stripes;
pub(crate) use pavement::convex_hull;
pub use render::{Surface, TILE_M, TownMesh, render};

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
    /// Paving of sidewalks and squares.
    Sidewalk,
    /// Lawn and open ground.
    Grass,
    /// Paint of pedestrian crossings.
    Crosswalk,
    /// Plastered outer walls.
    Wall,
    /// Brick walls.
    Brick,
    /// Concrete walls, barriers and boxes.
    Concrete,
    /// Concrete sides and undersides of bridges.
    Bridge,
    /// Window panes.
    Window,
    /// Roofs of buildings.
    Roof,
    /// Painted metal: posts and lamps.
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

/// Takes faces, counter-clockwise seen from outside.
trait Sink {
    fn triangle(&mut self, material: Material, corners: [Point3<f64>; 3]);

    fn quad(&mut self, material: Material, corners: [Point3<f64>; 4]);
}
