//! Any text is a map or a refusal, and whatever is a map can be asked everything.

#![no_main]

use libfuzzer_sys::fuzz_target;
use nalgebra::Point3;
use roads::{LaneTypes, Map, picture};

fuzz_target!(|text: &str| {
    let Ok(map) = Map::parse("fuzz", text) else { return };
    let report = map.check();
    assert!(report.count >= report.diagnostics.len());
    for point in [Point3::origin(), Point3::new(50.0, -3.0, 0.0), Point3::new(1e6, -1e6, 1e3)] {
        let Some(place) = map.nearest(point, LaneTypes::ANY) else { continue };
        let _ = (map.inside(point, LaneTypes::DRIVING), map.lane(&place), map.pose(&place));
        let _ = (map.next(&place, 5.0), map.previous(&place, 5.0));
        let _ = (map.left(&place), map.right(&place), map.landmarks_ahead(&place, 50.0, false));
    }
    let _ = (map.topology(), map.crosswalks(), map.environment_objects());
    // Faces grow with the length of the roads, which the fuzzer likes to make large.
    if map.generate_waypoints(100.0).is_ok_and(|places| places.len() < 1_000) {
        let ground = roads::mesh::ground(&map);
        assert_eq!(ground.indices.len(), ground.materials.len());
        let _ = picture::draw(&map, 300);
    }
});
