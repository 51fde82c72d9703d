//! The thread for what is rare or slow: maps, new worlds, restored worlds.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use bus::Incoming;
use schemas::wire::encode_frame;
use schemas::{Error, ErrorCode, Lease, Reply, Request, Tenant};

use super::ServiceError;
use super::shard_thread::Mailboxes;
use crate::maps::Maps;
use crate::service::{
    Answer, Dispatcher, Hosted, Ids, Job, NewWorld, Seat, Seats, Simulation, guarded,
};

/// Requests that may wait for the office.
const OFFICE_JOBS_MAX: usize = 1_024;
/// Built while nobody waits yet.
const WARM_MAP: &str = "Town10HD_Opt";

/// Work for the office.
pub(super) enum OfficeJob {
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

/// What the office needs.
pub(super) struct Office<S: Simulation> {
    pub(super) maps: Arc<Maps<S::Town>>,
    pub(super) ids: Arc<Ids>,
    pub(super) seats: Seats,
    pub(super) epoch: u64,
    pub(super) dispatcher: Arc<Dispatcher<S>>,
    pub(super) mailboxes: Arc<Mailboxes<S>>,
}

impl<S: Simulation> Office<S> {
    /// Starts the thread, which ends when all senders are gone.
    pub(super) fn spawn(self) -> Result<(SyncSender<OfficeJob>, JoinHandle<()>), ServiceError> {
        let (desk, inbox) = sync_channel(OFFICE_JOBS_MAX);
        let thread = std::thread::Builder::new()
            .name("office".to_owned())
            .spawn(move || self.work(&inbox))
            .map_err(|cause| ServiceError::System { what: "threads", cause })?;
        Ok((desk, thread))
    }

    fn work(&self, inbox: &Receiver<OfficeJob>) {
        if let Err(error) = self.maps.common_town(WARM_MAP) {
            tracing::warn!(%error, "the first map cannot be used");
        }
        while let Ok(job) = inbox.recv() {
            // A map that breaks the parser must not end the making of worlds; its asker hears of it
            // because the answer is dropped.
            if catch_unwind(AssertUnwindSafe(|| self.handle(job))).is_err() {
                tracing::error!("a request for a map or a new world panicked");
            }
        }
    }

    fn handle(&self, job: OfficeJob) {
        match job {
            OfficeJob::Asset { digest, incoming } => match self.maps.asset(&digest) {
                Ok(text) => incoming.reply_bytes(text),
                Err(error) => incoming.refuse(error),
            },
            OfficeJob::Request { tenant, request, answer } => match request {
                Request::ListMaps => answer(Reply::Maps(self.maps.list(&tenant))),
                Request::PutMap { name, text } => {
                    let put = self.maps.put(&tenant, &name, text);
                    answer(put.map_or_else(Reply::Error, |()| Reply::Done));
                }
                Request::RestoreWorld { snapshot, lease } => {
                    let restored = self.restore(tenant, &snapshot, lease);
                    answer(restored.unwrap_or_else(Reply::Error));
                }
                create => self.create(tenant, create, answer),
            },
        }
    }

    /// Finds the map and leaves the rest to the shard of the new world.
    fn create(&self, tenant: Tenant, request: Request, answer: Answer) {
        let Request::CreateWorld { map, seed, dt_secs, commands, lease, traffic } = request else {
            return answer(Reply::Error(Error::new(ErrorCode::Internal, "a request went astray")));
        };
        let found = self.seat().and_then(|seat| Ok((seat, self.maps.town(&tenant, &map)?)));
        let (seat, town) = match found {
            Ok(found) => found,
            Err(error) => return answer(Reply::Error(error)),
        };
        let new = NewWorld { id: self.ids.next(), epoch: self.epoch, seed, dt_secs, town, traffic };
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

    fn seat(&self) -> Result<Seat, Error> {
        let seat = self.seats.take(1)?.pop();
        seat.ok_or_else(|| Error::new(ErrorCode::Internal, "no seat was given"))
    }
}
