//! Towns as models: built once per map, forgotten when too many others came since.

use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use lru::LruCache;
use raster::{Corner, Model, ThingLevel};
use schemas::TagId;

use crate::scene::foliage::{Crown, CrownLevel};
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

/// The models of a town that was got.
pub(crate) fn built(town: &Slot) -> &Models {
    town.get().expect("a town that was got is built")
}

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
            for (_, range) in tile.iter().filter(wanted) {
                let range = range.start as usize..range.end as usize;
                indices.extend_from_slice(town.indices.get(range).unwrap_or_default());
            }
        }
        model_of(town, &indices, if is_ground { &[] } else { &town.crowns })
    })
}

fn model_of(town: &TownScene, indices: &[u32], crowns: &[Crown]) -> Model {
    let mut corners = Corners { town, numbers: vec![u32::MAX; town.vertices.len()], own: vec![] };
    let (triangles, _) = indices.as_chunks::<3>();
    let mut own = Vec::with_capacity(triangles.len());
    let mut things = Vec::with_capacity(triangles.len());
    for triangle in triangles {
        let [Some(a), Some(b), Some(c)] = triangle.map(|index| corners.number(index)) else {
            continue;
        };
        let first = corners.own.get(a as usize).copied().unwrap_or_default();
        own.push([a, b, c]);
        things.push(TagId::place_of(first.label));
    }
    let crowns: Vec<(Vec<ThingLevel>, Option<u32>)> = crowns
        .iter()
        .map(|crown| {
            let levels = crown.levels().into_iter().map(|level| corners.crown(level));
            (levels.collect(), TagId::place_of(crown.label))
        })
        .collect();
    let mut model = Model::new(corners.own, &own, &things);
    crowns.iter().for_each(|(levels, thing)| model.add(levels, *thing));
    model
}

/// Corners of a model as they are needed.
struct Corners<'a> {
    town: &'a TownScene,
    /// Of the town's vertices in the model.
    numbers: Vec<u32>,
    own: Vec<Corner>,
}

impl Corners<'_> {
    /// The number of one of the town's vertices.
    fn number(&mut self, index: u32) -> Option<u32> {
        let slot = self.numbers.get_mut(index as usize)?;
        if *slot == u32::MAX {
            *slot = self.own.len() as u32;
            self.own.push(corner_of(self.town.vertices.get(index as usize)?));
        }
        Some(*slot)
    }

    fn crown(&mut self, CrownLevel { corners, triangles, error_m }: CrownLevel) -> ThingLevel {
        let first = self.own.len() as u32;
        self.own.extend(corners.iter().map(corner_of));
        let triangles = triangles.iter().map(|corners| corners.map(|at| first + at));
        ThingLevel { triangles: triangles.collect(), error_m }
    }
}
