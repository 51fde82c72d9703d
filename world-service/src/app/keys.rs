//! The keys the service answers. Runs on the bus's threads: routes or refuses, nothing else. Only
//! those who come by a shortcut lend their threads to the worlds they want ticked.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};

use bus::{Bus, BusError, Incoming, Serving};
use schemas::{Error, ErrorCode, Reply, Request, ServiceId, Tenant, WorldId, keys};

use super::maker::MakerJob;
use super::shard_worker::ShardWorker;
use crate::service::{Answer, Dispatcher, Simulation};

/// Of every shard.
type ShardWorkers<S> = Arc<[Arc<ShardWorker<S>>]>;

/// Serves all keys of a world service with this name and number.
pub(super) async fn serve<S: Simulation>(
    bus: &Bus,
    (id, number): (&ServiceId, u32),
    dispatcher: &Arc<Dispatcher<S>>,
    workers: ShardWorkers<S>,
    maker: &SyncSender<MakerJob>,
) -> Result<Vec<Serving>, BusError> {
    let worlds = || {
        let (dispatcher, maker) = (Arc::clone(dispatcher), maker.clone());
        move |incoming: Incoming| match keys::parse_worlds(incoming.key()) {
            Some(tenant) => route(&dispatcher, &maker, tenant, None, incoming),
            None => incoming.refuse(unknown_key()),
        }
    };
    let (for_world, maker_for_world) = (Arc::clone(dispatcher), maker.clone());
    let world = move |incoming: Incoming| match keys::parse_world(incoming.key()) {
        Some((tenant, world)) => route(&for_world, &maker_for_world, tenant, Some(world), incoming),
        None => incoming.refuse(unknown_key()),
    };
    let batch = |workers: Option<ShardWorkers<S>>| {
        let dispatcher = Arc::clone(dispatcher);
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
    let maker = maker.clone();
    let asset = move |incoming: Incoming| match keys::parse_asset(incoming.key()) {
        Some(digest) => send(&maker, MakerJob::Asset { digest: digest.to_owned(), incoming }),
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

fn route<S: Simulation>(
    dispatcher: &Dispatcher<S>,
    maker: &SyncSender<MakerJob>,
    tenant: Tenant,
    world: Option<WorldId>,
    incoming: Incoming,
) {
    let request = match incoming.request() {
        Ok(request) => request,
        Err(error) => return incoming.refuse(error),
    };
    if world.is_some_and(|world| !is_about(&request, world)) {
        return incoming.refuse(unfit("a request about the world of the key"));
    }
    let left = dispatcher.dispatch(tenant, request, answer(incoming));
    if let Some((tenant, request, answer)) = left {
        send(maker, MakerJob::Request { tenant, request, answer });
    }
}

/// The maker refuses what it has no room for: a dropped answer would only say "internal error".
fn send(maker: &SyncSender<MakerJob>, job: MakerJob) {
    if let Err(TrySendError::Full(job) | TrySendError::Disconnected(job)) = maker.try_send(job) {
        let busy =
            Error::new(ErrorCode::Capacity, "too many worlds are being made; nothing was done");
        match job {
            MakerJob::Request { answer, .. } => answer(Reply::Error(busy)),
            MakerJob::Asset { incoming, .. } => incoming.refuse(busy),
        }
    }
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
        | Request::InspectVehicle { world, .. }
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
