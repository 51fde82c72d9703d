//! What was typed, and what the service runs with.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use bus::{BusAddress, Identity, IdentityArgs};
use schemas::{ServiceId, ServiceKind, limits};

/// Owns worlds and steps them.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Where clients and services may connect, e.g. tcp/127.0.0.1:7460; port 0 is any free one
    #[arg(long, value_name = "(tcp|tls)/HOST:PORT")]
    pub listen: Vec<BusAddress>,
    /// A bus to join, e.g. that of a router
    #[arg(long, value_name = "(tcp|tls)/HOST:PORT")]
    pub connect: Vec<BusAddress>,
    /// Certificates.
    #[command(flatten)]
    pub identity: IdentityArgs,
    /// Name on the bus; two of one kind need different ones [default: a random one]
    #[arg(long, default_value_t = bus::unused_id(ServiceKind::World), hide_default_value = true)]
    pub id: ServiceId,
    /// Threads that step worlds [default: one per core]
    #[arg(long, value_name = "N", value_parser = thread_count)]
    pub threads: Option<NonZeroUsize>,
    /// Folder of OpenDRIVE files (.xodr); one with the name of a built-in map replaces it
    #[arg(long, value_name = "DIR", env = "CAUSEWAY_MAPS")]
    pub maps: Option<PathBuf>,
    /// Folder for the journals of worlds that are asked to keep one, a folder in it for each
    /// tenant; made when it is needed
    #[arg(long, value_name = "DIR")]
    pub journals: Option<PathBuf>,
    /// Size of a journal, in MiB; a longer one ends there
    #[arg(long, value_name = "MIB", default_value_t = 4_096,
        value_parser = clap::value_parser!(u32).range(1..))]
    pub journal_mib: u32,
    /// Worlds at once
    #[arg(long, value_name = "N", default_value_t = limits::WORLDS_PER_SERVICE_MAX)]
    pub worlds_max: usize,
}

/// Where journals are kept.
#[derive(Clone, Debug)]
pub struct Journals {
    /// A folder that is there or can be made.
    pub folder: PathBuf,
    /// Of one journal.
    pub bytes_max: u64,
}

/// What the service runs with; consistent.
#[derive(Clone, Debug)]
pub struct Config {
    /// Where others connect.
    pub listen: Vec<BusAddress>,
    /// What it joins.
    pub connect: Vec<BusAddress>,
    /// By what it is known on a bus with TLS.
    pub identity: Option<Identity>,
    /// Name on the bus.
    pub id: ServiceId,
    /// Threads that step worlds.
    pub shard_count: NonZeroUsize,
    /// Folder of OpenDRIVE files.
    pub maps: Option<PathBuf>,
    /// Journals of worlds, if any are kept.
    pub journals: Option<Journals>,
    /// Worlds at once.
    pub worlds_max: usize,
}

/// The first setting that cannot work.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConfigError {
    /// Nothing to do, or more than the limit.
    #[error("--worlds-max must be 1 to {max}, not {found}")]
    WorldsMax {
        /// The limit.
        max: usize,
        /// As typed.
        found: usize,
    },
    /// No folder there.
    #[error("--maps {path:?} is not a folder that can be read")]
    Maps {
        /// As typed.
        path: PathBuf,
    },
    /// No folder there, and none can be made.
    #[error("--journals {path:?} is no folder and cannot be made one: {at:?} is something else")]
    Journals {
        /// As typed.
        path: PathBuf,
        /// What is in the way.
        at: PathBuf,
    },
}

/// Shard threads of one service.
const THREADS_MAX: usize = 256;

/// How many threads step worlds, as typed.
///
/// # Errors
/// None, or more than worlds can keep busy.
pub fn thread_count(text: &str) -> Result<NonZeroUsize, String> {
    let count = text.parse().ok().filter(|count: &NonZeroUsize| count.get() <= THREADS_MAX);
    count.ok_or_else(|| format!("wanted 1 to {THREADS_MAX}"))
}

impl Config {
    /// Checks what was typed and fills in defaults; without any address it listens on the
    /// loopback.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that cannot work.
    pub fn resolve(args: Args) -> Result<Self, ConfigError> {
        let worlds_max = args.worlds_max;
        if !(1..=limits::WORLDS_PER_SERVICE_MAX).contains(&worlds_max) {
            return Err(ConfigError::WorldsMax {
                max: limits::WORLDS_PER_SERVICE_MAX,
                found: worlds_max,
            });
        }
        let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let shard_count = args.threads.unwrap_or(cores);
        if let Some(path) = args.maps.as_ref().filter(|path| !path.is_dir()) {
            return Err(ConfigError::Maps { path: path.clone() });
        }
        if let Some(path) = &args.journals {
            let at = path.ancestors().find(|at| at.exists());
            if let Some(at) = at.filter(|at| !at.is_dir()) {
                let (path, at) = (path.clone(), at.to_owned());
                return Err(ConfigError::Journals { path, at });
            }
        }
        let bytes_max = u64::from(args.journal_mib) << 20;
        let journals = args.journals.map(|folder| Journals { folder, bytes_max });
        let mut listen = args.listen;
        if listen.is_empty() && args.connect.is_empty() {
            listen.push(BusAddress::loopback(7460));
        }
        Ok(Self {
            listen,
            connect: args.connect,
            identity: args.identity.identity(),
            id: args.id,
            shard_count,
            maps: args.maps,
            journals,
            worlds_max,
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn resolve(line: &[&str]) -> Result<Config, ConfigError> {
        Config::resolve(Line::try_parse_from([&["world"], line].concat()).unwrap().args)
    }

    #[test]
    fn without_addresses_it_listens_on_the_loopback() {
        assert_eq!(resolve(&[]).unwrap().listen, [BusAddress::loopback(7460)]);
        assert_eq!(resolve(&["--connect", "tcp/router:1"]).unwrap().listen, []);
    }

    #[test]
    fn what_cannot_work_is_refused_by_name() {
        let refusal = |line: &[&str]| resolve(line).unwrap_err().to_string();
        assert!(refusal(&["--worlds-max", "0"]).contains("--worlds-max"));
        assert!(refusal(&["--maps", "/nowhere/at/all"]).contains("--maps"));
        assert!(refusal(&["--journals", "/dev/null/below"]).contains("--journals"));
    }

    #[test]
    fn threads_are_one_or_more_and_not_thousands() {
        assert_eq!(thread_count("256").unwrap().get(), 256);
        for wrong in ["0", "-3", "257", "many"] {
            assert_eq!(thread_count(wrong).unwrap_err(), "wanted 1 to 256");
        }
    }

    #[test]
    fn a_folder_for_journals_may_be_missing_until_there_is_one() {
        let folder = std::env::temp_dir().join(format!("causeway-args-{}", std::process::id()));
        let journals = folder.join("journals");
        let found = resolve(&["--journals", journals.to_str().unwrap()]).unwrap().journals;
        assert_eq!(found.unwrap().folder, journals);
        assert!(!folder.exists());
        assert_eq!(
            resolve(&["--journals", "journals"]).unwrap().journals.unwrap().bytes_max,
            4 << 30
        );
    }
}
