//! `causeway record`: journals of worlds, begun, ended and replayed.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::time::Duration;

use bus::{Bus, BusConfig, Endpoint};
use schemas::{Error, ErrorCode, Reply, Request, Tenant, WorldId, WorldInfo, keys};
use world_service::journal::{JournalError, verify};

/// A world service that has not answered by then is too busy or gone.
const DEADLINE: Duration = Duration::from_secs(10);

#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Command {
    /// Name the worlds of all world services of a bus.
    List(Site),
    /// Keep a journal of a world from now on, in the folder that its service was given.
    Start(Where),
    /// End the journal of a world.
    Stop(Where),
    /// Replay a journal and name the first tick, actor and field that differ; then exit with 1.
    Verify {
        /// Its file.
        file: PathBuf,
    },
}

/// Which world of which site.
#[derive(Clone, Debug, clap::Args)]
struct Where {
    /// Its id, as `causeway record list` tells it
    #[arg(long)]
    world: u64,
    #[command(flatten)]
    site: Site,
}

/// Which site.
#[derive(Clone, Debug, clap::Args)]
struct Site {
    /// The bus of its site
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    connect: Endpoint,
    /// Whose world it is
    #[arg(long, default_value = "local")]
    tenant: Tenant,
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
    /// The replay.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// No threads.
    #[error("the operating system refuses threads: {0}")]
    Threads(std::io::Error),
    /// No bus there.
    #[error(transparent)]
    Bus(#[from] bus::BusError),
    /// What the world service says.
    #[error("the world service refuses: {0}")]
    Refused(Error),
}

pub(crate) fn run(args: Args) -> Result<(), RecordError> {
    match args.command {
        Command::List(site) => list(&site),
        Command::Start(place) => record(&place, true),
        Command::Stop(place) => record(&place, false),
        Command::Verify { file } => {
            let opened = File::open(&file)
                .map_err(|cause| RecordError::Open { path: file.clone(), cause })?;
            let told = verify(BufReader::new(opened))?;
            let end = if told.ended { "" } else { "; it ends with its process" };
            println!(
                "{}: {} to {} on {}, {} commands: the same to the bit{end}",
                file.display(),
                told.first,
                told.last,
                told.map,
                told.commands
            );
            Ok(())
        }
    }
}

fn list(site: &Site) -> Result<(), RecordError> {
    let replies = site.run(async |bus| {
        bus.request_every(&keys::worlds(&site.tenant), &Request::ListWorlds, DEADLINE).await
    })?;
    let worlds = replies.into_iter().filter_map(|reply| match reply {
        Reply::Worlds(worlds) => Some(worlds),
        _ => None,
    });
    let mut worlds: Vec<WorldInfo> = worlds.flatten().collect();
    worlds.sort_by_key(|world| world.world);
    for world in worlds {
        let owner = world.owner.map_or_else(|| "nobody".to_owned(), |owner| owner.to_string());
        let (id, map, tick) = (world.world.get(), world.map, world.tick);
        println!("{id}  {map}  {tick}  {} actors, kept by {owner}", world.actor_count);
    }
    Ok(())
}

fn record(place: &Where, on: bool) -> Result<(), RecordError> {
    let world = WorldId::new(place.world).ok_or_else(|| {
        RecordError::Refused(Error::new(ErrorCode::UnknownWorld, "no world has the id 0"))
    })?;
    let key = keys::world(&place.site.tenant, world);
    let request = Request::RecordWorld { world, on };
    place.site.run(async |bus| bus.request(&key, &request, DEADLINE).await).map(drop)
}

impl Site {
    /// Asks something on the bus of the site.
    fn run<T>(&self, ask: impl AsyncFn(&Bus) -> Result<T, Error>) -> Result<T, RecordError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(RecordError::Threads)?;
        runtime.block_on(async {
            let bus = Bus::open(BusConfig::connecting(self.connect.clone())).await?;
            let answer = ask(&bus).await;
            bus.close().await;
            answer.map_err(RecordError::Refused)
        })
    }
}
