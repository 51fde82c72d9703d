//! All sessions of the process: bounded, each with a life that ends.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use futures_util::stream::{self, StreamExt as _};
use monitoring::Drain;
use schemas::{Error, ErrorCode, Tenant};
use tenancy::{Seldom, TokenId, Visitor};
use tokio::sync::watch;

mod in_use;
mod pace;

use super::{Contexts, Session};
use crate::scenario::ScenarioError;
pub(crate) use in_use::InUse;

/// Worlds that move at once.
const MOVING_MAX: usize = 16;

/// How long sessions may be idle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IdleTimes {
    /// With a connection.
    pub(crate) connected: Duration,
    /// Without one, which only an id holds.
    pub(crate) detached: Duration,
}

/// What ends a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Life {
    /// The end of the request or connection that opened it.
    Connection,
    /// Being closed by its id, or idleness.
    Detached,
}

/// Why a session cannot be had.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OpenError {
    /// All places are taken.
    #[error("Server at capacity: {active}/{max} sessions active. Cannot accept new connections.")]
    Capacity {
        /// Sessions now.
        active: u32,
        /// Sessions at most.
        max: u32,
    },
    /// The tenant has as many as it may.
    #[error(
        "Tenant {tenant} has {active} of {max} sessions (quota sessions_max). Close one first."
    )]
    Quota {
        /// Whose.
        tenant: Tenant,
        /// Its sessions now.
        active: u32,
        /// Its sessions at most.
        max: u32,
    },
    /// The service is about to end.
    #[error("This server is ending and takes no new sessions. Connect again: another one answers.")]
    Draining,
    /// The default scenario does not exist.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// Why a session cannot be attached to a connection.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum AttachError {
    /// No such session.
    #[error("Unknown session_id: {0}")]
    Unknown(String),
    /// Another connection has it.
    #[error("Session {0} already has an attached WebSocket")]
    Attached(String),
}

/// What became of a wish to close a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Closed {
    /// It is gone.
    Now,
    /// It goes when its connection does.
    WithItsConnection,
    /// There was none.
    Unknown,
}

/// One session and what the table knows of it.
pub(crate) struct Slot {
    /// Its id.
    pub(crate) id: String,
    /// Used by one request at a time.
    pub(crate) session: tokio::sync::Mutex<Session>,
    tenant: Tenant,
    /// What was presented, where somebody asks for one.
    token: Option<TokenId>,
    life: Life,
    /// Whether there was room for it.
    is_open: AtomicBool,
    attached: AtomicBool,
    closing: AtomicBool,
    used: Mutex<Instant>,
}

/// All sessions of the process.
pub(crate) struct Sessions {
    contexts: Contexts,
    max: u32,
    /// How long sessions may be idle.
    pub(crate) idle: IdleTimes,
    slots: Mutex<BTreeMap<String, Arc<Slot>>>,
    /// Of sessions beyond the quota of a tenant, as they are written down.
    refusals: Seldom<Tenant>,
}

/// The sessions of one tenant.
#[derive(Clone)]
pub(crate) struct TenantSessions {
    all: Arc<Sessions>,
    visitor: Visitor,
}

impl Sessions {
    /// An empty table.
    pub(crate) fn new(contexts: Contexts, max: u32, idle: IdleTimes) -> Self {
        Self { contexts, max, idle, slots: Mutex::default(), refusals: Seldom::default() }
    }

    /// Those of a visitor's tenant, which no other sees.
    pub(crate) fn of(self: &Arc<Self>, visitor: Visitor) -> TenantSessions {
        TenantSessions { all: Arc::clone(self), visitor }
    }

    /// What each tenant's sessions share.
    pub(crate) fn contexts(&self) -> &Contexts {
        &self.contexts
    }

    /// Sessions now, and at most.
    pub(crate) fn load(&self) -> (u32, u32) {
        (self.lock().len() as u32, self.max)
    }

    /// Follows whether new sessions are taken.
    pub(crate) fn follow_drain(&self) -> watch::Receiver<Drain> {
        self.contexts.first().monitor.follow_drain()
    }

    /// Whether new sessions are taken, and for how long new episodes are begun.
    pub(crate) fn drain(&self) -> Drain {
        self.contexts.first().monitor.drain_now()
    }

    /// Ends sessions that nobody has used for too long, and those that have nothing to finish
    /// before the service ends.
    pub(crate) fn reap(&self) {
        let (idle, drain) = (self.idle.detached, self.drain());
        let mut slots = self.lock();
        let before = slots.len();
        slots.retain(|_, slot| {
            let held = slot.life == Life::Connection || slot.attached.load(Ordering::Acquire);
            // Who is at work with a session has something to finish.
            let leaves = || slot.session.try_lock().is_ok_and(|session| session.leaves(drain));
            held || (slot.idle() < idle && !(drain.is_on() && leaves()))
        });
        let ended = before - slots.len();
        drop(slots);
        if ended > 0 {
            tracing::info!(ended, "idle sessions ended");
        }
    }

    /// Moves worlds away from services that end, between two steps of their sessions. Whether one
    /// should be tried again.
    pub(crate) async fn move_worlds(&self) -> bool {
        let slots: Vec<Arc<Slot>> = self.lock().values().cloned().collect();
        let is_full = Arc::new(AtomicBool::new(false));
        let moving = slots.into_iter().map(move |slot| {
            let is_full = Arc::clone(&is_full);
            async move { slot.move_unless(&is_full).await }
        });
        let moved = stream::iter(moving).buffer_unordered(MOVING_MAX);
        let failed = moved.fold((0_usize, None), |(count, why), moved| async move {
            match moved {
                Ok(()) => (count, why),
                Err(error) => (count + 1, Some(error)),
            }
        });
        let (count, Some(error)) = failed.await else { return false };
        tracing::warn!(count, %error, "worlds could not be moved");
        true
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Arc<Slot>>> {
        // Nothing panics while it holds the lock.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl TenantSessions {
    /// Sessions now, and at most.
    pub(crate) fn load(&self) -> (u32, u32) {
        match self.visitor.quotas.sessions_max {
            Some(max) => (of_tenant(&self.all.lock(), &self.visitor.tenant), max.min(self.all.max)),
            None => self.all.load(),
        }
    }

    fn owns(&self, slot: &Slot) -> bool {
        slot.tenant == self.visitor.tenant
    }

    /// States of episodes that are kept: id, size in bytes and time without use.
    pub(crate) fn snapshots(&self, now: Instant) -> Vec<(String, usize, Duration)> {
        self.all.contexts.of(&self.visitor.tenant).saved.list(now)
    }

    /// Gives one of them up; whether there was one.
    pub(crate) fn forget(&self, snapshot: &str, now: Instant) -> bool {
        self.all.contexts.of(&self.visitor.tenant).saved.forget(snapshot, now)
    }

    /// Opens a session.
    ///
    /// # Errors
    /// [`OpenError`]; nothing is opened.
    pub(crate) fn open(&self, life: Life) -> Result<InUse, OpenError> {
        let Visitor { tenant, quotas, token } = &self.visitor;
        let context = self.all.contexts.of(tenant);
        let figures = Arc::clone(&context.figures);
        if self.all.drain().is_on() {
            figures.draining.inc();
            return Err(OpenError::Draining);
        }
        let session = Session::new(context, *quotas)?;
        let slot = Arc::new(Slot {
            id: uuid::Uuid::new_v4().to_string(),
            session: tokio::sync::Mutex::new(session),
            tenant: tenant.clone(),
            token: token.clone(),
            life,
            is_open: AtomicBool::new(false),
            attached: AtomicBool::new(false),
            closing: AtomicBool::new(false),
            used: Mutex::new(Instant::now()),
        });
        let mut slots = self.all.lock();
        let (active, max) = (slots.len() as u32, self.all.max);
        if active >= max {
            figures.full.inc();
            return Err(OpenError::Capacity { active, max });
        }
        if let Some(max) = quotas.sessions_max {
            let active = of_tenant(&slots, tenant);
            if active >= max {
                figures.quota.inc();
                if self.all.refusals.may_tell(tenant.clone(), Instant::now()) {
                    let (quota, token) =
                        ("sessions_max", token.as_ref().map(tracing::field::display));
                    tracing::warn!(target: "audit", %tenant, token, quota, max, "quota refused");
                }
                return Err(OpenError::Quota { tenant: tenant.clone(), active, max });
            }
        }
        slots.insert(slot.id.clone(), Arc::clone(&slot));
        drop(slots);
        figures.opened.inc();
        slot.is_open.store(true, Ordering::Release);
        slot.tell("open session");
        Ok(InUse { sessions: Arc::clone(&self.all), slot: Arc::clone(&slot), is_attached: false })
    }

    /// A session by its id, for one request.
    ///
    /// # Errors
    /// [`AttachError::Unknown`].
    pub(crate) fn find(&self, id: &str) -> Result<InUse, AttachError> {
        let slot = self.all.lock().get(id).filter(|slot| self.owns(slot)).cloned();
        let slot = slot.ok_or_else(|| unknown(id))?;
        slot.touch();
        Ok(InUse { sessions: Arc::clone(&self.all), slot, is_attached: false })
    }

    /// A session by its id, for a connection of its own.
    ///
    /// # Errors
    /// [`AttachError`].
    pub(crate) fn attach(&self, id: &str) -> Result<InUse, AttachError> {
        let mut in_use = self.find(id)?;
        if in_use.slot.life == Life::Connection || in_use.slot.attached.swap(true, Ordering::AcqRel)
        {
            return Err(AttachError::Attached(cut(id)));
        }
        in_use.is_attached = true;
        Ok(in_use)
    }

    /// Closes a session.
    pub(crate) fn close(&self, id: &str) -> Closed {
        let mut slots = self.all.lock();
        let Some(slot) = slots.get(id).filter(|slot| self.owns(slot)) else {
            return Closed::Unknown;
        };
        if slot.life == Life::Connection || slot.attached.load(Ordering::Acquire) {
            slot.closing.store(true, Ordering::Release);
            return Closed::WithItsConnection;
        }
        slots.remove(id);
        Closed::Now
    }
}

impl Slot {
    /// Moves its world if it should be elsewhere, unless nobody has room, as is found out: who has
    /// none for this one has none for the next.
    async fn move_unless(&self, is_full: &AtomicBool) -> Result<(), Error> {
        // Nobody waits for a session that is at work.
        let mut session = self.session.lock().await;
        if is_full.load(Ordering::Relaxed) {
            return Ok(());
        }
        let moved = session.move_away().await;
        if moved.as_ref().is_err_and(|error| error.code == ErrorCode::Capacity) {
            is_full.store(true, Ordering::Relaxed);
        }
        moved
    }

    /// Writes down what became of it; where nobody needs a token, not in the log.
    fn tell(&self, what: &'static str) {
        let Self { tenant, id: session, .. } = self;
        match &self.token {
            Some(token) => tracing::info!(target: "audit", %tenant, %token, session, "{what}"),
            None => tracing::debug!(target: "audit", %tenant, session, "{what}"),
        }
    }

    /// Whether its connection should end.
    pub(crate) fn is_closing(&self) -> bool {
        self.closing.load(Ordering::Acquire)
    }

    /// Whether its id is good after the present request.
    pub(crate) fn lives_on(&self) -> bool {
        self.life == Life::Detached
    }

    fn touch(&self) {
        *self.used.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    fn idle(&self) -> Duration {
        self.used.lock().unwrap_or_else(PoisonError::into_inner).elapsed()
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        if *self.is_open.get_mut() {
            self.tell("close session");
        }
    }
}

fn of_tenant(slots: &BTreeMap<String, Arc<Slot>>, tenant: &Tenant) -> u32 {
    slots.values().filter(|slot| slot.tenant == *tenant).count() as u32
}

fn unknown(id: &str) -> AttachError {
    AttachError::Unknown(cut(id))
}

fn cut(id: &str) -> String {
    id.chars().take(64).collect()
}
