//! Maps by name.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use schemas::{Error, ErrorCode, MapRef};
use worlds::ParsedMaps;

use crate::limits::MAPS_MAX;
use crate::world_port::WorldPort;

/// Maps of one tenant.
pub(crate) struct Maps {
    port: Arc<dyn WorldPort>,
    /// As the world services list them; empty until they were asked.
    refs: Mutex<Vec<MapRef>>,
    parsed: ParsedMaps,
}

impl Maps {
    /// No maps yet.
    pub(crate) fn new(port: Arc<dyn WorldPort>) -> Self {
        Self { port, refs: Mutex::default(), parsed: ParsedMaps::new(MAPS_MAX) }
    }

    /// A map by name.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownMap`] with the text that clients know; those of the port.
    pub(crate) async fn get(&self, name: &str) -> Result<Arc<roads::Map>, Error> {
        let mut wanted = self.find(name);
        if wanted.is_none() {
            let refs = self.port.maps().await?;
            *self.lock() = refs;
            wanted = self.find(name);
        }
        let wanted = wanted.ok_or_else(|| self.unavailable(name))?;
        let text = async { self.port.map_text(wanted.digest.clone()).await };
        self.parsed.get(&wanted, text).await
    }

    /// Knows the content of a map without asking for it.
    #[cfg(test)]
    pub(crate) fn learn(&self, map: Arc<roads::Map>) {
        self.parsed.learn(map);
    }

    /// Forgets which content the names stand for: a new world service may have other maps.
    pub(crate) fn forget_names(&self) {
        self.lock().clear();
    }

    /// What a name stands for.
    fn find(&self, name: &str) -> Option<MapRef> {
        self.lock().iter().find(|map| map.name == name).cloned()
    }

    fn unavailable(&self, name: &str) -> Error {
        let names: Vec<String> = self.lock().iter().map(|map| format!("'{}'", map.name)).collect();
        let name: String = name.chars().take(64).collect();
        let names = names.join(", ");
        let text = format!("Map '{name}' is not available. Available maps: [{names}]");
        Error::new(ErrorCode::UnknownMap, text)
    }

    fn lock(&self) -> MutexGuard<'_, Vec<MapRef>> {
        // Nothing panics while it holds the lock.
        self.refs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
