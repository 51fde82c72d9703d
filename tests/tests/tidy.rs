//! Goal: what no lint can say about the sources. Method: read them all.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Lines of a file without its tests.
const LINES_MAX: usize = 400;
/// Files that are longer, each with its reason.
const LONGER: [(&str, &str); 1] =
    [("world-service/world/tests/commands.rs", "one command after the other")];

/// Words that must not be committed, and why. In two parts, as this file is read too.
const UNWANTED: [([&str; 2], &str); 6] = [
    (["todo", "!("], "unfinished code fails at run time"),
    (["unimplemented", "!("], "unfinished code fails at run time"),
    (["dbg", "!("], "left over from debugging"),
    (["FIX", "ME"], "open an issue and name it: TODO(#123)"),
    (["Congestion", "Control::Block"], "one slow receiver would stop everybody else"),
    (["#[ign", "ore"], "a test that is not run protects nothing"),
];

struct Source {
    path: String,
    text: String,
}

impl Source {
    /// Lines before the unit tests, which come last in a file.
    fn lines_without_tests(&self) -> impl Iterator<Item = &str> {
        let tests = self.text.find("\n#[cfg(test)]\nmod tests");
        self.text[..tests.unwrap_or(self.text.len())].lines()
    }
}

/// All sources that people write, with paths from the root of the tree.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let skipped = name.starts_with('.') || matches!(name.as_str(), "target" | "_out");
            if path.is_dir() && !skipped {
                folders.push(path);
            } else if path
                .extension()
                .is_some_and(|end| end == "rs" || end == "py" || end == "wgsl")
            {
                let relative = path.strip_prefix(&root).unwrap().to_string_lossy().into_owned();
                found.push(Source { path: relative, text: fs::read_to_string(&path).unwrap() });
            }
        }
    }
    let generated =
        |path: &str| path.contains("schemas/src/generated/") || path.contains("causeway/wire/");
    found.retain(|source| !generated(&source.path));
    found.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(found.len() > 50, "only {} sources found", found.len());
    found
}

#[test]
fn files_are_short_enough_to_be_read_at_once() {
    let too_long: Vec<String> = sources()
        .iter()
        .filter(|source| !LONGER.iter().any(|(path, _)| *path == source.path))
        .map(|source| (source.lines_without_tests().count(), &source.path))
        .filter(|(lines, _)| *lines > LINES_MAX)
        .map(|(lines, path)| format!("{path}: {lines} lines"))
        .collect();
    assert!(too_long.is_empty(), "over {LINES_MAX} lines without tests: {too_long:#?}");
}

#[test]
fn no_file_is_said_to_be_longer_that_is_not() {
    let sources = sources();
    for (path, _) in LONGER {
        let source = sources.iter().find(|source| source.path == path);
        let lines = source.map_or(0, |source| source.lines_without_tests().count());
        assert!(lines > LINES_MAX, "{path} has {lines} lines: take it from the list");
    }
}

#[test]
fn nothing_unfinished_or_left_over_is_in_the_sources() {
    let sources = sources();
    for (parts, reason) in UNWANTED {
        let word = parts.concat();
        for source in &sources {
            for (index, line) in source.lines_without_tests().enumerate() {
                assert!(!line.contains(&word), "{}:{}: {word}: {reason}", source.path, index + 1);
            }
        }
    }
}

#[test]
fn an_open_end_names_its_issue() {
    for source in sources() {
        for (index, line) in source.text.lines().enumerate() {
            let open_end = line.contains(concat!("TO", "DO"));
            let named = line.contains(concat!("TO", "DO(#"));
            assert!(!open_end || named, "{}:{}: name the issue", source.path, index + 1);
        }
    }
}

/// Public names that nothing else says but this list, and why they stay.
const SAID_ONCE: [(&str, &str); 1] = [("FLOAT", "a type of CARLA's log format between two others")];

/// What is public is never found dead by the compiler.
#[test]
fn whatever_is_public_is_named_a_second_time() {
    let sources = sources();
    let mut count_of: BTreeMap<&str, usize> = BTreeMap::new();
    let is_in_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    for source in &sources {
        for word in source.text.split(|letter| !is_in_word(letter)) {
            *count_of.entry(word).or_default() += 1;
        }
    }
    let mut dead = Vec::new();
    for source in sources.iter().filter(|source| source.path.contains("/src/")) {
        for line in source.lines_without_tests() {
            let Some(item) = line.trim_start().strip_prefix("pub ") else { continue };
            let mut words = item.split(|letter| !is_in_word(letter)).skip_while(|word| {
                matches!(*word, "const" | "async" | "fn" | "struct" | "enum" | "trait" | "type")
            });
            let name = words.next().unwrap_or_default();
            if count_of.get(name) == Some(&1) {
                dead.push(format!("{}: {name}", source.path));
            }
        }
    }
    assert!(dead.is_empty(), "nobody uses them: {dead:#?}");
    for (name, _) in SAID_ONCE {
        assert_eq!(count_of.get(name).copied(), Some(2), "{name}: take it from the list");
    }
}

/// Folders that programs write and people do not: builds, benches, caches, environments.
const OUTPUT: [&str; 8] =
    ["target", "build", "dist", "criterion", "__pycache__", ".venv", "_out", "node_modules"];

#[test]
fn no_output_of_builds_and_benches_is_committed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if !root.join(".git").exists() {
        println!("skipped: no checkout of git");
        return;
    }
    let listing = Command::new("git").arg("-C").arg(&root).arg("ls-files").output().unwrap();
    assert!(listing.status.success(), "{}", String::from_utf8_lossy(&listing.stderr));
    let files = String::from_utf8(listing.stdout).unwrap();
    assert!(files.lines().any(|file| file == "tests/tests/tidy.rs"), "{files}");
    let output: Vec<&str> = files
        .lines()
        .filter(|file| Path::new(file).iter().any(|part| OUTPUT.iter().any(|name| part == *name)))
        .collect();
    assert!(output.is_empty(), "remove them with git rm --cached: {output:#?}");
}

/// Comments alone: the formatter breaks code, but no prose, and no literal needs breaking.
#[test]
fn comments_fit_two_files_side_by_side() {
    let columns_max = 100;
    for source in sources().iter().filter(|source| source.path.ends_with(".rs")) {
        for (index, line) in source.text.lines().enumerate() {
            let comment = line.trim_start().trim_start_matches(['/', '!']).trim_start();
            let is_prose = line.trim_start().starts_with("//")
                && !comment.starts_with(['|', '#'])
                && !comment.contains("();")
                && !comment.contains("?;");
            let columns = line.chars().count();
            let fits = columns <= columns_max || !is_prose;
            assert!(fits, "{}:{}: {columns} columns", source.path, index + 1);
        }
    }
}
