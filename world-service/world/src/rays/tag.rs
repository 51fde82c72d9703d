//! CARLA's semantic tags of what rays hit.

use roads::mesh::Material;
use schemas::SemanticTag;

use crate::blueprint::Blueprint;

pub(crate) const ROADS: u8 = SemanticTag::Roads.number();

pub(crate) const fn of_material(material: Material) -> u8 {
    let tag = match material {
        Material::Curb | Material::Sidewalk => SemanticTag::Sidewalks,
        Material::Grass => SemanticTag::Terrain,
        Material::Bridge => SemanticTag::Bridge,
        _ => SemanticTag::Roads,
    };
    tag.number()
}

/// Of everything of a blueprint; 0 for what cannot be seen.
pub(crate) fn of_actor(blueprint: &Blueprint) -> u8 {
    SemanticTag::of_actor(blueprint.kind(), &blueprint.id).number()
}
