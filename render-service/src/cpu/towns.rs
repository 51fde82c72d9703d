//! Towns as models: built once per map, forgotten when too many others came since.

use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use lru::LruCache;
use raster::Model;
use schemas::TagId;

use crate::scene::material::Family;
use crate::scene::town::TownScene;

use super::levels::corner_of;

/// Towns kept as models.
const TOWNS_MAX: usize = 16;
/// Triangles of all of them, but for the last one used.
const TRIANGLES_MAX: usize = 20_000_000;

/// What lies on the ground and throws no shadow that anyone sees, and what stands.
pub(crate) type Models = [Model; 2];

pub(crate) type Slot = Arc<OnceLock<Models>>;

/// Models of towns by digest.
pub(crate) struct TownModels(Mutex<LruCache<String, Slot>>);

impl Default for TownModels {
    fn default() -> Self {
        Self(Mutex::new(LruCache::unbounded()))
    }
}

impl TownModels {
    /// The model of a town, built with the first picture of it.
    pub(crate) fn get(&self, town: &TownScene) -> Slot {
        // Nothing panics while it holds the lock.
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let slot = Arc::clone(known.get_or_insert(town.digest.clone(), Slot::default));
        let triangles = |known: &LruCache<String, Slot>| -> usize {
            known
                .iter()
                .filter_map(|(_, slot)| slot.get())
                .flatten()
                .map(Model::triangle_count)
                .sum()
        };
        while known.len() > 1 && (known.len() > TOWNS_MAX || triangles(&known) > TRIANGLES_MAX) {
            known.pop_lru();
        }
        drop(known);
        slot.get_or_init(|| models_of(town));
        slot
    }
}

fn models_of(town: &TownScene) -> Models {
    [true, false].map(|is_ground| {
        let mut indices: Vec<u32> = Vec::new();
        for tile in &town.tiles {
            let wanted =
                |(family, _): &&(Family, Range<u32>)| (*family == Family::Ground) == is_ground;
            for (_, range) in tile.indices_of.iter().filter(wanted) {
                let range = range.start as usize..range.end as usize;
                indices.extend_from_slice(town.indices.get(range).unwrap_or_default());
            }
        }
        model_of(town, &indices)
    })
}

fn model_of(town: &TownScene, indices: &[u32]) -> Model {
    let (triangles, _) = indices.as_chunks::<3>();
    let mut numbers: Vec<u32> = vec![u32::MAX; town.vertices.len()];
    let mut corners = Vec::new();
    let mut number = |index: u32| -> Option<u32> {
        let slot = numbers.get_mut(index as usize)?;
        if *slot == u32::MAX {
            *slot = corners.len() as u32;
            corners.push(corner_of(town.vertices.get(index as usize)?));
        }
        Some(*slot)
    };
    let mut own = Vec::with_capacity(triangles.len());
    let mut things = Vec::with_capacity(triangles.len());
    for [a, b, c] in triangles {
        if let (Some(a), Some(b), Some(c)) = (number(*a), number(*b), number(*c)) {
            own.push([a, b, c]);
        }
    }
    for [first, ..] in &own {
        things.push(corners.get(*first as usize).and_then(|corner| TagId::place_of(corner.label)));
    }
    Model::new(corners, &own, &things)
}
