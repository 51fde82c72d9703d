//! Towns on the device: uploaded once per map, forgotten when too many others came since.

use std::sync::Arc;

use crate::scene::town::TownScene;

use super::buffers::GpuMesh;
use super::device::Gpu;

/// Towns kept on the device.
const TOWNS_MAX: usize = 16;
/// Bytes of all of them, but for the last one used.
const TOWNS_BYTES_MAX: u64 = 1024 * 1024 * 1024;

/// A town that can be drawn.
pub(crate) struct GpuTown {
    pub(crate) scene: Arc<TownScene>,
    pub(crate) mesh: GpuMesh,
}

/// Towns by digest; the last one used is at the end.
#[derive(Default)]
pub(crate) struct TownCache {
    towns: Vec<Arc<GpuTown>>,
}

impl TownCache {
    pub(crate) fn get(&mut self, gpu: &Gpu, scene: &Arc<TownScene>) -> Arc<GpuTown> {
        let known = self.towns.iter().position(|town| town.scene.digest == scene.digest);
        let town = match known {
            Some(at) => self.towns.remove(at),
            None => Arc::new(GpuTown {
                scene: Arc::clone(scene),
                mesh: GpuMesh::new(gpu, bytemuck::cast_slice(&scene.vertices), &scene.indices),
            }),
        };
        self.towns.push(Arc::clone(&town));
        while self.towns.len() > 1 && self.is_over() {
            self.towns.remove(0);
        }
        town
    }

    fn is_over(&self) -> bool {
        let bytes: u64 = self.towns.iter().map(|town| town.mesh.bytes()).sum();
        self.towns.len() > TOWNS_MAX || bytes > TOWNS_BYTES_MAX
    }
}
