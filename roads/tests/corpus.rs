//! The maps that fuzzing starts from are maps: otherwise it would only exercise refusals.

use roads::{LaneTypes, Map};

#[test]
fn every_text_fuzzing_starts_from_is_a_map_with_lanes() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus/parse");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let map = Map::parse("corpus", &text).unwrap_or_else(|error| panic!("{path:?}: {error}"));
        assert!(map.nearest(nalgebra::Point3::origin(), LaneTypes::ANY).is_some(), "{path:?}");
        assert!(!roads::mesh::ground(&map).indices.is_empty(), "{path:?}");
        count += 1;
    }
    assert!(count >= 4, "{count} in {folder}");
}
