//! Towns by the digest of their map: fetched once, kept while there is room.

use std::sync::Arc;
use std::time::Duration;

use bus::Bus;
use lru::LruCache;
use schemas::{Error, ErrorCode, MapRef};
use tokio::runtime::Handle;

use crate::TownScene;

/// Towns kept in memory; the one longest unused goes first.
const TOWNS_MAX: usize = 16;
/// Triangles of all of them, but for the last one used.
const TRIANGLES_MAX: usize = 20_000_000;
/// How long the owner of a map may take to send it. Other jobs wait meanwhile.
const ASSET_DEADLINE: Duration = Duration::from_secs(2);

/// Towns by digest.
pub(crate) struct Towns {
    bus: Bus,
    runtime: Handle,
    known: LruCache<String, Arc<TownScene>>,
}

impl Towns {
    pub(crate) fn new(bus: Bus, runtime: Handle) -> Self {
        Self { bus, runtime, known: LruCache::unbounded() }
    }

    /// The scene of a map.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownMap`] when the text is not the map or not OpenDRIVE, and what the bus
    /// says when the text cannot be had.
    pub(crate) fn get(&mut self, map: &MapRef) -> Result<Arc<TownScene>, Error> {
        if let Some(town) = self.known.get(&map.digest) {
            return Ok(Arc::clone(town));
        }
        let town = self.fetch(map)?;
        self.known.push(map.digest.clone(), Arc::clone(&town));
        while self.known.len() > 1 && self.is_over() {
            self.known.pop_lru();
        }
        Ok(town)
    }

    fn is_over(&self) -> bool {
        let triangles: usize = self.known.iter().map(|(_, town)| town.triangle_count()).sum();
        self.known.len() > TOWNS_MAX || triangles > TRIANGLES_MAX
    }

    fn fetch(&self, map: &MapRef) -> Result<Arc<TownScene>, Error> {
        let bytes = self.runtime.block_on(self.bus.asset(&map.digest, ASSET_DEADLINE))?;
        let unusable = |cause: &dyn std::fmt::Display| {
            Error::new(
                ErrorCode::UnknownMap,
                format!("the map {:?} cannot be drawn: {cause}", map.name),
            )
        };
        let text = String::from_utf8(bytes).map_err(|cause| unusable(&cause))?;
        let parsed = roads::Map::parse(&map.name, &text).map_err(|cause| unusable(&cause))?;
        if parsed.digest() != map.digest {
            return Err(Error::new(
                ErrorCode::UnknownMap,
                "the bus has another map under this digest",
            )
            .wanted(&map.digest)
            .found(parsed.digest()));
        }
        let town = TownScene::of_map(&parsed);
        tracing::info!(
            map = map.name,
            triangles = town.triangle_count(),
            "a town was built for drawing"
        );
        Ok(Arc::new(town))
    }
}
