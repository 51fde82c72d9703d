//! Environment objects: everything of a town has an id, a label, a layer and a box.

#[path = "common/towns.rs"]
mod generated;

use std::collections::{BTreeMap, BTreeSet};

use generated::{town, towns};
use roads::{Map, MapLayer, SceneryKind};
use schemas::SemanticTag;

#[test]
fn ids_are_unique_and_the_same_in_every_run_and_under_both_names() {
    for map in towns() {
        let objects = map.environment_objects();
        let ids: BTreeSet<u64> = objects.iter().map(|object| object.id).collect();
        assert_eq!(ids.len(), objects.len(), "{}", map.name());
        assert!(!ids.contains(&0) && objects.is_sorted_by_key(|object| object.id));
        let names: BTreeSet<&str> = objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!(names.len(), objects.len(), "{}", map.name());
        assert_eq!(town(&format!("{}_Opt", map.name())).environment_objects(), objects);
    }
}

#[test]
fn every_scenery_box_is_one_environment_object_that_encloses_it() {
    for map in towns() {
        let mut seen = BTreeSet::new();
        for object in map.environment_objects() {
            let Some(index) = object.scenery else { continue };
            assert!(seen.insert(index), "{}: {index} twice", map.name());
            let solid = &map.scenery()[index as usize];
            let expected = match solid.kind {
                SceneryKind::Building => SemanticTag::Buildings,
                SceneryKind::Tree => SemanticTag::Vegetation,
                SceneryKind::Pole => SemanticTag::Poles,
                _ => object.label,
            };
            assert_eq!(object.label, expected, "{object:?}");
            let middle = object.pose.inverse_transform_point(&solid.pose.translation.vector.into());
            let room_m = object.half_extent_m - solid.half_extent_m - middle.coords.abs();
            assert!(room_m.min() > -1e-6, "{}: {object:?} {solid:?}", map.name());
        }
        assert_eq!(seen.len(), map.scenery().len(), "{}", map.name());
    }
}

#[test]
fn a_city_has_furniture_of_every_kind_on_every_layer_it_should() {
    let map = town("Town10HD");
    let mut by_layer: BTreeMap<MapLayer, usize> = BTreeMap::new();
    let mut nouns: BTreeMap<&str, usize> = BTreeMap::new();
    for object in map.environment_objects() {
        *by_layer.entry(object.layer).or_default() += 1;
        *nouns.entry(object.name.split('_').next().unwrap_or_default()).or_default() += 1;
    }
    for layer in [
        MapLayer::Buildings,
        MapLayer::Decals,
        MapLayer::Foliage,
        MapLayer::Ground,
        MapLayer::Props,
        MapLayer::StreetLights,
        MapLayer::Walls,
    ] {
        assert!(by_layer.get(&layer).is_some_and(|count| *count > 3), "{layer:?}: {by_layer:?}");
    }
    let furniture =
        ["House", "Tree", "StreetLamp", "Bench", "Bin", "BusStop", "Hydrant", "TrafficLight"];
    for noun in furniture {
        assert!(nouns.get(noun).is_some_and(|count| *count >= 4), "{noun}: {nouns:?}");
    }
}

#[test]
fn lights_and_signs_are_listed_with_the_labels_of_theirs() {
    let count = |map: &Map, label| {
        map.environment_objects().iter().filter(|object| object.label == label).count()
    };
    let town05 = town("Town05");
    // Near their line and beyond the junction.
    let lights = town05.traffic_lights().lights.len();
    assert_eq!(count(&town05, SemanticTag::TrafficLight), 2 * lights);
    let lamps = town05.environment_objects().iter();
    let lamps = lamps.filter(|object| object.layer == MapLayer::StreetLights).count();
    assert_eq!(count(&town05, SemanticTag::Poles), town05.posts().len() + lamps);
    assert!(count(&town("Town07"), SemanticTag::TrafficSigns) > 10);
    assert!(count(&town("Town04"), SemanticTag::GuardRail) > 20);
}
