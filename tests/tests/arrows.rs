//! Goal: dependencies point down, and what a crate deliberately does without stays out.
//! Method: read what Cargo resolves, with development dependencies.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Whom each crate of ours may name. A crate that is missing here may be named by nobody.
const MAY_NAME: [(&str, &[&str]); 29] = [
    ("schemas", &[]),
    ("codegen", &[]),
    ("blueprints", &["schemas"]),
    ("bodies", &["schemas"]),
    ("bus", &["monitoring", "schemas"]),
    ("worlds", &["bus", "roads", "schemas"]),
    ("whole-file", &[]),
    ("batched-queue", &[]),
    ("seats", &[]),
    ("tenancy", &["schemas"]),
    ("monitoring", &[]),
    ("admin", &["monitoring", "seats"]),
    ("signals", &["monitoring"]),
    ("port-lending", &[]),
    ("roads", &["schemas"]),
    ("recording", &[]),
    ("mcap-export", &["roads", "schemas"]),
    ("replay-page", &["mcap-export", "roads", "schemas"]),
    ("agents", &["roads", "schemas"]),
    ("world", &["agents", "blueprints", "bodies", "roads", "schemas"]),
    ("manoeuvres", &["world", "agents", "roads", "schemas"]),
    ("rollouts", &["world", "agents", "blueprints", "roads", "schemas"]),
    ("rollout-service", &["rollouts", "roads", "schemas", "signals"]),
    (
        "world-service",
        &[
            "world",
            "agents",
            "batched-queue",
            "bus",
            "monitoring",
            "roads",
            "schemas",
            "signals",
            "whole-file",
        ],
    ),
    ("raster", &[]),
    ("render-service", &["bodies", "bus", "monitoring", "raster", "roads", "schemas", "signals"]),
    (
        "scenario-service",
        &[
            "agents",
            "bus",
            "monitoring",
            "port-lending",
            "roads",
            "schemas",
            "seats",
            "signals",
            "tenancy",
            "worlds",
        ],
    ),
    (
        "carla-gateway",
        &[
            "batched-queue",
            "blueprints",
            "bus",
            "monitoring",
            "port-lending",
            "recording",
            "roads",
            "schemas",
            "seats",
            "signals",
            "tenancy",
            "whole-file",
            "worlds",
        ],
    ),
    (
        "causeway",
        &[
            "manoeuvres",
            "rollout-service",
            "world-service",
            "render-service",
            "scenario-service",
            "carla-gateway",
            "admin",
            "batched-queue",
            "bus",
            "monitoring",
            "recording",
            "mcap-export",
            "replay-page",
            "roads",
            "schemas",
            "signals",
            "tenancy",
        ],
    ),
];

/// Outside crates that only these crates of ours may name.
const OWNED: [(&str, &[&str]); 6] = [
    ("zenoh", &["bus"]),
    ("flatbuffers", &["schemas"]),
    ("rapier3d", &["world"]),
    ("wgpu", &["render-service"]),
    ("prometheus-client", &["monitoring"]),
    ("hyper", &["admin", "scenario-service"]),
];

/// What must not come in through anybody else either.
const NEVER_BELOW: [(&str, &[&str]); 12] = [
    ("schemas", &["zenoh", "tokio", "rapier3d", "wgpu"]),
    ("bodies", &["zenoh", "tokio", "rapier3d", "wgpu", "raster"]),
    ("roads", &["zenoh", "tokio", "rapier3d", "wgpu"]),
    ("recording", &["zenoh", "tokio", "rapier3d", "wgpu"]),
    ("agents", &["zenoh", "tokio", "rapier3d", "wgpu"]),
    ("world", &["bus", "zenoh", "tokio", "wgpu", "axum", "raster"]),
    ("rollouts", &["bus", "zenoh", "tokio", "wgpu", "axum"]),
    ("rollout-service", &["bus", "zenoh", "wgpu", "axum"]),
    ("world-service", &["wgpu", "axum"]),
    ("render-service", &["rapier3d", "axum"]),
    ("scenario-service", &["rapier3d", "wgpu"]),
    ("carla-gateway", &["rapier3d", "wgpu", "axum"]),
];

/// Names of packages by name: what each one names itself, and what it names outside of tests.
struct Packages {
    ours: BTreeSet<String>,
    names: BTreeMap<String, BTreeSet<String>>,
    names_outside_of_tests: BTreeMap<String, BTreeSet<String>>,
}

impl Packages {
    fn read() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let output = Command::new(env!("CARGO"))
            .args(["metadata", "--format-version", "1", "--offline", "--filter-platform"])
            // What other platforms need was never downloaded.
            .arg(format!("{}-unknown-linux-gnu", std::env::consts::ARCH))
            .current_dir(root)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
        let list = |value: &Value| value.as_array().unwrap().clone();
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        let name_of: BTreeMap<String, String> = list(&metadata["packages"])
            .iter()
            .map(|package| (text(&package["id"]), text(&package["name"])))
            .collect();
        let ours = list(&metadata["workspace_members"])
            .iter()
            .map(|id| name_of[&text(id)].clone())
            .collect();
        let (mut names, mut names_outside_of_tests) = (BTreeMap::new(), BTreeMap::new());
        for node in list(&metadata["resolve"]["nodes"]) {
            let package = name_of[&text(&node["id"])].clone();
            let all: &mut BTreeSet<String> = names.entry(package.clone()).or_default();
            let normal: &mut BTreeSet<String> = names_outside_of_tests.entry(package).or_default();
            for dependency in list(&node["deps"]) {
                let name = &name_of[&text(&dependency["pkg"])];
                all.insert(name.clone());
                if list(&dependency["dep_kinds"]).iter().any(|kind| kind["kind"] != "dev") {
                    normal.insert(name.clone());
                }
            }
        }
        Self { ours, names, names_outside_of_tests }
    }

    fn below(&self, package: &str) -> BTreeSet<String> {
        let mut found = BTreeSet::new();
        let mut waiting = vec![package.to_owned()];
        while let Some(name) = waiting.pop() {
            for below in &self.names_outside_of_tests[&name] {
                if found.insert(below.clone()) {
                    waiting.push(below.clone());
                }
            }
        }
        found
    }
}

#[test]
fn crates_name_only_crates_below_them() {
    let packages = Packages::read();
    let listed: BTreeMap<&str, &[&str]> = MAY_NAME.into_iter().collect();
    for package in packages.ours.iter().filter(|name| *name != "tests") {
        let allowed = listed.get(package.as_str()).copied();
        let allowed = allowed.unwrap_or_else(|| panic!("give {package} a line in MAY_NAME"));
        for named in packages.names[package].intersection(&packages.ours) {
            assert!(allowed.contains(&named.as_str()), "{package} must not name {named}");
        }
    }
}

#[test]
fn the_bus_the_schemas_the_physics_and_the_gpu_have_one_door_each() {
    let packages = Packages::read();
    for (outside, owners) in OWNED {
        let named_by: Vec<&String> =
            packages.ours.iter().filter(|ours| packages.names[*ours].contains(outside)).collect();
        assert_eq!(named_by, *owners, "crates that name {outside}");
    }
}

#[test]
fn nothing_unwanted_comes_in_through_others() {
    let packages = Packages::read();
    for (package, unwanted) in NEVER_BELOW {
        let below = packages.below(package);
        for name in unwanted {
            assert!(!below.contains(*name), "{package} must do without {name}");
        }
    }
}
