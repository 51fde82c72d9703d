//! Flags of CARLA's launcher on the commands that take its place.

use std::ffi::OsString;

use carla_gateway::Flags;

/// The command line with CARLA's flags in our words; those that mean nothing here are named and
/// left out.
pub(crate) fn translated(line: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let line: Vec<OsString> = line.collect();
    let flags = match line.get(1).and_then(|word| word.to_str()) {
        Some("up") => Flags { port: "--carla", map: "--carla-map" },
        Some("gateway") => Flags { port: "--port", map: "--map" },
        _ => return line,
    };
    let Ok(words) = line.iter().cloned().map(OsString::into_string).collect::<Result<Vec<_>, _>>()
    else {
        return line;
    };
    let translated = carla_gateway::translate(words, flags);
    if !translated.ignored.is_empty() {
        eprintln!("causeway: without effect here: {}", translated.ignored.join(" "));
    }
    translated.arguments.into_iter().map(OsString::from).collect()
}
