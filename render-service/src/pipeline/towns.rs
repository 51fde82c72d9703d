//! Towns on the device: uploaded once per map, forgotten when too many others came since.

use std::sync::Arc;

use lru::LruCache;

use crate::scene::town::TownScene;

use super::buffers::GpuMesh;
use super::device::Gpu;

/// Towns kept on the device.
const TOWNS_MAX: usize = 16;
/// Bytes of all of them, but for the last one used.
const TOWNS_BYTES_MAX: u64 = 1024 * 1024 * 1024;

/// Towns by digest.
pub(crate) struct TownCache {
    towns: LruCache<String, Arc<GpuMesh>>,
}

impl Default for TownCache {
    fn default() -> Self {
        Self { towns: LruCache::unbounded() }
    }
}

impl TownCache {
    pub(crate) fn get(&mut self, gpu: &Gpu, scene: &Arc<TownScene>) -> Arc<GpuMesh> {
        if let Some(town) = self.towns.get(&scene.digest) {
            return Arc::clone(town);
        }
        let mesh = GpuMesh::new(gpu, bytemuck::cast_slice(&scene.vertices), &scene.indices);
        let town = Arc::new(mesh);
        self.towns.push(scene.digest.clone(), Arc::clone(&town));
        while self.towns.len() > 1 && self.is_over() {
            self.towns.pop_lru();
        }
        town
    }

    fn is_over(&self) -> bool {
        let bytes: u64 = self.towns.iter().map(|(_, town)| town.bytes()).sum();
        self.towns.len() > TOWNS_MAX || bytes > TOWNS_BYTES_MAX
    }
}
