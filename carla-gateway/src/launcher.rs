//! Flags of CARLA's launcher, so that start scripts written for it work.

/// A command line with CARLA's flags in our words, and those that mean nothing here.
#[derive(Debug, PartialEq, Eq)]
pub struct Translated {
    /// What this program understands.
    pub arguments: Vec<String>,
    /// Understood by CARLA alone.
    pub ignored: Vec<String>,
}

/// What of CARLA's launcher has a meaning here, as a subcommand calls it.
#[derive(Clone, Copy, Debug)]
pub struct Flags {
    /// The ports of endpoints.
    pub port: &'static str,
    /// The ports of their streams.
    pub stream_port: &'static str,
    /// The map of an endpoint's first world.
    pub map: &'static str,
    /// What draws, where that is chosen.
    pub adapter: Option<&'static str>,
    /// How finely pictures are drawn, where that is this subcommand's to say.
    pub quality: Option<&'static str>,
}

/// CARLA's flags that scripts also write with two dashes, which it takes as well.
const WITH_TWO_DASHES: [&str; 13] = [
    "--carla-rpc-port",
    "--carla-port",
    "--carla-world-port",
    "--world-port",
    "--carla-streaming-port",
    "--carla-secondary-port",
    "--carla-server",
    "--quality-level",
    "--opengl",
    "--vulkan",
    "--nosound",
    "--nullrhi",
    "--renderoffscreen",
];

/// Puts CARLA's flags, which begin with a single dash, and its map, which stands alone, into the
/// words of a subcommand. Others stay.
pub fn translate(arguments: impl IntoIterator<Item = String>, flags: Flags) -> Translated {
    let mut translated = Translated { arguments: Vec::new(), ignored: Vec::new() };
    // Whether the word before is an option of ours, or a flag of CARLA's, that lacks its value.
    let (mut is_value, mut is_carlas_value) = (false, false);
    for argument in arguments {
        if std::mem::take(&mut is_carlas_value) && !argument.starts_with('-') {
            translated.ignored.push(argument);
            continue;
        }
        let (name, value) = argument.split_once('=').unwrap_or((&argument, ""));
        let name = name.to_ascii_lowercase();
        if !is_value && (argument.starts_with("/Game/") || argument.starts_with("Town")) {
            let map = argument.rsplit('/').next().unwrap_or_default();
            translated.arguments.extend([flags.map.to_owned(), map.to_owned()]);
            continue;
        }
        if !is_carlas(&name) {
            is_value = argument.starts_with("--") && !argument.contains('=');
            translated.arguments.push(argument);
            continue;
        }
        (is_value, is_carlas_value) = (false, argument.ends_with('='));
        match (name.trim_start_matches('-'), value) {
            ("carla-rpc-port" | "carla-port" | "carla-world-port" | "world-port", port)
                if !port.is_empty() =>
            {
                translated.arguments.extend([flags.port.to_owned(), port.to_owned()]);
            }
            ("carla-streaming-port", port) if !port.is_empty() => {
                translated.arguments.extend([flags.stream_port.to_owned(), port.to_owned()]);
            }
            ("quality-level", level) if flags.quality.is_some() && tier(level).is_some() => {
                let words = flags.quality.into_iter().chain(tier(level));
                translated.arguments.extend(words.map(str::to_owned));
            }
            ("fps", fps) if !fps.is_empty() => {
                translated.arguments.extend(["--fps".to_owned(), fps.to_owned()]);
            }
            // No GPU is to be touched; processors draw as well.
            ("nullrhi", _) if flags.adapter.is_some() => {
                let words = flags.adapter.into_iter().chain(["cpu"]);
                translated.arguments.extend(words.map(str::to_owned));
            }
            _ => translated.ignored.push(argument),
        }
    }
    translated
}

/// CARLA's levels of quality, as ours are called.
fn tier(level: &str) -> Option<&'static str> {
    match level.to_ascii_lowercase().as_str() {
        "low" => Some("low"),
        "epic" => Some("high"),
        _ => None,
    }
}

fn is_carlas(name: &str) -> bool {
    let has_one_dash =
        name.starts_with('-') && name.len() > 2 && name.as_bytes()[1].is_ascii_alphabetic();
    has_one_dash || WITH_TWO_DASHES.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAGS: Flags = Flags {
        port: "--carla",
        stream_port: "--carla-stream",
        map: "--carla-map",
        adapter: Some("--adapter"),
        quality: Some("--quality"),
    };

    fn words(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn a_start_script_of_carla_is_understood() {
        let line = "-RenderOffScreen -quality-level=Low -carla-rpc-port=2010 \
                    -carla-streaming-port=2500 -fps=20 --bus x -h";
        let translated = translate(words(line), FLAGS);
        let ours = "--quality low --carla 2010 --carla-stream 2500 --fps 20 --bus x -h";
        assert_eq!(translated.arguments, words(ours));
        assert_eq!(translated.ignored, words("-RenderOffScreen"));
        let translated = translate(words("-quality-level=Epic -quality-level=Medium"), FLAGS);
        assert_eq!(translated.arguments, words("--quality high"));
        assert_eq!(translated.ignored, words("-quality-level=Medium"));
        for name in ["-carla-port", "-world-port", "-carla-world-port", "--carla-world-port"] {
            let translated = translate(words(&format!("{name}=2010")), FLAGS);
            assert_eq!(translated.arguments, words("--carla 2010"), "{name}");
        }
        let gateway = Flags { quality: None, ..FLAGS };
        let translated = translate(words("-quality-level=Low"), gateway);
        assert_eq!(translated.ignored, words("-quality-level=Low"));
    }

    #[test]
    fn without_a_gpu_processors_draw() {
        for flag in ["-nullrhi", "--nullrhi", "-NullRHI"] {
            assert_eq!(translate(words(flag), FLAGS).arguments, words("--adapter cpu"), "{flag}");
        }
        let of_a_gateway = Flags { adapter: None, ..FLAGS };
        assert_eq!(translate(words("-nullrhi"), of_a_gateway).ignored, words("-nullrhi"));
    }

    #[test]
    fn a_map_may_stand_alone_and_flags_may_have_two_dashes() {
        let line = "causeway up /Game/Carla/Maps/Town02 --world-port=2010 --opengl --maps /Game/x";
        let translated = translate(words(line), FLAGS);
        let ours = "causeway up --carla-map Town02 --carla 2010 --maps /Game/x";
        assert_eq!(translated.arguments, words(ours));
        assert_eq!(translated.ignored, words("--opengl"));
        let translated =
            translate(words("up --render=1 Town03_Opt -windowed -ResX= 80 -ResY="), FLAGS);
        assert_eq!(translated.arguments, words("up --render=1 --carla-map Town03_Opt"));
        assert_eq!(translated.ignored, words("-windowed -ResX= 80 -ResY="));
    }
}
