//! Shadows of towns, kept for all cameras in one square; bodies throw theirs anew every time.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use raster::{Level, Placed, Quality, ShadowMap, SunView};
use schemas::{Camera, HiddenScenery};

use super::sight::Sight;

/// Bytes of all maps kept, but for the last one used.
const BYTES_MAX: usize = 128 * 1024 * 1024;

/// Maps kept, however small they are.
const MAPS_MAX: usize = 512;

/// What a map of a town's shadows follows from.
#[derive(Clone, PartialEq)]
struct Key {
    /// First, as most maps differ in it.
    view: SunView,
    hidden: HiddenScenery,
    town: String,
}

type Slot = Arc<OnceLock<ShadowMap>>;

/// Maps of towns' shadows, the one used last at the end.
#[derive(Default)]
pub(crate) struct TownShadows(Mutex<Vec<(Key, Slot)>>);

impl TownShadows {
    /// The shadows of a town alone, as the sun sees it.
    pub(crate) fn get(
        &self,
        level: Level,
        (town, hidden): (&str, &HiddenScenery),
        placed: &Placed<'_>,
        view: &SunView,
    ) -> Slot {
        let key = Key { town: town.to_owned(), hidden: hidden.clone(), view: view.clone() };
        let slot = self.slot(key);
        slot.get_or_init(|| {
            let mut map = ShadowMap::empty(view.clone());
            let is_hidden = |thing: u32| hidden.contains(thing);
            let is_hidden: &(dyn Fn(u32) -> bool + Sync) = &is_hidden;
            map.add(level, &[*placed], (!hidden.is_none()).then_some(is_hidden));
            map
        });
        slot
    }

    fn slot(&self, key: Key) -> Slot {
        // Nothing panics while it holds the lock.
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = known.iter().position(|(other, _)| *other == key);
        let entry = match place {
            Some(place) => known.remove(place),
            None => (key, Slot::default()),
        };
        let slot = Arc::clone(&entry.1);
        known.push(entry);
        let bytes = |entry: &(Key, Slot)| entry.1.get().map_or(0, ShadowMap::bytes);
        let mut sum: usize = known.iter().map(bytes).sum();
        while (sum > BYTES_MAX || known.len() > MAPS_MAX) && known.len() > 1 {
            // Another thread may have drawn it since the sum was made.
            sum = sum.saturating_sub(bytes(&known.remove(0)));
        }
        slot
    }
}

/// Maps of pictures that are done, whose memory others use again.
#[derive(Default)]
pub(crate) struct ShadowPool(Mutex<Vec<ShadowMap>>);

/// Maps that wait in the pool.
const POOL_MAX: usize = 8;

impl ShadowPool {
    /// A map for somebody; what is on it he overwrites.
    pub(crate) fn take(&self, view: &SunView) -> ShadowMap {
        let mut pool = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = pool.iter().position(|map| map.view() == view);
        let map = place.map(|place| pool.swap_remove(place)).or_else(|| pool.pop());
        map.unwrap_or_else(|| ShadowMap::empty(view.clone()))
    }

    /// Keeps the map of a strip that is drawn.
    pub(crate) fn take_back(&self, sight: Sight<'_>) {
        let Some(map) = sight.into_shadow() else { return };
        let mut pool = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if pool.len() < POOL_MAX {
            pool.push(map);
        }
    }
}

/// Side of the map of shadows for a camera's pictures.
pub(crate) fn shadow_side_px(camera: &Camera, quality: Quality) -> u32 {
    let side_px = crate::scene::shadow::shadow_side_px(camera.width_px, camera.height_px, true);
    if quality == Quality::Low { side_px / 2 } else { side_px }
}

#[cfg(test)]
mod tests {
    use raster::Model;

    use crate::models::strips::placed_town;

    use super::*;

    /// Goal: as many cameras as one batch has, each in a square of its own, find their maps again.
    #[test]
    fn small_maps_of_256_squares_are_kept() {
        let (shadows, model) = (TownShadows::default(), Model::default());
        let get = |at: u32| {
            let right = [1.0 / 56.0, 0.0, 0.0, at as f32];
            let up = [0.0, 1.0 / 56.0, 0.0, 0.0];
            let view = SunView { right, up, depth: [0.0, 0.0, -0.01, 0.5], side_px: 64 };
            let hidden = HiddenScenery::default();
            shadows.get(Level::new(), ("town", &hidden), &placed_town(&model), &view)
        };
        let first = get(0);
        (1..256).for_each(|at| drop(get(at)));
        assert!(Arc::ptr_eq(&first, &get(0)));
    }
}
