//! What can be typed, and which crate answers it.

use std::path::Path;

use clap::{Parser, Subcommand};

use crate::failure::Failure;
use crate::watched::Watched;
use crate::{
    bench, health, lifeline, logging, map, no_display, open_files, python, record, router, token,
    up,
};

const EXIT_CODES: &str = "\
Exit codes: 0 stopped as asked, 1 failed, 2 cannot work as typed.
RUST_LOG chooses what is logged, e.g. RUST_LOG=debug or RUST_LOG=info,zenoh=debug.";

/// A driving-simulation service: physics worlds, renderers and scenario servers on one bus.
#[derive(Debug, Parser)]
#[command(name = "causeway", version, after_help = EXIT_CODES)]
pub(crate) struct Cli {
    /// End when standard input ends: the process that started this one is gone then.
    #[arg(long, hide = true)]
    exit_with_parent: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Start a whole site on this machine: one process per service, restarted when one dies.
    #[command(after_help = EXIT_CODES)]
    Up(Box<up::Args>),
    /// Run a world service alone.
    World(Watched<world_service::Args>),
    /// Run a renderer alone.
    Render(Watched<render_service::Args>),
    /// Run a scenario service with its HTTP and WebSocket face alone.
    Scenario(Box<Watched<scenario_service::Args>>),
    /// Run a CARLA gateway alone: clients of CARLA connect to it.
    Gateway(Box<Watched<carla_gateway::Args>>),
    /// Run batches of worlds for programs that train or evaluate drivers, without a bus.
    Rollout(rollout_service::Args),
    /// Run a router of the bus, for services on several machines.
    Router(router::Args),
    /// Ask running services how they are: exit code 0 when all say that they are well.
    #[command(after_help = EXIT_CODES)]
    Health(health::HealthArgs),
    /// Have running services of this machine take nothing new; what goes on goes on.
    #[command(after_help = EXIT_CODES)]
    Drain(health::DrainArgs),
    /// Make and check tokens of people who may use a server.
    #[command(subcommand)]
    Token(token::Command),
    /// Measure what a user waits for and relies on.
    #[command(subcommand)]
    Bench(bench::Command),
    /// What happened: list, ask, replay, cut and export logs of CARLA's format and journals.
    #[command(after_help = EXIT_CODES)]
    Record(record::Args),
    /// Say how well policies drive, by tasks and seeds: `python -m causeway.evaluate`.
    Evaluate(python::Args),
    /// Play the nine micro-benchmarks of a running site: `python -m causeway.evaluate.dilemmas`.
    EvaluateDilemmas(python::Args),
    /// Drive episodes and write them down: `python -m causeway.record_episodes`.
    RecordEpisodes(python::Args),
    /// List, check, draw, export, ask and build maps.
    #[command(after_help = EXIT_CODES)]
    Map(map::Args),
}

impl Cli {
    /// Runs the command until it is done or stopped by a signal.
    ///
    /// # Errors
    /// Why it ended otherwise.
    pub(crate) fn run(self) -> Result<(), Failure> {
        if self.command.draws() {
            no_display::begin_anew();
        }
        let begun = logging::init(self.command.name(), self.command.audit());
        let _audit_end = begun.map_err(|error| Failure::usage(&error))?;
        open_files::allow_all();
        if self.exit_with_parent {
            lifeline::end_with_stdin().map_err(|error| Failure::of(&error))?;
        }
        let name = self.command.name();
        match self.command {
            Command::Up(args) => up::run(*args),
            Command::World(args) => {
                let (args, monitor) = args.begin(name)?;
                world_service::run(args, &monitor).map_err(|error| Failure::of(&error))
            }
            Command::Render(args) => {
                let (args, monitor) = args.begin(name)?;
                render_service::run(args, &monitor).map_err(|error| Failure::of(&error))
            }
            Command::Scenario(args) => {
                let (args, monitor) = args.begin(name)?;
                scenario_service::run(&args, &monitor).map_err(|error| match &error {
                    scenario_service::RunError::Config(wrong) => Failure::usage(wrong),
                    scenario_service::RunError::Tokens(wrong) => Failure::usage(wrong),
                    _ => Failure::of(&error),
                })
            }
            Command::Gateway(args) => {
                let (args, monitor) = args.begin(name)?;
                carla_gateway::run(&args, &monitor).map_err(|error| match &error {
                    carla_gateway::RunError::Tokens(wrong) => Failure::usage(wrong),
                    _ => Failure::of(&error),
                })
            }
            Command::Health(args) => health::health(&args),
            Command::Drain(args) => health::drain(&args),
            Command::Rollout(args) => {
                rollout_service::run(args).map_err(|error| Failure::of(&error))
            }
            Command::Router(args) => router::run(args),
            Command::Token(command) => token::run(&command),
            Command::Bench(command) => bench::run(&command),
            Command::Record(args) => record::run(args).map_err(|error| Failure::of(&error)),
            Command::Evaluate(args) => python::run("causeway.evaluate", args),
            Command::EvaluateDilemmas(args) => python::run("causeway.evaluate.dilemmas", args),
            Command::RecordEpisodes(args) => python::run("causeway.record_episodes", args),
            Command::Map(args) => map::run(args).map_err(|error| Failure::of(&error)),
        }
    }
}

impl Command {
    /// Where who did what is written down.
    fn audit(&self) -> Option<&Path> {
        match self {
            Self::World(args) => args.audit(),
            Self::Render(args) => args.audit(),
            Self::Scenario(args) => args.audit(),
            Self::Gateway(args) => args.audit(),
            _ => None,
        }
    }

    /// Whether it may open a device itself.
    fn draws(&self) -> bool {
        match self {
            Self::Render(_) | Self::Bench(bench::Command::Pictures(_)) => true,
            Self::Record(args) => args.draws(),
            Self::Up(args) => args.adapter().is_some(),
            _ => false,
        }
    }

    /// The word on the command line; it marks the process's lines in the log.
    fn name(&self) -> &'static str {
        match self {
            Self::Up(_) => "up",
            Self::World(_) => "world",
            Self::Render(_) => "render",
            Self::Scenario(_) => "scenario",
            Self::Gateway(_) => "gateway",
            Self::Rollout(_) => "rollout",
            Self::Router(_) => "router",
            Self::Health(_) => "health",
            Self::Drain(_) => "drain",
            Self::Token(_) => "token",
            Self::Bench(_) => "bench",
            Self::Record(_) => "record",
            Self::Evaluate(_) => "evaluate",
            Self::EvaluateDilemmas(_) => "evaluate-dilemmas",
            Self::RecordEpisodes(_) => "record-episodes",
            Self::Map(_) => "map",
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn a_negative_number_is_refused_by_what_was_wanted() {
        let command = crate::environment::with_values(Cli::command());
        let refusal = |line: &str| {
            let words = line.split_whitespace();
            command.clone().try_get_matches_from(words).unwrap_err().to_string()
        };
        let said = refusal("causeway up --fps -1");
        assert!(said.contains("wanted a number above 0 and at most 1000"), "{said}");
        let said = refusal("causeway bench pictures --secs -2");
        assert!(said.contains("invalid value '-2' for '--secs <N>'"), "{said}");
    }

    #[test]
    fn no_two_flags_of_a_command_clash() {
        Cli::command().debug_assert();
    }
}
