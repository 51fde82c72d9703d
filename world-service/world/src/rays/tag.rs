//! CARLA's semantic tags.

use roads::SceneryKind;
use roads::mesh::Material;
use schemas::ActorKind;

use crate::blueprint::{Blueprint, BodySpec};

pub(crate) const ROADS: u8 = 1;
const SIDEWALKS: u8 = 2;
const BUILDINGS: u8 = 3;
const POLES: u8 = 6;
const TRAFFIC_LIGHT: u8 = 7;
const TRAFFIC_SIGNS: u8 = 8;
const VEGETATION: u8 = 9;
const TERRAIN: u8 = 10;
const PEDESTRIANS: u8 = 12;
const CAR: u8 = 14;
const STATIC: u8 = 20;
const DYNAMIC: u8 = 21;
const GUARD_RAIL: u8 = 28;

/// A prop lighter than this may be moved by hand.
const MOVABLE_KG: f32 = 100.0;

pub(crate) const fn of_material(material: Material) -> u8 {
    match material {
        Material::Curb | Material::Sidewalk => SIDEWALKS,
        Material::Grass => TERRAIN,
        _ => ROADS,
    }
}

pub(crate) const fn of_scenery(kind: SceneryKind) -> u8 {
    match kind {
        SceneryKind::Building => BUILDINGS,
        SceneryKind::Pole => POLES,
        SceneryKind::Tree => VEGETATION,
        SceneryKind::Barrier => GUARD_RAIL,
        _ => STATIC,
    }
}

/// Of everything of a blueprint; 0 for what cannot be seen.
pub(crate) fn of_actor(blueprint: &Blueprint) -> u8 {
    match (blueprint.kind(), &blueprint.body) {
        (ActorKind::TrafficLight, _) => TRAFFIC_LIGHT,
        (ActorKind::TrafficSign, _) => TRAFFIC_SIGNS,
        (ActorKind::Walker, _) => PEDESTRIANS,
        (ActorKind::Vehicle, _) => CAR,
        (ActorKind::Prop, BodySpec::Prop(spec)) if spec.mass_kg < MOVABLE_KG => DYNAMIC,
        (ActorKind::Prop, _) => STATIC,
        (ActorKind::Sensor | ActorKind::Marker, _) => 0,
    }
}
