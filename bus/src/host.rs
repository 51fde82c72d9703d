//! Which services of a kind are up, where new work goes, and the fast way to each.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemas::{ServiceId, ServiceKind, WorldId};
use tokio::sync::watch;
use tokio::task::{AbortHandle, JoinSet};

use crate::{Bus, Channel, Presence};

/// A service to ask, and the bus it is on.
#[derive(Clone)]
pub struct Host {
    /// The bus.
    pub bus: Bus,
    /// Its name.
    pub id: ServiceId,
    /// The fast way to it; `None` until it is open.
    pub channel: Option<Arc<Channel>>,
}

/// The services of a kind. Cheap to clone.
#[derive(Clone)]
pub struct Hosts {
    next: watch::Receiver<Option<Host>>,
    is_open: watch::Receiver<bool>,
    known: Arc<Mutex<Known>>,
}

/// What is known of those that are up.
#[derive(Default)]
struct Known {
    /// In the order in which they were heard of: at the beginning by name.
    up: Vec<ServiceId>,
    channels: BTreeMap<ServiceId, Arc<Channel>>,
    /// Of them, those that the bus does not hear, and who looks whether they live.
    silent: BTreeMap<ServiceId, AbortHandle>,
    /// By the number in the ids of their worlds.
    numbers: BTreeMap<u32, ServiceId>,
}

/// Follows the services of a kind.
struct Follower {
    kind: ServiceKind,
    key: fn(&ServiceId) -> String,
    next: Arc<watch::Sender<Option<Host>>>,
    is_open: watch::Sender<bool>,
    known: Arc<Mutex<Known>>,
}

impl Hosts {
    /// Follows the services of a kind, on a bus that may still be connecting. Channels are opened
    /// to what they serve under `key`.
    pub fn follow(
        bus: watch::Receiver<Option<Bus>>,
        kind: ServiceKind,
        key: fn(&ServiceId) -> String,
    ) -> Self {
        let (told, next) = watch::channel(None);
        let (opened, is_open) = watch::channel(false);
        let hosts = Self { next, is_open, known: Arc::default() };
        let known = Arc::clone(&hosts.known);
        let follower = Follower { kind, key, next: Arc::new(told), is_open: opened, known };
        tokio::spawn(follower.run(bus));
        hosts
    }

    /// Tells for ever whether one is up that takes new work: now, and when it changes.
    pub async fn tell_open(&self, tell: impl Fn(bool)) {
        let mut is_open = self.is_open.clone();
        loop {
            let now = *is_open.borrow_and_update();
            tell(now);
            if is_open.changed().await.is_err() {
                return;
            }
        }
    }

    /// Where new work goes, now and later: to the first that was heard of among those that take
    /// any, else to the first that is up, else to one that is silent on the bus and proven to live.
    pub fn next(&self) -> watch::Receiver<Option<Host>> {
        self.next.clone()
    }

    /// Remembers who has made a world, and with it all worlds of that process.
    pub fn note_world(&self, host: &ServiceId, world: WorldId) {
        let mut known = lock(&self.known);
        if known.up.contains(host) {
            known.numbers.insert(world.host(), host.clone());
        }
    }

    /// Who has a world, if that is known and up; else who gets new work.
    pub fn of_world(&self, world: WorldId) -> Option<Host> {
        let next = self.next.borrow().clone()?;
        let known = lock(&self.known);
        match known.numbers.get(&world.host()) {
            Some(id) if *id != next.id => {
                let channel = known.channels.get(id).cloned();
                Some(Host { bus: next.bus, id: id.clone(), channel })
            }
            _ => Some(next),
        }
    }
}

impl Known {
    fn forget(&mut self, id: &ServiceId) {
        self.up.retain(|host| host != id);
        self.channels.remove(id);
        self.silent.remove(id);
        self.numbers.retain(|_, host| host != id);
    }
}

impl Follower {
    async fn run(self, mut bus: watch::Receiver<Option<Bus>>) {
        let Ok(bus) = bus.wait_for(Option::is_some).await.map(|bus| bus.clone()) else { return };
        let Some(bus) = bus else { return };
        let followed = async {
            Ok::<_, crate::BusError>((
                bus.watch(Some(self.kind)).await?,
                bus.follow_draining(self.kind).await?,
            ))
        };
        let (mut presence, mut draining) = match followed.await {
            Ok(followed) => followed,
            Err(error) => {
                tracing::error!(kind = ?self.kind, %error, "services cannot be followed");
                return;
            }
        };
        let mut watching = JoinSet::new();
        loop {
            tokio::select! {
                change = presence.next() => self.note(change, &mut watching),
                () = draining.changed() => {}
                Some(Ok(dead)) = watching.join_next() => lock(&self.known).forget(&dead),
            }
            let (heard, silent): (Vec<_>, Vec<_>) = {
                let known = lock(&self.known);
                known.up.iter().cloned().partition(|id| !known.silent.contains_key(id))
            };
            let open = heard.iter().find(|id| !draining.has(id));
            self.is_open.send_replace(open.is_some());
            self.tell(&bus, open.or(heard.first()).or(silent.first()));
        }
    }

    /// Who is not heard any more is forgotten, unless its shortcut proves that it lives.
    fn note(&self, change: Presence, watching: &mut JoinSet<ServiceId>) {
        let mut known = lock(&self.known);
        match change {
            Presence::Up(alive) => {
                tracing::info!(kind = ?self.kind, host = %alive.id, "service up");
                if let Some(watch) = known.silent.remove(&alive.id) {
                    watch.abort();
                    if known.channels.get(&alive.id).is_some_and(|channel| channel.is_alive()) {
                        return;
                    }
                    known.forget(&alive.id);
                }
                known.up.push(alive.id);
            }
            Presence::Down(_, id) => match known.channels.get(&id) {
                Some(channel) if channel.is_alive() => {
                    tracing::warn!(kind = ?self.kind, host = %id, "service silent; it lives");
                    let (channel, silent) = (Arc::clone(channel), id.clone());
                    let watch = watching.spawn(async move {
                        channel.until_dead().await;
                        silent
                    });
                    known.silent.insert(id, watch);
                }
                _ => {
                    tracing::warn!(kind = ?self.kind, host = %id, "service down");
                    known.forget(&id);
                }
            },
        }
    }

    fn tell(&self, bus: &Bus, next: Option<&ServiceId>) {
        let told = self.next.borrow().as_ref().map(|host| host.id.clone());
        if told.as_ref() == next {
            return;
        }
        let channel = next.and_then(|id| lock(&self.known).channels.get(id).cloned());
        let is_open = channel.is_some();
        self.next.send_replace(next.map(|id| Host { bus: bus.clone(), id: id.clone(), channel }));
        if let (Some(id), false) = (next, is_open) {
            let key = (self.key)(id);
            let (next, known) = (Arc::clone(&self.next), Arc::clone(&self.known));
            tokio::spawn(open_channel(bus.clone(), key, (self.kind, id.clone()), next, known));
        }
    }
}

/// Opens the channel to a host; where that fails, it is asked by queries for good.
async fn open_channel(
    bus: Bus,
    key: String,
    (kind, id): (ServiceKind, ServiceId),
    next: Arc<watch::Sender<Option<Host>>>,
    known: Arc<Mutex<Known>>,
) {
    let channel = match bus.channel(&key, (kind, &id)).await {
        Ok(channel) => Arc::new(channel),
        Err(error) => {
            return tracing::warn!(host = %id, %error, "questions go as queries: no fast channel");
        }
    };
    {
        let mut known = lock(&known);
        if known.up.contains(&id) {
            known.channels.insert(id.clone(), Arc::clone(&channel));
        }
    }
    next.send_if_modified(|host| match host {
        Some(host) if host.id == id => {
            host.channel = Some(channel);
            true
        }
        _ => false,
    });
}

fn lock(known: &Mutex<Known>) -> MutexGuard<'_, Known> {
    // Nothing panics while it holds the lock.
    known.lock().unwrap_or_else(PoisonError::into_inner)
}
