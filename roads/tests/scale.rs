//! Questions about a map of ten thousand roads. How long it takes to load is in the bench.

#[path = "common/grid.rs"]
mod grid;

use grid::{ROAD_M, grid};
use nalgebra::Point3;
use roads::{LaneTypes, Map};

#[test]
fn a_walk_through_ten_thousand_roads_arrives() {
    let map = Map::parse("grid", &grid(10_000)).expect("a clean map");
    let start = map.waypoint(1, -1, 0.5).expect("road 1 has lane -1");
    let there = map.next(&start, 9_000.0 * ROAD_M);
    assert!(matches!(there.as_slice(), [place] if place.road == 9_001), "{there:?}");
    let found = map.nearest(Point3::new(15.0 * ROAD_M + 3.0, 200.0, 0.0), LaneTypes::DRIVING);
    assert_eq!(found.map(|place| place.road), Some(1_015));
}
