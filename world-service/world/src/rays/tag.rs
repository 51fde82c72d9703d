//! CARLA's semantic tags.

use roads::SceneryKind;
use roads::mesh::Material;
use schemas::ActorKind;

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

pub(crate) const fn of_actor(kind: ActorKind) -> u8 {
    match kind {
        ActorKind::Vehicle => CAR,
        ActorKind::Walker => PEDESTRIANS,
        ActorKind::Prop => DYNAMIC,
        ActorKind::TrafficLight => TRAFFIC_LIGHT,
        ActorKind::TrafficSign => TRAFFIC_SIGNS,
        ActorKind::Sensor | ActorKind::Marker => 0,
    }
}
