//! CARLA's semantic labels and map layers, and which object has which.

use serde::{Deserialize, Serialize};

use crate::model::Object;
use crate::scenery::{SceneryKind, kind};

/// What semantic cameras see in a thing; the numbers are CARLA's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum SemanticLabel {
    Roads = 1,
    Sidewalks = 2,
    Buildings = 3,
    Walls = 4,
    Fences = 5,
    Poles = 6,
    TrafficLight = 7,
    TrafficSigns = 8,
    Vegetation = 9,
    Terrain = 10,
    Car = 14,
    Static = 20,
    Dynamic = 21,
    RoadLines = 24,
    GuardRail = 28,
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

/// Label and layer of an object; `None` for an object of no known kind.
pub(crate) fn of_object(object: &Object) -> Option<(SemanticLabel, MapLayer)> {
    if object.is_crosswalk() || object.object_type == "roadMark" {
        return Some((SemanticLabel::RoadLines, MapLayer::Decals));
    }
    if object.object_type == "patch" {
        let lawn = object.name.contains("Lawn");
        let label = if lawn { SemanticLabel::Terrain } else { SemanticLabel::Sidewalks };
        return Some((label, MapLayer::Ground));
    }
    Some(match kind(object)? {
        SceneryKind::Building => (SemanticLabel::Buildings, MapLayer::Buildings),
        SceneryKind::Pole if object.object_type == "streetLamp" => {
            (SemanticLabel::Poles, MapLayer::StreetLights)
        }
        SceneryKind::Pole => (SemanticLabel::Poles, MapLayer::Props),
        SceneryKind::Tree => (SemanticLabel::Vegetation, MapLayer::Foliage),
        SceneryKind::Barrier => (barrier(&object.name), MapLayer::Walls),
        // What a person could push away may be elsewhere tomorrow.
        SceneryKind::Prop if object.name.contains("Bin") => {
            (SemanticLabel::Dynamic, MapLayer::Props)
        }
        SceneryKind::Prop => (SemanticLabel::Static, MapLayer::Props),
    })
}

fn barrier(name: &str) -> SemanticLabel {
    if name.contains("Rail") {
        SemanticLabel::GuardRail
    } else if name.contains("Fence") || name.contains("Hedge") {
        SemanticLabel::Fences
    } else {
        SemanticLabel::Walls
    }
}
