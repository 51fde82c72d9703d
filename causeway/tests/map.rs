//! Goal: `causeway map` lists, checks, draws, exports and builds maps, and says what it cannot do.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::path::PathBuf;
use std::process::{Command, Output};

fn map(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_causeway"))
        .arg("map")
        .args(arguments)
        .env_remove("CAUSEWAY_MAPS")
        .output()
        .unwrap()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr[..]].concat()).into_owned()
}

/// A folder that goes away with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("causeway-map-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn help_names_every_subcommand() {
    let text = told(&map(&["--help"]));
    for word in ["list", "check", "show", "export", "build"] {
        assert!(text.contains(word), "{word} is not in:\n{text}");
    }
}

#[test]
fn a_file_in_the_folder_is_listed_and_stands_before_the_built_in_map_of_its_name() {
    let folder = Folder::new("list");
    let mine = folder.path("Mine.xodr");
    assert!(map(&["export", "Town02", "-o", &mine]).status.success());
    std::fs::copy(&mine, folder.path("Town01.xodr")).unwrap();
    let text = told(&map(&["list", "--maps", folder.0.to_str().unwrap()]));
    let line = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
    assert!(line("Mine").contains("Mine.xodr"), "{text}");
    assert!(line("Town01 ").contains("instead of the built-in map"), "{text}");
    assert!(line("Town10HD_Opt").contains("built in"), "{text}");
}

#[test]
fn our_towns_pass_the_check_and_a_map_that_ends_the_client_fails_it_with_road_and_s() {
    let whole = map(&["check", "Town07"]);
    assert!(whole.status.success(), "{}", told(&whole));
    assert!(told(&whole).contains("0 faults") && told(&whole).contains("survives"));

    let folder = Folder::new("check");
    let path = folder.path("Torn.xodr");
    let text = roads::town::build("Town02").unwrap();
    let torn = text.replace("<successor id=\"-1\"/>", "<successor id=\"-9\"/>");
    assert_ne!(torn, text);
    std::fs::write(&path, torn).unwrap();
    let torn = map(&["check", &path]);
    assert_eq!(torn.status.code(), Some(1));
    let text = told(&torn);
    assert!(text.contains("breaks CARLA's client: road "), "{text}");
    assert!(text.contains("s = ") && text.contains("does not survive"), "{text}");

    let broken = folder.path("Broken.xodr");
    std::fs::write(&broken, "<OpenDRIVE><road").unwrap();
    assert_eq!(map(&["check", &broken]).status.code(), Some(1));
}

#[test]
fn a_built_town_depends_on_its_seed_and_passes_the_check() {
    let folder = Folder::new("build");
    let [one, same, other] = ["One.xodr", "Same.xodr", "Other.xodr"].map(|name| folder.path(name));
    for (path, seed) in [(&one, "5"), (&same, "5"), (&other, "6")] {
        let arguments =
            ["build", "--style", "village", "--seed", seed, "--blocks", "3", "-o", path.as_str()];
        let built = map(&arguments);
        assert!(built.status.success(), "{}", told(&built));
    }
    let text = |path: &String| std::fs::read_to_string(path).unwrap();
    assert_eq!(text(&one), text(&same));
    assert_ne!(text(&one), text(&other));
    assert!(map(&["check", &one]).status.success());
}

#[test]
fn a_map_is_drawn_as_png_and_as_svg_of_the_asked_width() {
    let folder = Folder::new("show");
    let [png, svg] = ["map.png", "map.svg"].map(|name| folder.path(name));
    for path in [&png, &svg] {
        let shown = map(&["show", "Town02", "-o", path.as_str(), "--width", "300"]);
        assert!(shown.status.success(), "{}", told(&shown));
    }
    let bytes = std::fs::read(&png).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    // The width stands in the first chunk, most significant byte first.
    assert_eq!(bytes[16..20], 300_u32.to_be_bytes());
    assert!(std::fs::read_to_string(&svg).unwrap().starts_with("<svg"));
}

#[test]
fn what_is_not_there_is_named_with_what_is() {
    let unknown = map(&["check", "Town99"]);
    assert_eq!(unknown.status.code(), Some(1));
    assert!(told(&unknown).contains("Town10HD_Opt"), "{}", told(&unknown));
    let gif = map(&["show", "Town01", "-o", "map.gif"]);
    assert!(!gif.status.success() && told(&gif).contains(".png or .svg"), "{}", told(&gif));
    let nowhere = map(&["check", "/nowhere/at/all.xodr"]);
    assert!(told(&nowhere).contains("/nowhere/at/all.xodr"), "{}", told(&nowhere));
    assert_eq!(map(&["build", "--style", "moon", "--seed", "1"]).status.code(), Some(2));
}

#[test]
fn a_picture_that_cannot_be_written_is_told_before_the_map_is_looked_for() {
    let folder = Folder::new("place");
    let text = told(&map(&["show", "Nowhere", "-o", &folder.path("none/a.png")]));
    assert!(text.contains("cannot write"), "{text}");
    let (new, kept) = (folder.path("new.png"), folder.path("kept.png"));
    std::fs::write(&kept, "kept").unwrap();
    for file in [&new, &kept] {
        let text = told(&map(&["show", "Nowhere", "-o", file]));
        assert!(text.contains("no map \"Nowhere\""), "{text}");
    }
    assert!(!std::fs::exists(&new).unwrap());
    assert_eq!(std::fs::read_to_string(&kept).unwrap(), "kept");
}
