//! The world services of a bus: follows what is told of them, and knows the way to each.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bus::{Bus, BusError, Channel, Draining, Loads, Presence, Watch};
use schemas::{Error, Reply, Request, ServiceId, ServiceKind, WorldId, keys};
use tokio::sync::{mpsc, watch};
use tokio::task::{AbortHandle, JoinSet};

use crate::roster::{Coming, Roster};

/// News of ways that wait to be read; there are never more than a few for each host.
const NEWS_MAX: usize = 1_024;

/// A world service to ask, and the bus it is on.
#[derive(Clone)]
pub struct Host {
    /// The bus.
    pub bus: Bus,
    /// Its name.
    pub id: ServiceId,
    /// The fast way to it; `None` until it is open.
    pub channel: Option<Arc<Channel>>,
}

impl Host {
    /// Asks by a key that it serves, as long as the bus hears it.
    ///
    /// # Errors
    /// As for [`Bus::request`].
    pub(crate) async fn request(
        &self,
        key: &str,
        request: &Request,
        deadline: Duration,
    ) -> Result<Reply, Error> {
        let asked = self.bus.request(key, request, deadline);
        match &self.channel {
            Some(channel) => channel.while_heard(asked).await,
            None => asked.await,
        }
    }
}

/// The world services of a bus. Cheap to clone.
#[derive(Clone)]
pub struct Hosts {
    bus: watch::Receiver<Option<Bus>>,
    roster: Arc<Mutex<Roster<Arc<Channel>>>>,
    /// Counts what changes where worlds may go.
    changes: watch::Receiver<u64>,
}

/// What comes of opening and watching ways.
enum News {
    Opened(ServiceId, Coming, Arc<Channel>),
    Died(ServiceId, Coming),
}

struct Follower {
    bus: Bus,
    roster: Arc<Mutex<Roster<Arc<Channel>>>>,
    changes: watch::Sender<u64>,
    tell: mpsc::Sender<News>,
    /// Who opens ways, and looks whether those that are silent live.
    working: JoinSet<()>,
    /// The latter.
    watchers: BTreeMap<ServiceId, AbortHandle>,
}

/// What is told of services.
struct Told {
    presence: Watch,
    draining: Draining,
    loads: Loads,
    news: mpsc::Receiver<News>,
}

impl Hosts {
    /// Follows the world services of a bus that may still be connecting.
    pub fn follow(bus: watch::Receiver<Option<Bus>>) -> Self {
        let seed = RandomState::new().build_hasher().finish();
        let (changed, changes) = watch::channel(0);
        let roster = Arc::new(Mutex::new(Roster::new(seed)));
        let hosts = Self { bus: bus.clone(), roster: Arc::clone(&roster), changes };
        tokio::spawn(async move {
            if let Err(error) = follow(bus, roster, changed).await {
                tracing::error!(%error, "world services cannot be followed");
            }
        });
        hosts
    }

    /// Tells for ever whether one is up that takes new worlds: now, and when it changes.
    pub async fn tell_open(&self, tell: impl Fn(bool)) {
        let mut changes = self.changes();
        let mut told = None;
        loop {
            let is_open = lock(&self.roster).is_open();
            if told.replace(is_open) != Some(is_open) {
                tell(is_open);
            }
            if changes.changed().await.is_err() {
                return;
            }
        }
    }

    /// Changes whenever a host comes, goes, begins to drain or ceases to.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changes.clone()
    }

    /// Where a new world goes, of all but some; it counts as placed there.
    pub fn place(&self, but: &BTreeSet<ServiceId>) -> Option<Host> {
        let bus = self.bus()?;
        let (id, channel) = lock(&self.roster).place(but)?;
        Some(Host { bus, id, channel })
    }

    /// Whether one is up.
    pub fn is_any_up(&self) -> bool {
        lock(&self.roster).is_any_up()
    }

    /// Those that are heard on the bus, by name.
    pub fn heard(&self) -> Vec<Host> {
        let Some(bus) = self.bus() else { return Vec::new() };
        let heard = lock(&self.roster).heard().into_iter();
        heard.map(|(id, channel)| Host { bus: bus.clone(), id, channel }).collect()
    }

    /// Who has a world, if that is known and up.
    pub fn of_world(&self, world: WorldId) -> Option<Host> {
        let bus = self.bus()?;
        let roster = lock(&self.roster);
        let (id, channel) = roster.host_of(world)?;
        Some(Host { bus, id: id.clone(), channel: channel.cloned() })
    }

    /// Whether a world should be elsewhere: who has it drains, and somebody else takes new worlds.
    pub fn should_move(&self, world: WorldId) -> bool {
        lock(&self.roster).should_move(world)
    }

    /// Whether the process that had a world is known to be gone.
    pub fn is_gone(&self, world: WorldId) -> bool {
        lock(&self.roster).is_gone(world)
    }

    /// Remembers who has made a world, and with it all worlds of that process.
    pub fn note_world(&self, host: &ServiceId, world: WorldId) {
        lock(&self.roster).note_world(host, world);
    }

    /// Remembers who had no room, until it tells its next load.
    pub fn note_full(&self, host: &ServiceId) {
        lock(&self.roster).note_full(host);
    }

    /// The bus, once it is connected.
    pub fn bus(&self) -> Option<Bus> {
        self.bus.borrow().clone()
    }
}

async fn follow(
    mut bus: watch::Receiver<Option<Bus>>,
    roster: Arc<Mutex<Roster<Arc<Channel>>>>,
    changes: watch::Sender<u64>,
) -> Result<(), BusError> {
    let Ok(bus) = bus.wait_for(Option::is_some).await.map(|bus| bus.clone()) else { return Ok(()) };
    let Some(bus) = bus else { return Ok(()) };
    let (tell, news) = mpsc::channel(NEWS_MAX);
    let told = Told {
        presence: bus.watch(Some(ServiceKind::World)).await?,
        draining: bus.follow_draining(ServiceKind::World).await?,
        loads: bus.follow_loads(ServiceKind::World).await?,
        news,
    };
    let (working, watchers) = (JoinSet::new(), BTreeMap::new());
    Follower { bus, roster, changes, tell, working, watchers }.run(told).await;
    Ok(())
}

impl Follower {
    async fn run(mut self, mut told: Told) {
        loop {
            let is_change = tokio::select! {
                change = told.presence.next() => self.note(change),
                () = told.draining.changed() => true,
                (id, load) = told.loads.next() => {
                    lock(&self.roster).hear_load(&id, load);
                    false
                }
                Some(news) = told.news.recv() => self.hear(news),
                Some(_) = self.working.join_next() => false,
            };
            if is_change {
                // Who comes up may drain since before.
                lock(&self.roster).note_draining(|id| told.draining.has(id));
                self.changes.send_modify(|count| *count = count.wrapping_add(1));
            }
        }
    }

    fn note(&mut self, change: Presence) -> bool {
        match change {
            Presence::Up(alive) => {
                if let Some(watcher) = self.watchers.remove(&alive.id) {
                    watcher.abort();
                }
                let coming = lock(&self.roster).come_up(&alive.id, alive.number);
                tracing::info!(host = %alive.id, is_new = coming.is_some(), "world service up");
                if let Some(coming) = coming {
                    self.open(alive.id, coming);
                }
            }
            Presence::Down(_, id) => {
                let silent = lock(&self.roster).fall_silent(&id);
                match silent {
                    Some((coming, channel)) => self.watch(id, coming, channel),
                    None => tracing::warn!(host = %id, "world service down"),
                }
            }
        }
        true
    }

    fn hear(&mut self, news: News) -> bool {
        match news {
            News::Opened(id, coming, channel) => {
                let is_near = channel.has_shortcut();
                lock(&self.roster).open(&id, coming, channel, is_near);
                false
            }
            News::Died(id, coming) => {
                self.watchers.remove(&id);
                lock(&self.roster).die(&id, coming);
                true
            }
        }
    }

    /// Opens the way to a host; until then it is asked by queries.
    fn open(&mut self, id: ServiceId, coming: Coming) {
        let (bus, tell) = (self.bus.clone(), self.tell.clone());
        self.working.spawn(async move {
            match bus.channel(&keys::batch_tick(&id), (ServiceKind::World, &id)).await {
                // Nobody reads any more when the process ends.
                Ok(channel) => _ = tell.send(News::Opened(id, coming, Arc::new(channel))).await,
                Err(error) => {
                    tracing::warn!(host = %id, %error, "asked by queries: no fast channel");
                }
            }
        });
    }

    /// Looks whether one that the bus does not hear lives.
    fn watch(&mut self, id: ServiceId, coming: Coming, channel: Arc<Channel>) {
        let (tell, host) = (self.tell.clone(), id.clone());
        let watcher = self.working.spawn(async move {
            let begun = tokio::time::Instant::now();
            channel.until_dead().await;
            let silent_secs = begun.elapsed().as_secs_f32();
            tracing::warn!(host = %id, silent_secs, "world service down");
            // Nobody reads any more when the process ends.
            let _ = tell.send(News::Died(id, coming)).await;
        });
        self.watchers.insert(host, watcher);
    }
}

fn lock<W>(roster: &Mutex<Roster<W>>) -> MutexGuard<'_, Roster<W>> {
    // Nothing panics while it holds the lock.
    roster.lock().unwrap_or_else(PoisonError::into_inner)
}
