//! What objects are: kinds of scenery, CARLA's semantic labels and map layers.

use schemas::SemanticTag;
use serde::{Deserialize, Serialize};

use crate::model::Object;

/// What a scenery box is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum SceneryKind {
    /// A house.
    Building,
    /// A post of a light or a sign.
    Pole,
    /// The trunk of a tree; its crown is only drawn.
    Tree,
    /// A wall, fence or crash barrier.
    Barrier,
    /// Anything else that stands in the way: benches, bins, boxes.
    Prop,
}

/// A part of the map that clients can load and unload; the numbers are CARLA's flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u16)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum MapLayer {
    Buildings = 1,
    Decals = 2,
    Foliage = 4,
    Ground = 8,
    ParkedVehicles = 16,
    Particles = 32,
    Props = 64,
    StreetLights = 128,
    Walls = 256,
}

impl MapLayer {
    /// The flags of all layers.
    pub const ALL: u16 = 0x1ff;
}

/// `None` for an object that nothing runs into.
pub(crate) fn kind(object: &Object) -> Option<SceneryKind> {
    match object.object_type.as_str() {
        "building" => Some(SceneryKind::Building),
        "pole" | "streetLamp" => Some(SceneryKind::Pole),
        "tree" | "vegetation" => Some(SceneryKind::Tree),
        "barrier" | "railing" | "soundBarrier" => Some(SceneryKind::Barrier),
        "obstacle" => Some(SceneryKind::Prop),
        _ => None,
    }
}

/// Label and layer of an object; `None` for an object of no known kind.
pub(crate) fn of_object(object: &Object) -> Option<(SemanticTag, MapLayer)> {
    if object.is_crosswalk() || object.object_type == "roadMark" {
        return Some((SemanticTag::RoadLines, MapLayer::Decals));
    }
    if object.object_type == "patch" {
        let lawn = object.name.contains("Lawn");
        let label = if lawn { SemanticTag::Terrain } else { SemanticTag::Sidewalks };
        return Some((label, MapLayer::Ground));
    }
    Some(match kind(object)? {
        SceneryKind::Building => (SemanticTag::Buildings, MapLayer::Buildings),
        SceneryKind::Pole if object.object_type == "streetLamp" => {
            (SemanticTag::Poles, MapLayer::StreetLights)
        }
        SceneryKind::Pole => (SemanticTag::Poles, MapLayer::Props),
        SceneryKind::Tree => (SemanticTag::Vegetation, MapLayer::Foliage),
        SceneryKind::Barrier => (barrier(&object.name), MapLayer::Walls),
        // What a person could push away may be elsewhere tomorrow.
        SceneryKind::Prop if object.name.contains("Bin") => (SemanticTag::Dynamic, MapLayer::Props),
        SceneryKind::Prop => (SemanticTag::Static, MapLayer::Props),
    })
}

fn barrier(name: &str) -> SemanticTag {
    if name.contains("Rail") {
        SemanticTag::GuardRail
    } else if name.contains("Fence") || name.contains("Hedge") {
        SemanticTag::Fences
    } else {
        SemanticTag::Walls
    }
}
