//! Loading grows with the size of a map and not faster.
//!
//! A ring of short roads is read at two sizes; the shortest of some runs each counts, so that a
//! busy machine does not decide.

use std::fmt::Write;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use roads::{LaneTypes, Map};

const ROAD_M: f64 = 30.0;
/// Roads side by side before the next row begins.
const COLUMNS: u32 = 100;

fn grid(roads: u32) -> String {
    let mut text = String::from("<OpenDRIVE><header/>");
    for id in 1..=roads {
        let (x, y) = (f64::from(id % COLUMNS) * ROAD_M, f64::from(id / COLUMNS) * 20.0);
        let (before, after) = (if id == 1 { roads } else { id - 1 }, id % roads + 1);
        write!(
            text,
            "<road id=\"{id}\" length=\"{ROAD_M}\" junction=\"-1\"><link>\
             <predecessor elementType=\"road\" elementId=\"{before}\" contactPoint=\"end\"/>\
             <successor elementType=\"road\" elementId=\"{after}\" contactPoint=\"start\"/></link>\
             <planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"0\" length=\"{ROAD_M}\"><line/>\
             </geometry></planView><lanes><laneSection s=\"0\"><center><lane id=\"0\"/></center>\
             <right><lane id=\"-1\" type=\"driving\"><link><predecessor id=\"-1\"/>\
             <successor id=\"-1\"/></link><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>\
             </lane></right></laneSection></lanes></road>"
        )
        .expect("writing to a string");
    }
    text.push_str("</OpenDRIVE>");
    text
}

fn load_time(text: &str) -> Duration {
    let time = |_| {
        let started = Instant::now();
        assert!(Map::parse("grid", text).is_ok());
        started.elapsed()
    };
    (0..5).map(time).min().expect("five runs")
}

#[test]
fn ten_times_the_roads_take_about_ten_times_as_long_to_load() {
    let (small, large) = (load_time(&grid(1_000)), load_time(&grid(10_000)));
    println!("1000 roads {small:?}, 10000 roads {large:?}");
    // Quadratic loading would take a hundred times as long.
    assert!(large < small * 30, "{small:?} and {large:?}");
}

#[test]
fn a_walk_through_ten_thousand_roads_arrives() {
    let map = Map::parse("grid", &grid(10_000)).expect("a clean map");
    let start = map.waypoint(1, -1, 0.5).expect("road 1 has lane -1");
    let there = map.next(&start, 9_000.0 * ROAD_M);
    assert!(matches!(there.as_slice(), [place] if place.road == 9_001), "{there:?}");
    let found = map.nearest(Point3::new(15.0 * ROAD_M + 3.0, 200.0, 0.0), LaneTypes::DRIVING);
    assert_eq!(found.map(|place| place.road), Some(1_015));
}
