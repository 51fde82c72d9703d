//! Maps by name, parsed once per content.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemas::{Error, ErrorCode, MapRef};

use crate::limits::MAPS_MAX;
use crate::world_port::WorldPort;

/// Parsed maps, the longest unused one forgotten first.
pub struct Maps {
    port: Arc<dyn WorldPort>,
    known: Mutex<Known>,
}

#[derive(Default)]
struct Known {
    /// As the world service lists them; empty until it was asked.
    refs: Vec<MapRef>,
    /// Last used last.
    parsed: Vec<Arc<roads::Map>>,
}

impl Maps {
    /// No maps yet.
    pub fn new(port: Arc<dyn WorldPort>) -> Self {
        Self { port, known: Mutex::new(Known::default()) }
    }

    /// A map by name.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownMap`] with the text that clients know; those of the port.
    pub async fn get(&self, name: &str) -> Result<Arc<roads::Map>, Error> {
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

    /// Forgets which content the names stand for: a new world service may have other maps.
    pub fn forget_names(&self) {
        self.lock().refs.clear();
    }

    async fn fetch(&self, wanted: MapRef) -> Result<Arc<roads::Map>, Error> {
        let text = self.port.map_text(wanted.digest.clone()).await?;
        let parse = move || {
            let text = String::from_utf8(text).map_err(|_| broken("it is not UTF-8"))?;
            roads::Map::parse(&wanted.name, &text).map_err(|error| broken(&error.to_string()))
        };
        // A large map takes seconds to parse; other sessions must not wait for it.
        let parsed = tokio::task::spawn_blocking(parse).await;
        let map = Arc::new(parsed.map_err(|_| broken("its reader panicked"))??);
        self.lock().keep(Arc::clone(&map));
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
        let is_it = |map: &Arc<roads::Map>| map.digest() == map_ref.digest && map.name() == name;
        let Some(at) = self.parsed.iter().position(is_it) else { return Some((map_ref, None)) };
        let map = self.parsed.remove(at);
        self.parsed.push(Arc::clone(&map));
        Some((map_ref, Some(map)))
    }

    fn keep(&mut self, map: Arc<roads::Map>) {
        if self.parsed.len() >= MAPS_MAX {
            self.parsed.remove(0);
        }
        self.parsed.push(map);
    }
}

fn broken(why: &str) -> Error {
    Error::new(ErrorCode::Internal, format!("the map cannot be used: {why}"))
}
