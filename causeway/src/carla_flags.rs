//! Command lines of CARLA's launcher on the commands that take its place.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use carla_gateway::{Flags, Translated};
use clap::{Arg, Command};

use crate::outlet::Outlet;

/// What CARLA's launchers are called, and the program that each starts, which may also be started
/// itself.
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
/// named and left out. Behind a launcher these are all words that `command` does not know either,
/// as CARLA passes over what it does not know.
pub(crate) fn translated(line: impl Iterator<Item = OsString>, command: &Command) -> Vec<OsString> {
    let line: Vec<OsString> = line.collect();
    let is_launched = launcher(&line).is_some();
    let line = without_launcher(line);
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
    let mut translated = carla_gateway::translate(words, flags);
    if is_launched && let Some(site) = command.find_subcommand("up") {
        translated = without_unknown(translated, site);
    }
    if !translated.ignored.is_empty() {
        let ignored = translated.ignored.join(" ");
        Outlet::Error.tell(&format!("causeway: without effect here: {ignored}"));
    }
    translated.arguments.into_iter().map(OsString::from).collect()
}

/// Program and subcommand, then only what the subcommand knows.
fn without_unknown(translated: Translated, site: &Command) -> Translated {
    let Translated { arguments, mut ignored } = translated;
    let mut words = arguments.into_iter();
    let mut known: Vec<String> = words.by_ref().take(2).collect();
    while let Some(word) = words.next() {
        if matches!(word.as_str(), "-h" | "--help") {
            known.push(word);
            continue;
        }
        let Some(argument) = argument_of(site, &word) else {
            ignored.push(word);
            continue;
        };
        let lacks_value = argument.get_action().takes_values() && !word.contains('=');
        known.push(word);
        known.extend(words.by_ref().take(usize::from(lacks_value)));
    }
    Translated { arguments: known, ignored }
}

/// What a word with two dashes means to a command.
fn argument_of<'command>(command: &'command Command, word: &str) -> Option<&'command Arg> {
    let name = word.strip_prefix("--")?.split('=').next();
    command.get_arguments().find(|argument| argument.get_long() == name)
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
        let mut launchers = LAUNCHERS.iter();
        let (_, program) =
            launchers.find(|(script, program)| *script == name || *program == name)?;
        Some((place, *program))
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
    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Cli;

    fn site_of(line: &str) -> String {
        let words = translated(line.split(' ').map(OsString::from), &Cli::command());
        words.join(OsStr::new(" ")).into_string().unwrap()
    }

    #[test]
    fn a_launcher_of_carla_is_a_site_on_ports_of_its_own() {
        let site = "causeway up --bus tcp/127.0.0.1:0 --http 127.0.0.1:0 --carla 3000";
        for line in [
            "/opt/carla/CarlaUE4.sh -carla-rpc-port=3000",
            "causeway CarlaUnreal.sh -carla-rpc-port=3000",
            "/usr/bin/causeway /bin/bash ./CarlaUE4.sh -carla-rpc-port=3000",
            "causeway CarlaUE4-Linux-Shipping CarlaUE4 -carla-rpc-port=3000",
        ] {
            assert_eq!(site_of(line), site);
        }
    }

    #[test]
    fn a_launcher_passes_over_what_nobody_knows() {
        let site = "causeway up --bus tcp/127.0.0.1:0 --http 127.0.0.1:0";
        for (words, ours) in [
            ("--ros2 --resx=800 --gpu 0 -carla-rpc-port 3000", ""),
            (
                "--ros2 --maps towns --render=2 windowed --no-render",
                " --maps towns --render=2 --no-render",
            ),
            ("--carla-rpc-port=3000 --host=localhost --help", " --carla 3000 --help"),
        ] {
            assert_eq!(site_of(&format!("CarlaUE4.sh {words}")), format!("{site}{ours}"));
        }
    }

    #[test]
    fn without_a_launcher_unknown_words_stay_to_be_refused() {
        let line = "causeway up --ros2 --maps towns windowed";
        assert_eq!(site_of(line), line);
    }

    #[test]
    fn other_lines_stay() {
        let line = "causeway map show Town02 CarlaUE4.sh";
        assert_eq!(site_of(line), line);
    }
}
