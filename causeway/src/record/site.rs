//! Journals of the worlds of a site that runs.

use std::time::Duration;

use bus::{Bus, BusAddress, BusConfig, IdentityArgs};
use schemas::{Error, ErrorCode, Reply, Request, Tenant, Tick, WorldId, WorldInfo, keys};

use super::RecordError;

/// A world service that has not answered by then is too busy or gone.
const DEADLINE: Duration = Duration::from_secs(10);

/// What is asked of a site.
#[derive(Clone, Debug, clap::Subcommand)]
pub(crate) enum Order {
    /// Name the worlds of all world services of a bus.
    Worlds(Site),
    /// Keep a journal of a world from now on, in the folder that its service was given.
    Start(Where),
    /// End the journal of a world.
    Stop(Where),
    /// Make a world that goes on from a tick of a journal; it lives until somebody destroys it.
    Branch(Branch),
}

/// Which world of which site.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Where {
    /// Its id, as `causeway record worlds` tells it
    #[arg(long)]
    world: u64,
    #[command(flatten)]
    site: Site,
}

/// From where a new world goes on.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Branch {
    /// The journal, in the folder of its tenant
    name: String,
    /// After which tick [default: the last one]
    #[arg(long)]
    tick: Option<u64>,
    #[command(flatten)]
    site: Site,
}

/// Which site.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Site {
    /// The bus of its site
    #[arg(long, value_name = "(tcp|tls)/HOST:PORT", default_value = "tcp/127.0.0.1:7460")]
    connect: BusAddress,
    #[command(flatten)]
    identity: IdentityArgs,
    /// Whose world it is
    #[arg(long, default_value = "local")]
    tenant: Tenant,
}

/// # Errors
/// No bus there, and what the world service refuses.
pub(super) fn carry_out(order: Order) -> Result<(), RecordError> {
    match order {
        Order::Worlds(site) => worlds(&site),
        Order::Start(place) => record(&place, true),
        Order::Stop(place) => record(&place, false),
        Order::Branch(order) => branch(order),
    }
}

fn worlds(site: &Site) -> Result<(), RecordError> {
    let replies = site.run(async |bus| {
        bus.request_every(&keys::worlds(&site.tenant), &Request::ListWorlds, DEADLINE).await
    })?;
    let worlds = replies.into_iter().filter_map(|reply| match reply {
        Reply::Worlds(worlds) => Some(worlds),
        _ => None,
    });
    let mut worlds: Vec<WorldInfo> = worlds.flatten().collect();
    worlds.sort_by_key(|world| world.world);
    if worlds.is_empty() {
        eprintln!("no worlds of {}: sessions and clients of CARLA make some", site.tenant);
    }
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
    let request = Request::RecordWorld { world, on, name: None };
    let asked = place.site.run(async |bus| bus.request(&key, &request, DEADLINE).await);
    let reply = asked.map_err(|error| match error {
        RecordError::Refused(error) if error.code == ErrorCode::Unreachable => unknown(place),
        error => error,
    })?;
    if let Reply::JournalBegun { name, tick, .. } = reply {
        println!("{}/{name} from {tick} on", place.site.tenant);
    }
    Ok(())
}

/// No service of the bus has the world.
fn unknown(place: &Where) -> RecordError {
    let error = Error::new(ErrorCode::UnknownWorld, "there is no such world")
        .wanted("an id that `causeway record worlds` names, with the same --connect and --tenant")
        .found(place.world);
    RecordError::Refused(error)
}

fn branch(Branch { name, tick, site }: Branch) -> Result<(), RecordError> {
    let request = Request::BranchJournal { name, tick: tick.map(Tick), lease: None };
    let key = keys::worlds(&site.tenant);
    match site.run(async |bus| bus.request(&key, &request, DEADLINE).await)? {
        Reply::WorldCreated { world, .. } => {
            println!("{}", world.get());
            Ok(())
        }
        _ => Err(RecordError::Refused(Error::new(
            ErrorCode::InvalidMessage,
            "the world service answered something else",
        ))),
    }
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
            let identity = self.identity.identity();
            let connect_deadline = Some(DEADLINE);
            let config = BusConfig::connecting(self.connect.clone());
            let bus = Bus::open(BusConfig { identity, connect_deadline, ..config }).await?;
            let answer = ask(&bus).await;
            bus.close().await;
            answer.map_err(RecordError::Refused)
        })
    }
}
