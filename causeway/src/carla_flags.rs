//! Command lines of CARLA's launcher on the commands that take its place.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use carla_gateway::Flags;

use crate::outlet::Outlet;

/// What CARLA's launchers are called, and the program that each starts.
const LAUNCHERS: [(&str, &str); 2] =
    [("CarlaUE4.sh", "CarlaUE4-Linux-Shipping"), ("CarlaUnreal.sh", "CarlaUnreal-Linux-Shipping")];
/// Where a process has its name, and how many bytes of it are kept.
const NAME_FILE: &str = "/proc/self/comm";
const NAME_BYTES: usize = 15;
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
        Some("up") => Flags {
            port: "--carla",
            stream_port: "--carla-stream",
            map: "--carla-map",
            adapter: Some("--adapter"),
            quality: Some("--quality"),
        },
        Some("gateway") => Flags {
            port: "--port",
            stream_port: "--stream-port",
            map: "--map",
            adapter: None,
            quality: None,
        },
        _ => return line,
    };
    let Ok(words) = line.iter().cloned().map(OsString::into_string).collect::<Result<Vec<_>, _>>()
    else {
        return line;
    };
    let translated = carla_gateway::translate(words, flags);
    if !translated.ignored.is_empty() {
        let ignored = translated.ignored.join(" ");
        Outlet::Error.tell(&format!("causeway: without effect here: {ignored}"));
    }
    translated.arguments.into_iter().map(OsString::from).collect()
}

/// Gives this process the name of the program that it stands for, if CARLA's launcher started it:
/// programs end their servers by that name, as `killall -r CarlaUE4-Linux` does.
pub(crate) fn take_name(line: impl Iterator<Item = OsString>) {
    let line: Vec<OsString> = line.take(LAUNCHER_WITHIN).collect();
    if let Some((_, program)) = launcher(&line)
        && let Err(error) = std::fs::write(NAME_FILE, &program[..NAME_BYTES])
    {
        Outlet::Error.tell(&format!("causeway: this process keeps its name: {error}"));
    }
}

/// Where the name of a launcher stands, and what it starts.
fn launcher(line: &[OsString]) -> Option<(usize, &'static str)> {
    line.iter().take(LAUNCHER_WITHIN).enumerate().find_map(|(place, word)| {
        let name = Path::new(word).file_name().and_then(OsStr::to_str)?;
        LAUNCHERS.iter().find(|(script, _)| *script == name).map(|(_, program)| (place, *program))
    })
}

/// `CarlaUE4.sh FLAGS` as a site with these flags, also behind a shell's name.
fn without_launcher(line: Vec<OsString>) -> Vec<OsString> {
    let Some((place, _)) = launcher(&line) else {
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
