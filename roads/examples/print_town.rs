//! Prints a generated town: `print_town Town03` its OpenDRIVE text, `print_town Town03 2.0` the
//! places on its driving lanes every 2 m as `road section lane s x y z heading_rad pitch_rad`.
//! Without a name, it lists the towns.
#![allow(clippy::print_stdout, reason = "this is what the program is for")]

use std::io::{self, BufWriter, Write};

use roads::{Map, town};

fn main() -> io::Result<()> {
    let mut out = BufWriter::new(io::stdout().lock());
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, step_m) = match arguments.as_slice() {
        [] => {
            for name in town::names() {
                writeln!(out, "{name}")?;
            }
            return out.flush();
        }
        [name] => (name, None),
        [name, step] => (name, Some(step.parse().map_err(io::Error::other)?)),
        _ => return Err(io::Error::other("wanted: NAME [STEP_M]")),
    };
    let text = town::build(name)
        .ok_or_else(|| io::Error::other(format!("no town {name:?}; no name lists them")))?;
    match step_m {
        None => out.write_all(text.as_bytes())?,
        Some(step_m) => {
            let map = Map::parse(name, &text).map_err(io::Error::other)?;
            places(&map, step_m, &mut out)?;
        }
    }
    out.flush()
}

fn places(map: &Map, step_m: f64, out: &mut impl Write) -> io::Result<()> {
    for place in map.generate_waypoints(step_m).map_err(io::Error::other)? {
        let Some(pose) = map.lane_pose(&place) else { continue };
        let (p, place_s) = (pose.point, place.s);
        writeln!(
            out,
            "{} {} {} {place_s} {} {} {} {} {}",
            place.road, place.section, place.lane, p.x, p.y, p.z, pose.heading_rad, pose.pitch_rad
        )?;
    }
    Ok(())
}
