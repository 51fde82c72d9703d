//! Our half of `benches/beside_wheel.py`: the same calls on the same questions, timed.
//!
//! `beside_wheel MAP.xodr QUESTIONS`: every line of the second file is a point `x y z` in the map's
//! frame. Prints one JSON object: seconds per call, or per load, and bytes of memory for the map.
#![allow(clippy::print_stdout, reason = "this is what the program is for")]

use std::error::Error;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::Point3;
use roads::{LaneTypes, Map, Waypoint};

/// Every measurement is the best of this many, so that other work on the machine counts less.
const ROUNDS: usize = 7;
/// Distance of all questions about places ahead, in metres.
const STEP_M: f64 = 2.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [map_path, questions_path] = arguments.as_slice() else {
        return Err("wanted: MAP.xodr QUESTIONS".into());
    };
    let text: Arc<str> = std::fs::read_to_string(map_path)?.into();
    let points = std::fs::read_to_string(questions_path)?;
    let points: Vec<Point3<f64>> = points.lines().map(point).collect::<Result<_, _>>()?;

    let before_bytes = resident_bytes()?;
    let map = Map::parse_shared("map", Arc::clone(&text))?;
    let memory_bytes = resident_bytes()?.saturating_sub(before_bytes);
    // Dropping the map is in it, on both sides. What is worked out only when somebody asks is not:
    // spawn points and speed limits, which the client does not know at all.
    let load_s = best(1, || black_box(Map::parse_shared("map", Arc::clone(&text)).is_ok()));
    let places: Vec<Waypoint> =
        points.iter().filter_map(|point| map.nearest(*point, LaneTypes::DRIVING)).collect();
    // The client computes the pose of every waypoint it returns, so these do too, all of it.
    let pose = |place: &Waypoint| {
        black_box(map.lane_pose(place));
    };
    let get_waypoint_s = best(points.len(), || {
        for place in points.iter().filter_map(|point| map.nearest(*point, LaneTypes::DRIVING)) {
            pose(&place);
        }
    });
    let next_s = best(places.len(), || {
        for place in &places {
            map.next(place, STEP_M).iter().for_each(pose);
        }
    });
    let generate_s = best(1, || {
        map.generate_waypoints(STEP_M).iter().flatten().for_each(pose);
    });
    println!(
        "{{\"load_s\":{load_s},\"get_waypoint_s\":{get_waypoint_s},\"next_s\":{next_s},\
         \"generate_waypoints_s\":{generate_s},\"memory_bytes\":{memory_bytes}}}"
    );
    Ok(())
}

fn point(line: &str) -> Result<Point3<f64>, Box<dyn Error>> {
    let numbers: Vec<f64> = line
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, std::num::ParseFloatError>>()?;
    match numbers.as_slice() {
        [x, y, z] => Ok(Point3::new(*x, *y, *z)),
        _ => Err(format!("wanted three numbers, found {line:?}").into()),
    }
}

/// Seconds of the fastest round, divided by the number of calls in it.
fn best<T>(calls: usize, mut round: impl FnMut() -> T) -> f64 {
    let seconds = (0..ROUNDS).map(|_| {
        let started = Instant::now();
        black_box(round());
        started.elapsed().as_secs_f64()
    });
    seconds.fold(f64::INFINITY, f64::min) / calls.max(1) as f64
}

/// Memory of this process that is in use, in bytes (Linux).
fn resident_bytes() -> Result<u64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).ok_or("no VmRSS")?;
    let kilobytes: u64 = line.trim().trim_end_matches("kB").trim().parse()?;
    Ok(kilobytes * 1024)
}
