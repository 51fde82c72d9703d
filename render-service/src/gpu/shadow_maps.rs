//! Where maps of shadows are in their buffer: in front, those of towns, kept for all views in one
//! square; behind, those of bodies, for one submission.

use std::collections::HashMap;

use schemas::HiddenScenery;

/// What a map of a town's shadows follows from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MapKey {
    /// Number of the town.
    pub(crate) town: u64,
    /// Places of hidden things, as bits.
    pub(crate) hidden: Vec<u8>,
    /// The sun's view, and the side in pixels.
    pub(crate) view: [u32; 13],
}

impl MapKey {
    pub(crate) fn new(town: u64, hidden: &HiddenScenery, view: &raster::SunView) -> Self {
        let mut bits = [view.side_px; 13];
        let rows = view.right.iter().chain(&view.up).chain(&view.depth);
        bits.iter_mut().zip(rows).for_each(|(bits, part)| *bits = part.to_bits());
        Self { town, hidden: hidden.bits().to_vec(), view: bits }
    }
}

/// A map of a town's shadows.
#[derive(Clone, Copy, Debug)]
struct Slot {
    first_px: u32,
    px: u32,
    /// The submission that used it last.
    used: u64,
}

/// Maps of towns, in the first `room_px` pixels of the buffer.
#[derive(Debug)]
pub(crate) struct TownMaps {
    room_px: u32,
    slots: HashMap<MapKey, Slot>,
    submission: u64,
}

impl TownMaps {
    pub(crate) fn new(room_px: u32) -> Self {
        Self { room_px, slots: HashMap::new(), submission: 0 }
    }

    /// Pixels that all maps of towns may take.
    pub(crate) fn room_px(&self) -> u32 {
        self.room_px
    }

    /// How many there were.
    #[cfg(test)]
    pub(crate) fn submission(&self) -> u64 {
        self.submission
    }

    /// From here on, maps that were got before may give way.
    pub(crate) fn begin(&mut self) {
        self.submission += 1;
    }

    /// The first pixel of a map of so many, and whether it has to be drawn; `None` if this
    /// submission's maps fill all the room.
    pub(crate) fn get(&mut self, key: &MapKey, px: u32) -> Option<(u32, bool)> {
        let submission = self.submission;
        if let Some(slot) = self.slots.get_mut(key) {
            slot.used = submission;
            return Some((slot.first_px, false));
        }
        let first_px = loop {
            match self.gap(px) {
                Some(first_px) => break first_px,
                None => self.drop_oldest()?,
            }
        };
        self.slots.insert(key.clone(), Slot { first_px, px, used: submission });
        Some((first_px, true))
    }

    /// The first pixel of a gap that is large enough.
    fn gap(&self, px: u32) -> Option<u32> {
        let mut taken: Vec<(u32, u32)> =
            self.slots.values().map(|slot| (slot.first_px, slot.px)).collect();
        taken.sort_unstable();
        let mut from = 0;
        for (first_px, px_taken) in taken {
            if first_px - from >= px {
                return Some(from);
            }
            from = first_px + px_taken;
        }
        (self.room_px.saturating_sub(from) >= px).then_some(from)
    }

    /// `None` if none is of an older submission.
    fn drop_oldest(&mut self) -> Option<()> {
        let is_older = |(_, slot): &(&MapKey, &Slot)| slot.used < self.submission;
        let oldest = self.slots.iter().filter(is_older);
        let oldest = oldest.min_by_key(|(_, slot)| (slot.used, slot.first_px))?.0.clone();
        self.slots.remove(&oldest);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(town: u64) -> MapKey {
        MapKey { town, hidden: Vec::new(), view: [0; 13] }
    }

    #[test]
    fn maps_are_kept_until_others_need_their_room_and_never_lie_over_each_other() {
        let mut maps = TownMaps::new(100);
        maps.begin();
        assert_eq!(maps.get(&key(1), 40), Some((0, true)));
        assert_eq!(maps.get(&key(2), 40), Some((40, true)));
        assert_eq!(maps.get(&key(1), 40), Some((0, false)));
        assert_eq!(maps.get(&key(3), 40), None, "both are of this submission");
        maps.begin();
        assert_eq!(maps.get(&key(2), 40), Some((40, false)));
        assert_eq!(maps.get(&key(3), 40), Some((0, true)));
        assert_eq!(maps.get(&key(4), 20), Some((80, true)));
        assert_eq!(maps.get(&key(5), 200), None, "more than all the room");
    }
}
