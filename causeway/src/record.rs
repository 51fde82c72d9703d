//! `causeway record`: what happened in worlds, in logs of CARLA's format and in journals, begun,
//! listed, asked, replayed, cut, exported and imported.

mod exact;
mod export;
mod import;
mod journal;
mod listing;
mod log;
mod page;
mod piece;
mod played;
mod progress;
mod rebuilt;
mod site;
mod source;
mod translated;

use std::path::PathBuf;

use schemas::Error;
use world_service::journal::JournalError;

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    command: Command,
}

impl Args {
    /// Whether it draws pictures.
    pub(crate) fn draws(&self) -> bool {
        matches!(&self.command, Command::Export(order) if order.draws())
    }
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Command {
    /// List the logs and journals of a folder.
    List(listing::Folder),
    #[command(flatten)]
    Site(site::Order),
    /// Say what a log or a journal is about.
    Info(log::Info),
    #[command(flatten)]
    Ask(log::Question),
    /// Read a log or replay a journal, and name where it is damaged or differs; then exit with 1.
    Verify(source::Source),
    /// Replay a journal, or the one beside a log, to the bit: every frame is compared, and with a
    /// log the states that it names. Names the first tick that differs; then exit with 1.
    Replay(exact::Exact),
    /// Write a piece of a log or a journal as a new file.
    Cut(piece::Cut),
    /// Write a log or a journal as an MCAP file, which Foxglove and the `mcap` libraries open.
    Export(export::Export),
    /// Write a log or a journal as one HTML file that plays it in a browser, without a server.
    Page(page::ReplayPage),
    /// Make a journal again from the MCAP file that the whole of one was exported to. It is
    /// simulated again; what differs is named, then exit with 1.
    Import(import::Import),
}

/// Why nothing was recorded or replayed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordError {
    /// No such file.
    #[error("{path:?} cannot be opened: {cause}")]
    Open {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file of another kind.
    #[error("{path:?} is neither a log of CARLA's format nor a journal")]
    Foreign {
        /// Which.
        path: PathBuf,
    },
    /// A log without a journal.
    #[error("{path:?}: {why}")]
    Unfit {
        /// Which.
        path: PathBuf,
        /// What is wanted, and what was found.
        why: String,
    },
    /// The new file.
    #[error("{path:?} cannot be written: {cause}")]
    Write {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file of another program, or damaged.
    #[error("{path:?} cannot be imported: {cause}")]
    Mcap {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: mcap_export::ReadError,
    },
    /// A log.
    #[error(transparent)]
    Log(#[from] log::LogError),
    /// The replay.
    #[error("{path:?}: {cause}")]
    Journal {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: JournalError,
    },
    /// No threads.
    #[error("the operating system refuses threads: {0}")]
    Threads(std::io::Error),
    /// No bus there.
    #[error("{0}; `causeway up` starts a site and prints the address of its bus")]
    Bus(#[from] bus::BusError),
    /// What the world service says.
    #[error("the world service refuses: {0}")]
    Refused(Error),
}

pub(crate) fn run(args: Args) -> Result<(), RecordError> {
    match args.command {
        Command::List(folder) => listing::list(&folder),
        Command::Site(order) => site::carry_out(order),
        Command::Info(info) => log::info(&info),
        Command::Ask(question) => log::ask(&question),
        Command::Verify(source) => exact::verify(&source.file),
        Command::Replay(order) => exact::replay(&order),
        Command::Cut(order) => piece::cut(&order),
        Command::Export(order) => export::export(&order),
        Command::Page(order) => page::page(&order),
        Command::Import(order) => import::import(&order),
    }
}
