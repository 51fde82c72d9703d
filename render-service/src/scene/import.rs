//! From the roads crate's mesh of a map to a scene.

use std::collections::BTreeMap;

use bodies::Material;
use roads::mesh::Material as RoadMaterial;
use schemas::{SemanticTag, TagId, Vec3};

use super::buildings::Buildings;
use super::coat::ThingBoxes;
use super::foliage::crowns;
use super::instance::signal::Signals;
use super::instance::street_lamp::StreetLamps;
use super::town::{Surface, TownScene, WallKind};

impl TownScene {
    /// The scene of a map.
    pub fn of_map(map: &roads::Map) -> Self {
        // One surface per material: a house that stands in two tiles of the mesh stays one house.
        let mut merged: BTreeMap<RoadMaterial, Surface> = BTreeMap::new();
        for part in roads::mesh::render(map).surfaces {
            let Some((material, variant)) = material_of(part.material) else { continue };
            let surface =
                merged.entry(part.material).or_insert_with(|| Surface::empty(material, variant));
            let first = surface.positions_m.len() as u32;
            surface.positions_m.extend(part.positions_m.into_iter().map(Vec3::from));
            surface.normals.extend(part.normals.into_iter().map(Vec3::from));
            let tag = match part.material {
                RoadMaterial::Bridge => SemanticTag::Bridge,
                _ => material.tag(),
            };
            surface.labels.resize(surface.positions_m.len(), u32::from(tag.number()));
            for (triangle, thing) in part.indices.iter().zip(&part.things) {
                let triangle = triangle.map(|corner| first + corner);
                surface.triangles.push(triangle);
                let Some(label) = thing.and_then(|thing| label_of(map, thing)) else { continue };
                for corner in triangle {
                    if let Some(slot) = surface.labels.get_mut(corner as usize) {
                        *slot = label;
                    }
                }
            }
        }
        let leaves = merged.remove(&RoadMaterial::Foliage);
        let crowns = leaves.as_ref().map(crowns).unwrap_or_default();
        let scene = Self::new(map.digest(), &merged.into_values().collect::<Vec<_>>());
        let (signals, street_lamps) = (Signals::of_map(map), StreetLamps::of_map(map));
        let (boxes, buildings) = (ThingBoxes::of_map(map), Buildings::of_map(map));
        Self { signals, street_lamps, crowns, boxes, buildings, ..scene }
    }
}

/// The packed label of the thing at a place of the map's scenery.
fn label_of(map: &roads::Map, place: u32) -> Option<u32> {
    let thing = map.scenery().get(place as usize)?;
    Some(TagId::of_scenery(thing.label, place))
}

/// What draws a material, and in which kind of wall; `None` for what is not drawn.
fn material_of(material: RoadMaterial) -> Option<(Material, WallKind)> {
    let plain = |material| (material, WallKind::Plaster);
    Some(match material {
        RoadMaterial::Asphalt => plain(Material::Asphalt),
        RoadMaterial::MarkingWhite | RoadMaterial::Crosswalk => plain(Material::MarkingWhite),
        RoadMaterial::MarkingYellow => plain(Material::MarkingYellow),
        RoadMaterial::Curb => plain(Material::Kerb),
        RoadMaterial::Sidewalk => plain(Material::Sidewalk),
        RoadMaterial::Grass => plain(Material::Grass),
        RoadMaterial::Wall => (Material::Wall, WallKind::Plaster),
        RoadMaterial::Brick => (Material::Wall, WallKind::Brick),
        RoadMaterial::Concrete => (Material::Wall, WallKind::Concrete),
        // The facade shader draws windows, filtered at every distance.
        RoadMaterial::Window => return None,
        RoadMaterial::Roof => plain(Material::Roof),
        RoadMaterial::Metal => plain(Material::Metal),
        RoadMaterial::Trunk => plain(Material::Bark),
        RoadMaterial::Foliage => plain(Material::Foliage),
        RoadMaterial::Bridge => plain(Material::Concrete),
        // The roads crate may learn new materials before this one does.
        _ => plain(Material::Concrete),
    })
}
