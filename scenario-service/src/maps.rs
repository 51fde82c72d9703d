//! Maps by name, parsed once per content.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lru::LruCache;
use schemas::{Error, ErrorCode, MapRef};

use crate::limits::MAPS_MAX;
use crate::world_port::WorldPort;

/// Parsed maps, the longest unused one forgotten first.
pub(crate) struct Maps {
    port: Arc<dyn WorldPort>,
    known: Mutex<Known>,
}

struct Known {
    /// As the world service lists them; empty until it was asked.
    refs: Vec<MapRef>,
    parsed: LruCache<MapRef, Arc<roads::Map>>,
}

impl Maps {
    /// No maps yet.
    pub(crate) fn new(port: Arc<dyn WorldPort>) -> Self {
        let known = Known { refs: Vec::new(), parsed: LruCache::new(MAPS_MAX) };
        Self { port, known: Mutex::new(known) }
    }

    /// A map by name.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownMap`] with the text that clients know; those of the port.
    pub(crate) async fn get(&self, name: &str) -> Result<Arc<roads::Map>, Error> {
        let mut found = self.lock().find(name);
        if found.is_none() {
            let refs = self.port.maps().await?;
            let mut known = self.lock();
            known.refs = refs;
            found = known.find(name);
        }
        match found {
            Some((_, Some(map))) => Ok(map),
            Some((map, None)) => self.fetch(map).await,
            None => Err(self.unavailable(name)),
        }
    }

    /// Knows a map without asking for it.
    #[cfg(test)]
    pub(crate) fn learn(&self, map: Arc<roads::Map>) {
        let map_ref = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
        self.lock().parsed.push(map_ref, map);
    }

    /// Forgets which content the names stand for: a new world service may have other maps.
    pub(crate) fn forget_names(&self) {
        self.lock().refs.clear();
    }

    async fn fetch(&self, wanted: MapRef) -> Result<Arc<roads::Map>, Error> {
        let text = self.port.map_text(wanted.digest.clone()).await?;
        let parse = move || {
            let text = String::from_utf8(text).map_err(|_| broken("it is not UTF-8"))?;
            let map = roads::Map::parse(&wanted.name, &text);
            Ok((map.map_err(|error| broken(&error.to_string()))?, wanted))
        };
        // A large map takes seconds to parse; other sessions must not wait for it.
        let parsed = tokio::task::spawn_blocking(parse).await;
        let (map, wanted) = parsed.map_err(|_| broken("its reader panicked"))??;
        let map = Arc::new(map);
        self.lock().parsed.push(wanted, Arc::clone(&map));
        Ok(map)
    }

    fn unavailable(&self, name: &str) -> Error {
        let known = self.lock();
        let names: Vec<String> = known.refs.iter().map(|map| format!("'{}'", map.name)).collect();
        let name: String = name.chars().take(64).collect();
        let names = names.join(", ");
        let text = format!("Map '{name}' is not available. Available maps: [{names}]");
        Error::new(ErrorCode::UnknownMap, text)
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        // Nothing panics while it holds the lock.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known {
    /// What a name stands for, and the map if it is parsed.
    fn find(&mut self, name: &str) -> Option<(MapRef, Option<Arc<roads::Map>>)> {
        let map_ref = self.refs.iter().find(|map| map.name == name)?.clone();
        let map = self.parsed.get(&map_ref).cloned();
        Some((map_ref, map))
    }
}

fn broken(why: &str) -> Error {
    Error::new(ErrorCode::Internal, format!("the map cannot be used: {why}"))
}
