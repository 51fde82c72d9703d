//! Models on the device: all shapes at all levels, and the towns that were drawn last.

use std::collections::BTreeMap;

use raster::Model;

use crate::models::levels;
use crate::models::towns::{TownModels, built};
use crate::scene::town::TownScene;

use super::adapter::Gpu;
use super::buffers::Kept;
use super::rows::{ClusterRow, CornerRow, ModelPlace};

/// Towns on the device.
const TOWNS_MAX: usize = 16;

/// What lies on the ground, and what stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TownPlace {
    pub(crate) models: [ModelPlace; 2],
    /// Another one for every town since the device was opened.
    pub(crate) number: u64,
}

/// All of them.
pub(crate) struct Models {
    pub(crate) corners: Kept,
    pub(crate) triangles: Kept,
    pub(crate) clusters: Kept,
    /// At the places of the levels' numbers.
    shapes: Vec<ModelPlace>,
    /// Bytes of corners, triangles and clusters of the shapes.
    of_shapes: [u64; 3],
    /// As the rasteriser reads them, from which they are put on the device again.
    built: TownModels,
    towns: BTreeMap<String, TownPlace>,
    towns_so_far: u64,
    /// Bytes of all models, but for the last town.
    bytes_max: u64,
}

impl Models {
    pub(crate) fn new(gpu: &Gpu, bytes_max: u64) -> Self {
        let mut models = Self {
            corners: Kept::new(gpu, "corners"),
            triangles: Kept::new(gpu, "triangles"),
            clusters: Kept::new(gpu, "clusters"),
            shapes: Vec::new(),
            of_shapes: [0; 3],
            built: TownModels::default(),
            towns: BTreeMap::new(),
            towns_so_far: 0,
            bytes_max,
        };
        models.shapes = levels::all().map(|level| models.push(gpu, &level.model)).collect();
        models.of_shapes = models.bytes();
        models
    }

    /// Where a shape's level is.
    pub(crate) fn shape(&self, number: usize) -> ModelPlace {
        self.shapes.get(number).copied().unwrap_or_default()
    }

    /// Makes room for more towns, if those that are there are too many. Their places are of no use
    /// afterwards.
    pub(crate) fn make_room(&mut self) {
        if self.is_full() {
            let [corners, triangles, clusters] = self.of_shapes;
            self.corners.truncate(corners);
            self.triangles.truncate(triangles);
            self.clusters.truncate(clusters);
            self.towns.clear();
        }
    }

    /// Whether no other town should be put here.
    pub(crate) fn is_full(&self) -> bool {
        self.towns.len() >= TOWNS_MAX || self.bytes().iter().sum::<u64>() > self.bytes_max
    }

    /// Where a town is, if it is there.
    pub(crate) fn get(&self, town: &TownScene) -> Option<TownPlace> {
        self.towns.get(town.digest()).copied()
    }

    /// Puts a town on the device.
    ///
    /// # Errors
    /// What the device has no room for.
    pub(crate) fn put(&mut self, gpu: &Gpu, town: &TownScene) -> Result<TownPlace, String> {
        let slot = self.built.get(town);
        let models = built(&slot);
        let corners: usize = models.iter().map(|model| model.corners().len()).sum();
        let wanted = self.corners.used_bytes() + (corners * size_of::<CornerRow>()) as u64;
        if wanted.next_power_of_two() > gpu.binding_bytes_max() {
            let most = gpu.binding_bytes_max();
            return Err(format!("a town takes {wanted} bytes, the device binds {most} at most"));
        }
        let place = TownPlace {
            models: models.each_ref().map(|model| self.push(gpu, model)),
            number: self.towns_so_far,
        };
        self.towns_so_far += 1;
        self.towns.insert(town.digest().to_owned(), place);
        Ok(place)
    }

    fn push(&mut self, gpu: &Gpu, model: &Model) -> ModelPlace {
        let corners: Vec<CornerRow> = model.corners().iter().map(CornerRow::from).collect();
        let triangles: Vec<[u32; 4]> = model
            .triangles()
            .map(|([a, b, c], thing)| [a, b, c, thing.unwrap_or(u32::MAX)])
            .collect();
        let clusters: Vec<ClusterRow> = model.clusters().map(ClusterRow::from).collect();
        ModelPlace {
            corner: self.corners.push(gpu, &corners),
            triangle: self.triangles.push(gpu, &triangles),
            cluster: self.clusters.push(gpu, &clusters),
            clusters: clusters.len() as u32,
        }
    }

    fn bytes(&self) -> [u64; 3] {
        [&self.corners, &self.triangles, &self.clusters].map(Kept::used_bytes)
    }
}
