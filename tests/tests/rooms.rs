//! Goal: rooms of a crate (the modules of its `lib.rs`, each a file and its folder) know each other
//! in one direction only. Method: read which `crate::` paths the files of each room name, outside
//! of unit tests, and count the rooms that lead back to themselves.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms in circles that a crate may have at most; every other crate has none.
const CIRCLES: [(&str, usize); 4] =
    [("roads", 5), ("scenario-service", 4), ("agents", 4), ("carla-gateway", 2)];

/// Names of other rooms that a room names.
type Rooms = BTreeMap<String, BTreeSet<String>>;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Folders of crates, from the root of the tree.
fn crates() -> Vec<String> {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let (_, members) = manifest.split_once("members = [").unwrap();
    let (members, _) = members.split_once(']').unwrap();
    members.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// All Rust files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = fs::read_dir(folder) else { return found };
    for entry in entries {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
    found
}

/// What a text names right after `crate::`, one or several in braces.
fn named(text: &str) -> BTreeSet<String> {
    let code: Vec<&str> = text
        .lines()
        .take_while(|line| *line != "#[cfg(test)]")
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect();
    let code = code.join("\n");
    let mut found = BTreeSet::new();
    for after in code.split("crate::").skip(1) {
        let parts = match after.strip_prefix('{') {
            Some(group) => group.split(';').next().unwrap_or_default().split(','),
            None => after.split(','),
        };
        let several = if after.starts_with('{') { usize::MAX } else { 1 };
        for part in parts.take(several) {
            let part = part.trim();
            let end =
                part.find(|c: char| !(c.is_ascii_lowercase() || c == '_' || c.is_ascii_digit()));
            found.insert(part[..end.unwrap_or(part.len())].to_owned());
        }
    }
    found
}

fn rooms(sources: &Path) -> Rooms {
    let mut rooms = Rooms::new();
    for file in files(sources) {
        let inside = file.strip_prefix(sources).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy();
        let room = first.trim_end_matches(".rs").to_owned();
        let is_tests = file.file_name().is_some_and(|name| name == "tests.rs")
            || inside.components().any(|part| part.as_os_str() == "tests");
        if room != "lib" && room != "main" && !is_tests {
            rooms.entry(room).or_default().extend(named(&fs::read_to_string(&file).unwrap()));
        }
    }
    let all: BTreeSet<String> = rooms.keys().cloned().collect();
    for (room, named) in &mut rooms {
        named.retain(|other| other != room && all.contains(other));
    }
    rooms
}

/// Whether what a room names leads back to it.
fn leads_back(rooms: &Rooms, room: &str) -> bool {
    let (mut seen, mut waiting) = (BTreeSet::new(), vec![room]);
    while let Some(next) = waiting.pop() {
        for named in &rooms[next] {
            if named == room {
                return true;
            }
            if seen.insert(named) {
                waiting.push(named);
            }
        }
    }
    false
}

#[test]
fn rooms_of_a_crate_know_each_other_in_one_direction() {
    let allowed: BTreeMap<&str, usize> = CIRCLES.into_iter().collect();
    for member in crates() {
        let rooms = rooms(&root().join(&member).join("src"));
        let circle: Vec<&String> = rooms.keys().filter(|room| leads_back(&rooms, room)).collect();
        let most = allowed.get(member.as_str()).copied().unwrap_or_default();
        assert!(
            circle.len() <= most,
            "{member}: wanted at most {most} rooms in circles: {circle:?}"
        );
    }
}

#[test]
fn a_circle_is_seen() {
    let names = |text: &str| named(text).into_iter().collect::<Vec<_>>();
    assert_eq!(names("use crate::calls;\n// crate::no\nlet x = crate::rpc::Y;"), ["calls", "rpc"]);
    assert_eq!(names("use crate::{rpc, stream::Hub};\n"), ["rpc", "stream"]);
    assert_eq!(names("#[cfg(test)]\nuse crate::calls;"), [""; 0]);
    let one = |name: &str| BTreeSet::from([name.to_owned()]);
    let rooms = Rooms::from([
        ("a".to_owned(), one("b")),
        ("b".to_owned(), one("c")),
        ("c".to_owned(), one("b")),
    ]);
    assert!(!leads_back(&rooms, "a") && leads_back(&rooms, "b") && leads_back(&rooms, "c"));
}
