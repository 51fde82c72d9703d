//! The keys the service answers. Runs on the bus's threads: routes or refuses, nothing else. Only
//! those who come by a shortcut lend their threads to the worlds they want ticked.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use bus::{Bus, BusError, Incoming, Serving};
use monitoring::Monitor;
use schemas::{Error, ErrorCode, Reply, Request, ServiceId, Tenant, WorldId, keys};

use super::figures::{Outcome, RequestFigures};
use super::maker::MakerJob;
use super::shard_worker::ShardWorker;
use crate::service::{Answer, Dispatcher, Simulation};

/// Of every shard.
type ShardWorkers<S> = Arc<[Arc<ShardWorker<S>>]>;

/// Who takes requests in.
pub(super) struct RequestRouter<S: Simulation> {
    pub(super) dispatcher: Arc<Dispatcher<S>>,
    pub(super) maker: SyncSender<MakerJob>,
    pub(super) monitor: Monitor,
    pub(super) figures: RequestFigures,
}

/// Serves all keys of a world service with this name and number.
pub(super) async fn serve<S: Simulation>(
    bus: &Bus,
    (id, number): (&ServiceId, u32),
    router: RequestRouter<S>,
    workers: ShardWorkers<S>,
) -> Result<Vec<Serving>, BusError> {
    let router = Arc::new(router);
    let worlds = || {
        let router = Arc::clone(&router);
        move |incoming: Incoming| match keys::parse_worlds(incoming.key()) {
            Some(tenant) => router.route(tenant, None, incoming),
            None => incoming.refuse(unknown_key()),
        }
    };
    let for_world = Arc::clone(&router);
    let world = move |incoming: Incoming| match keys::parse_world(incoming.key()) {
        Some((tenant, world)) => for_world.route(tenant, Some(world), incoming),
        None => incoming.refuse(unknown_key()),
    };
    let batch = |workers: Option<ShardWorkers<S>>| {
        let dispatcher = Arc::clone(&router.dispatcher);
        move |incoming: Incoming| match incoming.request() {
            Ok(Request::TickWorlds(items)) => {
                let here = |shard: usize, job| match &workers {
                    Some(workers) => workers[shard].work_here(job),
                    None => Some(job),
                };
                dispatcher.tick(None, items, answer(incoming), here);
            }
            Ok(_) => incoming.refuse(unfit("ticks of worlds")),
            Err(error) => incoming.refuse(error),
        }
    };
    let for_maps = Arc::clone(&router);
    let asset = move |incoming: Incoming| match keys::parse_asset(incoming.key()) {
        Some(digest) => match world::texture(digest) {
            Some(texture) => incoming.reply_bytes(texture.bytes().to_vec()),
            None => for_maps.send(MakerJob::Asset { digest: digest.to_owned(), incoming }),
        },
        None => incoming.refuse(unknown_key()),
    };
    Ok(vec![
        bus.serve(keys::ANY_WORLDS, worlds()).await?,
        bus.serve(&keys::any_worlds_of(id), worlds()).await?,
        bus.serve(&keys::any_world(number), world).await?,
        bus.serve(&keys::batch_tick(id), batch(None)).await?,
        bus.serve_shortcut(&keys::batch_tick(id), batch(Some(workers))).await?,
        bus.serve(keys::ANY_ASSET, asset).await?,
    ])
}

impl<S: Simulation> RequestRouter<S> {
    fn route(&self, tenant: Tenant, world: Option<WorldId>, incoming: Incoming) {
        let request = match incoming.request() {
            Ok(request) => request,
            Err(error) => return self.refuse(Outcome::Refused, incoming, error),
        };
        if world.is_some_and(|world| !is_about(&request, world)) {
            let error = unfit("a request about the world of the key");
            return self.refuse(Outcome::Refused, incoming, error);
        }
        if makes_a_world(&request) && self.monitor.is_draining() {
            return self.refuse(Outcome::Draining, incoming, draining());
        }
        let deed = Deed::of(&tenant, &request);
        let left = self.dispatcher.dispatch(tenant, request, self.answer(incoming, deed));
        if let Some((tenant, request, answer)) = left {
            self.send(MakerJob::Request { tenant, request, answer });
        }
    }

    fn refuse(&self, outcome: Outcome, incoming: Incoming, error: Error) {
        self.figures.note(outcome);
        incoming.refuse(error);
    }

    fn answer(&self, incoming: Incoming, deed: Option<Deed>) -> Answer {
        let figures = self.figures.clone();
        Box::new(move |reply| {
            if let Some(deed) = deed {
                deed.write_down(&reply);
            }
            figures.note(match &reply {
                Reply::Error(error) if error.code == ErrorCode::Capacity => Outcome::Capacity,
                Reply::Error(_) => Outcome::Refused,
                _ => Outcome::Done,
            });
            incoming.reply(&reply);
        })
    }

    /// The maker refuses what it has no room for: a dropped answer would only say "internal error".
    fn send(&self, job: MakerJob) {
        let sent = self.maker.try_send(job);
        if let Err(TrySendError::Full(job) | TrySendError::Disconnected(job)) = sent {
            let busy =
                Error::new(ErrorCode::Capacity, "too many worlds are being made; nothing was done");
            match job {
                MakerJob::Request { answer, .. } => answer(Reply::Error(busy)),
                MakerJob::Asset { incoming, .. } => incoming.refuse(busy),
            }
        }
    }
}

/// What a request does that is written down.
struct Deed {
    tenant: Tenant,
    action: &'static str,
    /// The world that is destroyed or forked.
    world: Option<WorldId>,
}

impl Deed {
    fn of(tenant: &Tenant, request: &Request) -> Option<Self> {
        let (action, world) = match request {
            Request::DestroyWorld { world } => ("destroy world", Some(*world)),
            Request::ForkWorld { world, .. } => ("fork world", Some(*world)),
            request if makes_a_world(request) => ("make world", None),
            _ => return None,
        };
        Some(Self { tenant: tenant.clone(), action, world })
    }

    fn write_down(self, reply: &Reply) {
        let Self { tenant, action, world } = self;
        let world = match reply {
            Reply::Error(_) => return,
            Reply::WorldCreated { world, .. } => Some(*world),
            _ => world,
        };
        let world = world.map(WorldId::get);
        tracing::debug!(target: "audit", %tenant, world, "{action}");
    }
}

/// Forks are not meant: who has a world here tries things out in them.
fn makes_a_world(request: &Request) -> bool {
    matches!(
        request,
        Request::CreateWorld { .. } | Request::RestoreWorld { .. } | Request::BranchJournal { .. }
    )
}

/// Also what a client reads whose service finds no other.
fn draining() -> Error {
    Error::new(ErrorCode::Capacity, "this world service is ending and makes no new worlds")
        .wanted("another world service, or the same a little later")
}

fn answer(incoming: Incoming) -> Answer {
    Box::new(move |reply| incoming.reply(&reply))
}

fn is_about(request: &Request, key_world: WorldId) -> bool {
    match request {
        Request::DestroyWorld { world }
        | Request::SnapshotWorld { world }
        | Request::ForkWorld { world, .. }
        | Request::RunCommands { world, .. }
        | Request::DescribeActors { world, .. }
        | Request::InspectVehicles { world, .. }
        | Request::CastRays { world, .. }
        | Request::ShareClock { world, .. }
        | Request::RecordWorld { world, .. } => *world == key_world,
        Request::TickWorlds(items) => items.iter().all(|item| item.world == key_world),
        _ => false,
    }
}

fn unknown_key() -> Error {
    Error::new(ErrorCode::InvalidArgument, "this key names nothing")
        .wanted("a key of one tenant, without wildcards")
}

fn unfit(wanted: &str) -> Error {
    Error::new(ErrorCode::InvalidArgument, "this request does not fit the key it came on")
        .wanted(wanted)
}
