//! Flags of CARLA's launcher on the commands that take its place.

use std::ffi::OsString;

/// The command line with CARLA's flags in our words; those that mean nothing here are named and
/// left out.
pub(crate) fn translated(line: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let line: Vec<OsString> = line.collect();
    let port_flag = match line.get(1).and_then(|word| word.to_str()) {
        Some("up") => "--carla",
        Some("gateway") => "--port",
        _ => return line,
    };
    let Ok(words) = line.iter().cloned().map(OsString::into_string).collect::<Result<Vec<_>, _>>()
    else {
        return line;
    };
    let translated = carla_gateway::translate(words, port_flag);
    if !translated.ignored.is_empty() {
        eprintln!("causeway: without effect here: {}", translated.ignored.join(" "));
    }
    translated.arguments.into_iter().map(OsString::from).collect()
}
