//! From the roads crate's mesh of a map to a scene.

use std::collections::BTreeMap;

use roads::mesh::Material as RoadMaterial;
use schemas::Vec3;

use super::material::Material;
use super::town::{Surface, TownScene};

impl TownScene {
    /// The scene of a map.
    pub fn of_map(map: &roads::Map) -> Self {
        // One surface per material: a house that stands in two tiles of the mesh stays one house.
        let mut merged: BTreeMap<RoadMaterial, Surface> = BTreeMap::new();
        for part in roads::mesh::render(map).surfaces {
            let surface = merged.entry(part.material).or_insert_with(|| Surface {
                material: material_of(part.material),
                positions_m: Vec::new(),
                normals: Vec::new(),
                triangles: Vec::new(),
            });
            let first = surface.positions_m.len() as u32;
            surface.positions_m.extend(part.positions_m.into_iter().map(Vec3::from));
            surface.normals.extend(part.normals.into_iter().map(Vec3::from));
            surface.triangles.extend(part.indices.into_iter().map(|t| t.map(|corner| first + corner)));
        }
        Self::new(map.digest(), &merged.into_values().collect::<Vec<_>>())
    }
}

fn material_of(material: RoadMaterial) -> Material {
    match material {
        RoadMaterial::Asphalt => Material::Asphalt,
        RoadMaterial::MarkingWhite | RoadMaterial::Crosswalk => Material::MarkingWhite,
        RoadMaterial::MarkingYellow => Material::MarkingYellow,
        RoadMaterial::Curb => Material::Kerb,
        RoadMaterial::Sidewalk => Material::Sidewalk,
        RoadMaterial::Grass => Material::Grass,
        RoadMaterial::Wall => Material::Wall,
        RoadMaterial::Window => Material::Glass,
        RoadMaterial::Roof => Material::Roof,
        RoadMaterial::Metal => Material::Metal,
        RoadMaterial::Trunk => Material::Bark,
        RoadMaterial::Foliage => Material::Foliage,
        // The roads crate may learn new materials before this one does.
        _ => Material::Concrete,
    }
}
