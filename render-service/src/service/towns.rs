//! Towns by the digest of their map: fetched and built once, on threads of their own, and kept
//! while there is room.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use bus::Bus;
use lru::LruCache;
use schemas::{Error, ErrorCode, MapRef, Tenant};
use tokio::runtime::Handle;

use crate::TownScene;

use super::job_queue::JobQueue;

/// Towns kept in memory; the one longest unused goes first.
const TOWNS_MAX: usize = 16;
/// Triangles of all of them, but for the last one used.
const TRIANGLES_MAX: usize = 20_000_000;
/// How long the owner of a map may take to send it.
const ASSET_DEADLINE: Duration = Duration::from_secs(2);
/// Towns that are fetched and built at once: they take processors from those who draw.
const UNDER_WAY_MAX: usize = 4;
/// Of them, those of one tenant.
const OF_TENANT_MAX: usize = 2;
/// Tenants of whom it is known when a town was last begun for them.
const BEGUN_MAX: usize = 1_024;

/// Towns by digest.
pub(crate) struct Towns {
    bus: Bus,
    runtime: Handle,
    queue: Arc<JobQueue>,
    known: LruCache<String, Arc<TownScene>>,
    /// For whom each is fetched and built.
    under_way: BTreeMap<String, Tenant>,
    /// The number of the town that was last begun for a tenant.
    begun: LruCache<Tenant, u64>,
    begun_count: u64,
}

/// What came of a town that was asked for.
pub(crate) struct BuiltTown {
    pub(crate) digest: String,
    /// Why there is none: [`ErrorCode::UnknownMap`] when the text is not the map or not OpenDRIVE,
    /// and what the bus says when the text cannot be had.
    pub(crate) town: Result<Arc<TownScene>, Error>,
}

impl Towns {
    pub(crate) fn new(bus: Bus, runtime: Handle, queue: Arc<JobQueue>) -> Self {
        Self {
            bus,
            runtime,
            queue,
            known: LruCache::unbounded(),
            under_way: BTreeMap::new(),
            begun: LruCache::unbounded(),
            begun_count: 0,
        }
    }

    /// Whether a town is there.
    pub(crate) fn has(&self, digest: &str) -> bool {
        self.known.contains(digest)
    }

    /// A town that is there.
    pub(crate) fn get(&mut self, digest: &str) -> Option<Arc<TownScene>> {
        self.known.get(digest).cloned()
    }

    /// Has towns fetched and built as far as there is room; the tenant comes first for whom one
    /// was begun longest ago, so that none whose towns never come keeps the room for ever.
    pub(crate) fn want<'a>(&mut self, wanted: impl Iterator<Item = (&'a Tenant, &'a MapRef)>) {
        let mut wanted: Vec<_> = wanted.collect();
        wanted.sort_by_key(|(tenant, _)| self.begun.peek(*tenant).copied());
        for (tenant, map) in wanted {
            self.begin(tenant, map);
        }
    }

    /// Has a town fetched and built for a tenant, unless it is there or enough others are under
    /// way; the queue gets it.
    fn begin(&mut self, tenant: &Tenant, map: &MapRef) {
        let is_enough = self.under_way.len() >= UNDER_WAY_MAX
            || self.under_way.contains_key(&map.digest)
            || self.under_way.values().filter(|other| *other == tenant).count() >= OF_TENANT_MAX;
        if is_enough || self.has(&map.digest) {
            return;
        }
        self.under_way.insert(map.digest.clone(), tenant.clone());
        self.begun_count += 1;
        self.begun.push(tenant.clone(), self.begun_count);
        if self.begun.len() > BEGUN_MAX {
            self.begun.pop_lru();
        }
        let (bus, runtime, queue) =
            (self.bus.clone(), self.runtime.clone(), Arc::clone(&self.queue));
        let map = map.clone();
        let answer = AnswerOnDrop { queue, digest: map.digest.clone(), town: None };
        self.runtime.spawn_blocking(move || answer.with(build(&bus, &runtime, &map)));
    }

    /// Keeps a town that has come.
    pub(crate) fn keep(&mut self, digest: &str, town: Arc<TownScene>) {
        self.known.push(digest.to_owned(), town);
        while self.known.len() > 1 && self.is_over() {
            self.known.pop_lru();
        }
    }

    /// Notes that a town has come, or not.
    pub(crate) fn note_end(&mut self, digest: &str) {
        self.under_way.remove(digest);
    }

    fn is_over(&self) -> bool {
        let triangles: usize = self.known.iter().map(|(_, town)| town.triangle_count()).sum();
        self.known.len() > TOWNS_MAX || triangles > TRIANGLES_MAX
    }
}

/// Answers also when a map makes the builder panic.
struct AnswerOnDrop {
    queue: Arc<JobQueue>,
    digest: String,
    town: Option<Result<Arc<TownScene>, Error>>,
}

impl AnswerOnDrop {
    fn with(mut self, town: Result<Arc<TownScene>, Error>) {
        self.town = Some(town);
    }
}

impl Drop for AnswerOnDrop {
    fn drop(&mut self) {
        let broken = || Err(Error::new(ErrorCode::Internal, "the town could not be built"));
        let town = self.town.take().unwrap_or_else(broken);
        self.queue.put_town(BuiltTown { digest: std::mem::take(&mut self.digest), town });
    }
}

fn build(bus: &Bus, runtime: &Handle, map: &MapRef) -> Result<Arc<TownScene>, Error> {
    let bytes = runtime.block_on(bus.asset(&map.digest, ASSET_DEADLINE))?;
    let unusable = |cause: &dyn std::fmt::Display| {
        let what = format!("the map {:?} cannot be drawn: {cause}", map.name);
        Error::new(ErrorCode::UnknownMap, what)
    };
    let text = String::from_utf8(bytes).map_err(|cause| unusable(&cause))?;
    let parsed = roads::Map::parse(&map.name, &text).map_err(|cause| unusable(&cause))?;
    if parsed.digest() != map.digest {
        let error = Error::new(ErrorCode::UnknownMap, "the bus has another map under this digest");
        return Err(error.wanted(&map.digest).found(parsed.digest()));
    }
    let town = TownScene::of_map(&parsed);
    let triangles = town.triangle_count();
    tracing::info!(map = map.name, triangles, "a town was built for drawing");
    Ok(Arc::new(town))
}
