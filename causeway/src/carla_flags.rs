//! Command lines of CARLA's launcher on the commands that take its place.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use carla_gateway::Flags;

/// What CARLA's launchers are called.
const LAUNCHERS: [&str; 2] = ["CarlaUE4.sh", "CarlaUnreal.sh"];
/// A launcher stands behind at most so many words: this program, and a shell that a script names.
const LAUNCHER_WITHIN: usize = 3;
/// A site in the place of a CARLA server has ports for CARLA's clients alone that matter: several
/// run on one machine, and port 8000 is left to their Traffic Managers.
const IN_PLACE_OF_CARLA: [&str; 5] = ["up", "--bus", "tcp/127.0.0.1:0", "--http", "127.0.0.1:0"];

/// The command line with CARLA's launcher and flags in our words; those that mean nothing here are
/// named and left out.
pub(crate) fn translated(line: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let line = without_launcher(line.collect());
    let flags = match line.get(1).and_then(|word| word.to_str()) {
        Some("up") => Flags { port: "--carla", stream_port: "--carla-stream", map: "--carla-map" },
        Some("gateway") => Flags { port: "--port", stream_port: "--stream-port", map: "--map" },
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

/// `CarlaUE4.sh FLAGS` as a site with these flags, also behind a shell's name.
fn without_launcher(line: Vec<OsString>) -> Vec<OsString> {
    let is_launcher = |word: &OsString| {
        let name = Path::new(word).file_name().and_then(OsStr::to_str);
        name.is_some_and(|name| LAUNCHERS.contains(&name))
    };
    let Some(place) = line.iter().take(LAUNCHER_WITHIN).position(is_launcher) else {
        return line;
    };
    let mut site = vec![OsString::from("causeway")];
    site.extend(IN_PLACE_OF_CARLA.map(OsString::from));
    site.extend(line.into_iter().skip(place + 1));
    site
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_launcher_of_carla_is_a_site_on_ports_of_its_own() {
        let site = "causeway up --bus tcp/127.0.0.1:0 --http 127.0.0.1:0 --carla 3000";
        for line in [
            "/opt/carla/CarlaUE4.sh -carla-rpc-port=3000",
            "causeway CarlaUnreal.sh -carla-rpc-port=3000",
            "/usr/bin/causeway /bin/bash ./CarlaUE4.sh -carla-rpc-port=3000",
        ] {
            let line = line.split(' ').map(OsString::from);
            assert_eq!(translated(line), site.split(' ').collect::<Vec<_>>());
        }
    }

    #[test]
    fn other_lines_stay() {
        let line = ["causeway", "map", "show", "Town02", "CarlaUE4.sh"].map(OsString::from);
        assert_eq!(translated(line.clone().into_iter()), line);
    }
}
