//! What stands in a map, and what rays find.

use serde::{Deserialize, Serialize};

use super::{BoundingBox, Location, Transform};

/// A house, pole or tree.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct EnvironmentObject {
    pub(crate) transform: Transform,
    pub(crate) bounding_box: BoundingBox,
    pub(crate) id: u64,
    pub(crate) name: String,
    /// Semantic tag.
    pub(crate) tag: u8,
}

/// Where a ray met something, and its semantic tag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct LabelledPoint {
    pub(crate) location: Location,
    pub(crate) label: u8,
}

/// A street light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LightState {
    pub(crate) id: u32,
    pub(crate) location: Location,
    pub(crate) intensity: f32,
    pub(crate) group: u8,
    pub(crate) colour: (u8, u8, u8),
    pub(crate) active: bool,
}
