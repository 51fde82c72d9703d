//! The thread for what is rare or slow: maps, new worlds, restored worlds.

use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use bus::Incoming;
use monitoring::Condition;
use schemas::wire::encode_frame;
use schemas::{Error, ErrorCode, Lease, MapRef, Reply, Request, Tenant, Tick};

use super::ServiceError;
use super::journals::JournalFolder;
use super::shard_worker::Mailboxes;
use crate::journal::{JournalError, Reader, Step, Way};
use crate::maps::Maps;
use crate::service::{
    Answer, Dispatcher, Hosted, Ids, Job, NewWorld, Seat, Seats, Simulation, guarded,
};

/// Requests that may wait for it.
const MAKER_JOBS_MAX: usize = 1_024;
/// Built while nobody waits yet.
const WARM_MAP: &str = "Town10HD_Opt";

/// Work for the [`Maker`].
pub(super) enum MakerJob {
    /// A request that needs maps.
    Request {
        /// Who asks.
        tenant: Tenant,
        /// What.
        request: Request,
        /// Hears of it.
        answer: Answer,
    },
    /// A map's text.
    Asset {
        /// Of its bytes.
        digest: String,
        /// Hears of it.
        incoming: Incoming,
    },
}

/// Makes worlds, and answers about maps.
pub(super) struct Maker<S: Simulation> {
    pub(super) maps: Arc<Maps<S::Town>>,
    pub(super) ids: Arc<Ids>,
    pub(super) seats: Seats,
    pub(super) epoch: u64,
    pub(super) dispatcher: Arc<Dispatcher<S>>,
    pub(super) mailboxes: Arc<Mailboxes<S>>,
    pub(super) journals: Arc<JournalFolder>,
    /// Holds once the first map is built, or known not to be there.
    pub(super) first_map: Condition,
}

impl<S: Simulation> Maker<S> {
    /// Starts the thread, which ends when all senders are gone.
    pub(super) fn spawn(self) -> Result<(SyncSender<MakerJob>, JoinHandle<()>), ServiceError> {
        let (jobs, inbox) = sync_channel(MAKER_JOBS_MAX);
        let thread = std::thread::Builder::new()
            .name("maker".to_owned())
            .spawn(move || self.work(&inbox))
            .map_err(|cause| ServiceError::System { what: "threads", cause })?;
        Ok((jobs, thread))
    }

    fn work(&self, inbox: &Receiver<MakerJob>) {
        if let Err(error) = self.maps.common_town(WARM_MAP) {
            tracing::warn!(%error, "the first map cannot be used");
        }
        self.first_map.meet();
        while let Ok(job) = inbox.recv() {
            // A map that breaks the parser must not end the making of worlds; its asker hears of it
            // because the answer is dropped.
            if catch_unwind(AssertUnwindSafe(|| self.handle(job))).is_err() {
                tracing::error!("a request for a map or a new world panicked");
            }
        }
    }

    fn handle(&self, job: MakerJob) {
        match job {
            MakerJob::Asset { digest, incoming } => match self.maps.asset(&digest) {
                Ok(text) => incoming.reply_bytes(text),
                Err(error) => incoming.refuse(error),
            },
            MakerJob::Request { tenant, request, answer } => match request {
                Request::ListMaps => answer(Reply::Maps(self.maps.list(&tenant))),
                Request::PutMap { name, text } => {
                    let put = self.maps.put(&tenant, &name, text);
                    answer(put.map_or_else(Reply::Error, |()| Reply::Done));
                }
                Request::RestoreWorld { snapshot, lease } => {
                    let restored = self.restore(tenant, &snapshot, lease);
                    answer(restored.unwrap_or_else(Reply::Error));
                }
                Request::BranchJournal { name, tick, lease } => {
                    let branched = self.branch(tenant, &name, tick, lease);
                    answer(branched.unwrap_or_else(Reply::Error));
                }
                create => self.create(tenant, create, answer),
            },
        }
    }

    /// Finds the map and leaves the rest to the shard of the new world.
    fn create(&self, tenant: Tenant, request: Request, answer: Answer) {
        let Request::CreateWorld { map, seed, dt_secs, commands, lease, traffic, first_actor } =
            request
        else {
            return answer(Reply::Error(Error::new(ErrorCode::Internal, "a request went astray")));
        };
        let found = self.seat().and_then(|seat| Ok((seat, self.maps.town(&tenant, &map)?)));
        let (seat, town) = match found {
            Ok(found) => found,
            Err(error) => return answer(Reply::Error(error)),
        };
        let (id, epoch) = (self.ids.next(), self.epoch);
        let new = NewWorld { id, epoch, seed, dt_secs, town, traffic, first_actor };
        let shard = self.dispatcher.shard(new.id);
        // Waits while the shard is busy. A shard that has ended drops the job, which tells the
        // asker.
        let _ = shard.send(Job::Create { new, tenant, commands, lease, seat, answer });
    }

    fn restore(
        &self,
        tenant: Tenant,
        snapshot: &[u8],
        lease: Option<Lease>,
    ) -> Result<Reply, Error> {
        let seat = self.seat()?;
        let id = self.ids.next();
        let town_of = |map: &_| self.maps.town_of(map);
        let world = guarded(|| S::restore(snapshot, id, self.epoch, &town_of))?;
        let frame = guarded(|| Ok(encode_frame(&world.frame())))?;
        self.mailboxes.adopt(id, Hosted::new(tenant, lease, world, seat));
        Ok(Reply::WorldCreated { world: id, frame, replies: Vec::new() })
    }

    /// A world that goes on from a tick of a journal.
    fn branch(
        &self,
        tenant: Tenant,
        name: &str,
        tick: Option<Tick>,
        lease: Option<Lease>,
    ) -> Result<Reply, Error> {
        let seat = self.seat()?;
        let file = self.journals.open(&tenant, name)?;
        let mut reader = Reader::open(BufReader::new(file)).map_err(unusable)?;
        let way = reader.way_to(tick.unwrap_or(reader.index().last())).map_err(unusable)?;
        let head = reader.head();
        let map = MapRef {
            name: head.map_name.clone(),
            digest: blake3::hash(head.map_text.as_bytes()).to_hex().to_string(),
        };
        if self.maps.town_of(&map).is_none() {
            // Whoever has the journal has its map.
            self.maps.put(&tenant, &map.name, head.map_text.clone())?;
        }
        let id = self.ids.next();
        let town_of = |map: &_| self.maps.town_of(map);
        let world =
            guarded(|| done_again(S::restore(&way.snapshot, id, self.epoch, &town_of)?, &way))?;
        let frame = guarded(|| Ok(encode_frame(&world.frame())))?;
        self.mailboxes.adopt(id, Hosted::new(tenant, lease, world, seat));
        Ok(Reply::WorldCreated { world: id, frame, replies: Vec::new() })
    }

    fn seat(&self) -> Result<Seat, Error> {
        let seat = self.seats.take(1)?.pop();
        seat.ok_or_else(|| Error::new(ErrorCode::Internal, "no seat was given"))
    }
}

/// Takes a world that was restored all the way; it has to come out as it was recorded.
fn done_again<S: Simulation>(mut world: S, way: &Way) -> Result<S, Error> {
    for step in &way.steps {
        match step {
            Step::Commands(commands) => commands.iter().for_each(|command| {
                // What was carried out and is refused now shows in the state.
                let _ = world.apply(command);
            }),
            Step::Tick(tick) => world.tick(tick.wanted_secs)?,
        }
    }
    let found = world.frame().state_hash;
    if found == way.to.state_hash {
        return Ok(world);
    }
    Err(Error::new(ErrorCode::Internal, "the journal goes another way than it was recorded")
        .wanted(format_args!("state {:016x} at {}", way.to.state_hash, way.to.tick))
        .found(format_args!("state {found:016x}")))
}

fn unusable(error: JournalError) -> Error {
    match error {
        JournalError::Part(error) => error,
        other => Error::new(ErrorCode::InvalidArgument, "the journal cannot be used").found(other),
    }
}
