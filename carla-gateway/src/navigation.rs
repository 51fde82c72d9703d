//! The file by which clients steer walkers, made once per map.

use std::sync::Arc;

use roads::nav::{NavMesh, detour};
use tokio::sync::OnceCell;

/// A file that clients fetch.
#[derive(Debug)]
pub(crate) struct NavFile {
    /// Changes with the content: clients never fetch a path twice.
    pub(crate) path: String,
    pub(crate) bytes: Vec<u8>,
}

/// The navigation file of a map, made when it is first wanted.
#[derive(Debug)]
pub(crate) struct Navigation {
    map: Arc<roads::Map>,
    made: OnceCell<Option<NavFile>>,
}

impl Navigation {
    /// Of a map, not made yet.
    pub(crate) fn new(map: Arc<roads::Map>) -> Self {
        Self { map, made: OnceCell::new() }
    }

    /// The file; `None` for a map where nobody can walk.
    pub(crate) async fn file(&self) -> Option<&NavFile> {
        let make = || async {
            let map = Arc::clone(&self.map);
            let made = tokio::task::spawn_blocking(move || make(&map)).await;
            made.unwrap_or_else(|panic| {
                tracing::error!(%panic, "the navigation mesh could not be made");
                None
            })
        };
        self.made.get_or_init(make).await.as_ref()
    }
}

fn make(map: &roads::Map) -> Option<NavFile> {
    let unusable = |why: &dyn std::fmt::Display| {
        tracing::warn!(map = map.name(), %why, "walkers cannot find their way on this map");
    };
    let mesh = NavMesh::new(map).map_err(|error| unusable(&error)).ok()?;
    let bytes = detour::file(&mesh).map_err(|error| unusable(&error)).ok()?;
    (!bytes.is_empty()).then(|| NavFile { path: detour::file_name(map.name(), &bytes), bytes })
}
