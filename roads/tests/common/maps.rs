//! Maps with their answers.

use std::path::{Path, PathBuf};

use roads::Map;
use serde_json::Value;

/// One map and what the client library says about it.
#[allow(dead_code, reason = "not every test reads the answers")]
pub(crate) struct Judged {
    pub(crate) name: String,
    pub(crate) map: Map,
    pub(crate) answers: Value,
}

fn folder() -> PathBuf {
    std::env::var_os("CAUSEWAY_MAPS_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/maps"),
        PathBuf::from,
    )
}

/// Every map that has a file of answers, by name; none, with a message, without the folder.
pub(crate) fn all() -> Vec<Judged> {
    let oracle = folder().join("oracle");
    let Ok(entries) = std::fs::read_dir(&oracle) else {
        println!("skipped: no maps in {:?}; set CAUSEWAY_MAPS_DIR", folder());
        return Vec::new();
    };
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter_map(|file| file.strip_suffix(".json").map(str::to_owned))
        .collect();
    names.sort();
    names.into_iter().map(|name| read(&oracle, name)).collect()
}

fn read(oracle: &Path, name: String) -> Judged {
    let text = std::fs::read_to_string(folder().join(format!("{name}.xodr"))).expect("its map");
    let answers = std::fs::read_to_string(oracle.join(format!("{name}.json"))).expect("readable");
    let answers = serde_json::from_str(&answers).expect("answers in JSON");
    let map = Map::parse(&name, &text).unwrap_or_else(|error| panic!("{error}"));
    Judged { name, map, answers }
}
