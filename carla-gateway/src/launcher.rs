//! Flags of CARLA's launcher, so that start scripts written for it work.

/// A command line with CARLA's flags in our words, and those that mean nothing here.
#[derive(Debug, PartialEq, Eq)]
pub struct Translated {
    /// What this program understands.
    pub arguments: Vec<String>,
    /// Understood by CARLA alone.
    pub ignored: Vec<String>,
}

/// Puts CARLA's flags, which begin with a single dash, into the words of a subcommand. Others stay.
///
/// `port_flag` is the subcommand's name for the ports of endpoints.
pub fn translate(arguments: impl IntoIterator<Item = String>, port_flag: &str) -> Translated {
    let mut translated = Translated { arguments: Vec::new(), ignored: Vec::new() };
    for argument in arguments {
        let is_carlas = argument.starts_with('-')
            && !argument.starts_with("--")
            && argument.len() > 2
            && argument.as_bytes()[1].is_ascii_alphabetic();
        if !is_carlas {
            translated.arguments.push(argument);
            continue;
        }
        let (name, value) = argument.split_once('=').unwrap_or((&argument, ""));
        match (name.to_ascii_lowercase().as_str(), value) {
            ("-carla-rpc-port" | "-carla-port" | "-world-port", port) if !port.is_empty() => {
                translated.arguments.extend([port_flag.to_owned(), port.to_owned()]);
            }
            ("-fps", fps) if !fps.is_empty() => {
                translated.arguments.extend(["--fps".to_owned(), fps.to_owned()]);
            }
            _ => translated.ignored.push(argument),
        }
    }
    translated
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn a_start_script_of_carla_is_understood() {
        let line = "-RenderOffScreen -quality-level=Low -carla-rpc-port=2010 -fps=20 --bus x -h";
        let translated = translate(words(line), "--carla");
        assert_eq!(translated.arguments, words("--carla 2010 --fps 20 --bus x -h"));
        assert_eq!(translated.ignored, words("-RenderOffScreen -quality-level=Low"));
    }
}
