//! What a journal is about.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use world_service::journal::Reader;

/// Bytes of a mebibyte.
const MIB: f64 = 1_048_576.0;

/// Prints what a journal has.
pub(super) fn info(path: &Path, reader: &Reader<BufReader<File>>) {
    let (head, index) = (reader.head(), reader.index());
    let (first, last, secs) = (index.first(), index.last(), index.total_secs());
    println!("Journal: {}", path.display());
    println!("Map: {}", head.map_name);
    println!("Ticks: {first} to {last}, {secs:.3} s");
    println!("Keyframes: {}", index.keyframe_count());
    println!("Digest: {:016x}", head.digest());
    println!("First state: {:016x}", head.first.state_hash);
    if let Ok(bytes) = std::fs::metadata(path).map(|file| file.len()) {
        let mib = bytes as f64 / MIB;
        let an_hour = if secs > 0.0 { mib * 3_600.0 / secs } else { 0.0 };
        println!("Size: {mib:.1} MiB, {an_hour:.0} MiB an hour");
    }
    let end = if reader.is_ended() { "in order" } else { "cut off, as its process or disk ended" };
    println!("End: {end}");
}
