//! Shadows of towns, kept for all cameras in one square; bodies throw theirs anew every time.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use raster::{Level, Placed, ShadowMap, SunView};
use schemas::HiddenScenery;

use crate::scene::shadow::ShadowView;

/// Bytes of all maps kept, but for the last one used.
const BYTES_MAX: usize = 128 * 1024 * 1024;

/// Maps kept, however small they are.
const MAPS_MAX: usize = 128;

/// What a map of a town's shadows follows from.
#[derive(Clone, PartialEq)]
struct Key {
    town: String,
    hidden: HiddenScenery,
    view: SunView,
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

/// The sun's view as the rasteriser reads it.
pub(crate) fn sun_view(shadow: &ShadowView, side_px: u32) -> SunView {
    let row = |at: usize| {
        let row = shadow.clip_from_world.row(at);
        [row[0], row[1], row[2], row[3]]
    };
    SunView { right: row(0), up: row(1), depth: row(2), side_px }
}
