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

impl LightState {
    /// As recordings have it.
    pub(crate) fn recorded(&self) -> recording::SceneLight {
        let (r, g, b) = self.colour;
        let [r, g, b] = [r, g, b].map(|part| f32::from(part) / 255.0);
        recording::SceneLight {
            id: self.id as i32,
            intensity: self.intensity,
            colour: [r, g, b, 1.0],
            is_on: self.active,
            group: self.group,
        }
    }

    /// Takes over what a recording says of it.
    pub(crate) fn take_over(&mut self, recorded: &recording::SceneLight) {
        let [r, g, b, _] = recorded.colour.map(|part| (part * 255.0).round() as u8);
        self.intensity = recorded.intensity;
        self.colour = (r, g, b);
        self.active = recorded.is_on;
        self.group = recorded.group;
    }
}
