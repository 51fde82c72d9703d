//! How walkers walk.

use super::motion::{Rotation, Vector};
use crate::bytes::record;

record! {
    /// How fast a walker is told to walk.
    WalkerSpeed {
        /// Which one.
        id: u32,
        /// In cm/s.
        speed: f32,
    }
}

record! {
    /// A bone relative to its parent.
    Bone {
        /// Its name.
        name: String,
        /// In cm.
        location: Vector,
        /// In degrees.
        rotation: Rotation,
    }
}

record! {
    /// How a walker holds its limbs.
    Bones {
        /// Which one.
        id: u32,
        /// All of them.
        bones: Vec<Bone>,
    }
}
