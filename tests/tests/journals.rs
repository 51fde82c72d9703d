//! Goal: what happened in a world can be replayed by another process, and a replay that goes
//! another way is noticed.
//! Method: a session on a site that keeps journals, a killed world service, `causeway record`.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;
use tests::{AT_LAST, Process, Service, Site};

/// A folder that goes away with the test.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// What a command that ends by itself says, and whether it succeeded.
fn said(arguments: &[&str]) -> (String, bool) {
    let mut process = Process::start(arguments);
    let status = process.wait(AT_LAST);
    (process.log(), status.success())
}

#[test]
fn a_killed_service_leaves_a_journal_that_another_process_replays() {
    let name = format!("causeway-journal-{}", std::process::id());
    let folder = Folder(std::env::temp_dir().join(name));
    std::fs::create_dir_all(&folder.0).unwrap();
    let site = Site::start(&["--no-render", "--journals", folder.0.to_str().unwrap()]);
    let mut session = site.session();
    session.reset(json!({"scenario_name": "trolley_saves", "seed": 7}));
    let bus = site.bus().to_string();
    let (listed, _) = said(&["record", "worlds", "--connect", &bus]);
    let world = listed.split_whitespace().next().unwrap().to_owned();
    let (told, done) = said(&["record", "start", "--world", "5", "--connect", &bus]);
    assert!(!done && told.contains("an id that `causeway record worlds` names"), "{told}");
    let (told, done) = said(&["record", "start", "--world", &world, "--connect", &bus]);
    assert!(done, "{told}");
    session.step(json!({"action_type": "control", "throttle": 0.7, "steer": 0.0}));
    for _ in 0..20 {
        session.step(json!({"action_type": "observe"}));
    }
    let path = folder.0.join(format!("local/world-{world}-1.journal"));
    let until = Instant::now() + AT_LAST;
    while said(&["record", "info", path.to_str().unwrap()]).0.contains(", 0.000 s") {
        assert!(Instant::now() < until, "no tick is written");
    }
    site.kill(Service::World);

    let (told, done) = said(&["record", "verify", path.to_str().unwrap()]);
    assert!(done && told.contains("the same to the bit"), "{told}");
    let mut bytes = std::fs::read(&path).unwrap();
    let last = bytes.len() - 10;
    bytes[last] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let (told, done) = said(&["record", "verify", path.to_str().unwrap()]);
    assert!(!done && told.contains("digest"), "{told}");
}
