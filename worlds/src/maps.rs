//! Maps, parsed once per content.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;
use schemas::{Error, ErrorCode, MapRef};

/// Parsed maps, the longest unused one forgotten first.
pub struct ParsedMaps {
    parsed: Mutex<LruCache<MapRef, Arc<roads::Map>>>,
}

impl ParsedMaps {
    /// None yet, and never more than so many.
    pub fn new(count_max: NonZeroUsize) -> Self {
        Self { parsed: Mutex::new(LruCache::new(count_max)) }
    }

    /// A map that is known already.
    pub fn known(&self, map: &MapRef) -> Option<Arc<roads::Map>> {
        self.lock().get(map).cloned()
    }

    /// Knows a map.
    pub fn learn(&self, map: Arc<roads::Map>) {
        let map_ref = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
        self.lock().push(map_ref, map);
    }

    /// A map, with its text if it is not known yet.
    ///
    /// # Errors
    /// Those of the text; what is wrong with it.
    pub async fn get(
        &self,
        wanted: &MapRef,
        text: impl Future<Output = Result<Vec<u8>, Error>>,
    ) -> Result<Arc<roads::Map>, Error> {
        if let Some(map) = self.known(wanted) {
            return Ok(map);
        }
        let (text, name) = (text.await?, wanted.name.clone());
        let parse = move || {
            let text = String::from_utf8(text).map_err(|_| broken("it is not UTF-8"))?;
            roads::Map::parse(&name, &text).map_err(|error| broken(&error.to_string()))
        };
        // A large map takes seconds to parse; others must not wait for it.
        let parsed = tokio::task::spawn_blocking(parse).await;
        let map = Arc::new(parsed.map_err(|_| broken("its reader panicked"))??);
        self.lock().push(wanted.clone(), Arc::clone(&map));
        Ok(map)
    }

    fn lock(&self) -> MutexGuard<'_, LruCache<MapRef, Arc<roads::Map>>> {
        // Nothing panics while it holds the lock.
        self.parsed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn broken(why: &str) -> Error {
    Error::new(ErrorCode::Internal, format!("the map cannot be used: {why}"))
}
