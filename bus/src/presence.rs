//! Who is up: liveliness tokens, and what their owners say of themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use schemas::wire;
use schemas::{Alive, ServiceId, ServiceKind, keys, limits};
use tokio::sync::Notify;
use tokio::task::JoinSet;
use tokio::time::Instant;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

use crate::query::{ask, ask_others};
use crate::{Bus, BusError, Serving};

/// How long a service that has just come up may take to describe itself.
const DESCRIBE_DEADLINE: Duration = Duration::from_millis(500);
/// Services that are asked at once what they are.
const DESCRIBING_MAX: usize = 256;
/// Services that are followed at once. One more takes the place of one that did not say what it is;
/// where all did, it is not noticed.
const SERVICES_MAX: usize = 4_096;
/// How long one that answers waits for those before it by name.
const ORDER_PATIENCE: Duration = Duration::from_millis(50);

type Key = (ServiceKind, ServiceId);

/// A service is known to be up as long as this value and its process live.
#[must_use = "dropping it tells everyone that the service is gone"]
pub struct Announcement {
    _token: LivelinessToken,
    _description: Serving,
}

/// A change of who is up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Presence {
    /// A service came up, or was up already when the watch began.
    Up(Alive),
    /// A service ended, died, or cannot be reached any more.
    Down(ServiceKind, ServiceId),
}

/// Follows who is up.
///
/// Holds states, not events: however late it is read, it never grows beyond the number of services,
/// of which it follows 4,096.
pub struct Watch {
    bus: Bus,
    seen: Arc<Seen>,
    /// What [`next`](Self::next) has told, with the generation it told.
    told: BTreeMap<Key, u64>,
    /// Services that are being asked what they are or have answered, and are not told yet.
    asked: BTreeMap<Key, u64>,
    /// When the oldest of those that are being asked was.
    asked_at: Instant,
    describing: JoinSet<(Key, u64, Alive)>,
    described: BTreeMap<Key, (u64, Alive)>,
    _subscriber: Subscriber<()>,
}

/// A name that no other process has: its kind and six random letters.
///
/// What a process has leased under its name must not be kept alive by the next one, so a process
/// that is started again has another.
pub fn unused_id(kind: ServiceKind) -> ServiceId {
    const LETTERS: u64 = 26;
    let mut random = RandomState::new().hash_one(std::process::id());
    let mut text = format!("{}-", kind.as_str());
    for _ in 0..6 {
        text.push(char::from(b'a' + (random % LETTERS) as u8));
        random /= LETTERS;
    }
    text.parse().expect("a kind is a word of letters and hyphens")
}

#[derive(Default)]
struct Seen {
    up: Mutex<Generations>,
    changed: Notify,
}

#[derive(Default)]
struct Generations {
    of: BTreeMap<Key, u64>,
    /// Those of them that did not say what they are.
    mute: BTreeSet<Key>,
    next: u64,
    /// Whether it was said that there are too many.
    is_full_told: bool,
}

impl Generations {
    /// Notes one that is up; whether there is room for it.
    fn insert(&mut self, service: Key) -> bool {
        // A second token of the same service, or a late echo of the first, changes nothing.
        if self.of.contains_key(&service) {
            return true;
        }
        if self.of.len() >= SERVICES_MAX {
            let Some(mute) = self.mute.pop_first() else { return false };
            self.of.remove(&mute);
        }
        self.next += 1;
        self.of.insert(service, self.next);
        true
    }

    fn remove(&mut self, service: &Key) {
        self.of.remove(service);
        self.mute.remove(service);
    }
}

impl Bus {
    /// Tells everyone that a service is up, and answers what it is.
    ///
    /// # Errors
    /// [`BusError::NameTaken`] when another of its kind has its name, as far as it can be heard; of
    /// two that come at the same moment both may be told. [`BusError::Declare`] when the session is
    /// closed.
    pub async fn announce(&self, alive: Alive) -> Result<Announcement, BusError> {
        let key = keys::alive(alive.kind, &alive.id);
        let bytes = wire::encode_alive(&alive);
        // First the description, then the token: who sees the token can ask.
        let description =
            self.serve(&key, move |incoming| incoming.reply_bytes(bytes.clone())).await?;
        // After the description, so that two that come together hear of each other.
        if ask_others(&self.session, &key, DESCRIBE_DEADLINE).await {
            return Err(BusError::NameTaken { kind: alive.kind, id: alive.id });
        }
        let token = self
            .session
            .liveliness()
            .declare_token(&key)
            .await
            .map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
        Ok(Announcement { _token: token, _description: description })
    }

    /// Follows services of one kind, or of all; those that are up already come first.
    ///
    /// # Errors
    /// [`BusError::Declare`] when the session is closed.
    pub async fn watch(&self, kind: Option<ServiceKind>) -> Result<Watch, BusError> {
        let key = kind.map_or_else(|| keys::ANY_ALIVE.to_owned(), keys::any_alive);
        let seen = Arc::new(Seen::default());
        let on_change = {
            let seen = Arc::clone(&seen);
            move |sample: zenoh::sample::Sample| {
                if let Some(service) = keys::parse_alive(sample.key_expr().as_str()) {
                    seen.note(service, sample.kind() == SampleKind::Put);
                }
            }
        };
        let subscriber = self
            .session
            .liveliness()
            .declare_subscriber(&key)
            .history(true)
            .callback(on_change)
            .await
            .map_err(|cause| BusError::Declare { key, cause: cause.to_string() })?;
        Ok(Watch {
            bus: self.clone(),
            seen,
            told: BTreeMap::new(),
            asked: BTreeMap::new(),
            asked_at: Instant::now(),
            describing: JoinSet::new(),
            described: BTreeMap::new(),
            _subscriber: subscriber,
        })
    }
}

impl Watch {
    /// The next change. A service that does not describe itself in time is told with empty text
    /// fields and capacity 0, and keeps nobody waiting who does. Of several that are up already the
    /// first by name comes first, unless it takes its time.
    ///
    /// May be dropped and called again without losing a change.
    pub async fn next(&mut self) -> Presence {
        loop {
            let seen = Arc::clone(&self.seen);
            let changed = seen.changed.notified();
            let gone = self.told.iter().find(|(service, told)| !seen.is_at(service, **told));
            if let Some((service, _)) = gone {
                let (kind, id) = service.clone();
                self.told.remove(&(kind, id.clone()));
                return Presence::Down(kind, id);
            }
            self.ask_who_is_new();
            let tells_at = self.asked_at + ORDER_PATIENCE;
            if (self.describing.is_empty() || tells_at <= Instant::now())
                && let Some((service, (generation, alive))) = self.described.pop_first()
            {
                self.asked.remove(&service);
                // It may have gone while it was asked; then nobody need hear of it.
                if seen.is_at(&service, generation) {
                    self.told.insert(service, generation);
                    return Presence::Up(alive);
                }
                continue;
            }
            tokio::select! {
                () = changed => {}
                Some(Ok((service, generation, alive))) = self.describing.join_next() => {
                    self.described.insert(service, (generation, alive));
                }
                () = tokio::time::sleep_until(tells_at), if !self.described.is_empty() => {}
            }
        }
    }

    fn ask_who_is_new(&mut self) {
        while self.describing.len() < DESCRIBING_MAX
            && let Some((service, generation)) = self.seen.first_not_in([&self.told, &self.asked])
        {
            if self.describing.is_empty() {
                self.asked_at = Instant::now();
            }
            self.asked.insert(service.clone(), generation);
            let (session, seen) = (self.bus.session.clone(), Arc::clone(&self.seen));
            self.describing.spawn(async move {
                let alive = describe(&session, &service).await.unwrap_or_else(|| {
                    seen.note_mute(&service, generation);
                    nameless(&service)
                });
                (service, generation, alive)
            });
        }
    }
}

async fn describe(session: &zenoh::Session, (kind, id): &Key) -> Option<Alive> {
    let key = keys::alive(*kind, id);
    let bytes_max = limits::REQUEST_BYTES_MAX;
    let described = ask(session, &key, Vec::new(), bytes_max, DESCRIBE_DEADLINE).await;
    let described = described.and_then(|bytes| wire::decode_alive(&bytes));
    described
        .inspect_err(|error| {
            tracing::warn!(key, %error, "a service is up but does not say what it is");
        })
        .ok()
}

/// What is known of a service that does not say what it is.
fn nameless((kind, id): &Key) -> Alive {
    Alive {
        kind: *kind,
        id: id.clone(),
        version: String::new(),
        pid: 0,
        capacity: 0,
        detail: String::new(),
        number: 0,
    }
}

impl Seen {
    fn lock(&self) -> MutexGuard<'_, Generations> {
        // Nothing panics while it holds the lock.
        self.up.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, service: Key, up: bool) {
        let mut seen = self.lock();
        if !up {
            seen.remove(&service);
        } else if !seen.insert(service) && !std::mem::replace(&mut seen.is_full_told, true) {
            tracing::error!(max = SERVICES_MAX, "more services are announced than can be followed");
        }
        drop(seen);
        self.changed.notify_one();
    }

    /// Notes that a service did not say what it is.
    fn note_mute(&self, service: &Key, generation: u64) {
        let mut seen = self.lock();
        if seen.of.get(service) == Some(&generation) {
            seen.mute.insert(service.clone());
        }
    }

    fn is_at(&self, service: &Key, generation: u64) -> bool {
        self.lock().of.get(service) == Some(&generation)
    }

    fn first_not_in(&self, known: [&BTreeMap<Key, u64>; 2]) -> Option<(Key, u64)> {
        let generations = self.lock();
        let is_new = |service: &Key| known.iter().all(|known| !known.contains_key(service));
        let found = generations.of.iter().find(|(service, _)| is_new(service));
        found.map(|(service, generation)| (service.clone(), *generation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_processes_are_of_their_kind_and_differ() {
        for kind in ServiceKind::ALL {
            let (one, other) = (unused_id(kind), unused_id(kind));
            assert!(one.as_str().starts_with(kind.as_str()), "{one}");
            assert_ne!(one, other);
        }
    }

    #[test]
    fn of_too_many_services_those_that_say_nothing_make_room_for_who_comes() {
        let service = |count: usize| (ServiceKind::World, format!("w-{count}").parse().unwrap());
        let seen = Seen::default();
        for count in 0..SERVICES_MAX {
            seen.note(service(count), true);
        }
        seen.note(service(SERVICES_MAX), true);
        assert_eq!(seen.lock().of.len(), SERVICES_MAX);
        assert!(!seen.lock().of.contains_key(&service(SERVICES_MAX)), "all may say what they are");
        let generation = seen.lock().of[&service(7)];
        seen.note_mute(&service(7), generation);
        seen.note_mute(&service(8), generation);
        seen.note(service(SERVICES_MAX), true);
        assert!(seen.lock().of.contains_key(&service(SERVICES_MAX)));
        assert!(!seen.is_at(&service(7), generation), "it is told to be gone");
        seen.note(service(SERVICES_MAX + 1), true);
        assert_eq!(seen.lock().of.len(), SERVICES_MAX);
        assert!(seen.lock().mute.is_empty(), "one of another generation has spoken since");
        seen.note(service(8), false);
        seen.note(service(SERVICES_MAX + 1), true);
        assert!(seen.lock().of.contains_key(&service(SERVICES_MAX + 1)));
    }
}
