//! How much of a device's memory is used: what one submission may take, and what is kept.

use super::adapter::Gpu;

const MIB: u64 = 1024 * 1024;
/// Bytes of the maps of towns' shadows on a device without memory of its own, and in software.
const TOWN_MAPS_BYTES_SHARED: u64 = 128 * MIB;
const TOWN_MAPS_BYTES_SOFTWARE: u64 = 16 * MIB;

/// Bounds on memory. One picture alone, and one town, are drawn whatever they take. Pictures do not
/// depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Room {
    /// Views of one submission.
    pub(crate) views: usize,
    /// Bytes of all pictures of one submission, as they are read back.
    pub(crate) pictures_bytes: u64,
    /// Bytes of the samples of one submission, and of its maps of bodies' shadows.
    pub(crate) samples_bytes: u64,
    pub(crate) body_maps_bytes: u64,
    /// Bytes of the maps of towns' shadows that are kept.
    pub(crate) town_maps_bytes: u64,
    /// Bytes of models, but for the last town.
    pub(crate) models_bytes: u64,
    /// Blocks of large triangles at first; more when a submission has more.
    pub(crate) large_blocks: u64,
}

impl Room {
    /// On a device with 2 GiB to spare or more.
    pub(crate) const WHOLE: Self = Self {
        views: 4_096,
        pictures_bytes: 64 * MIB,
        samples_bytes: 512 * MIB,
        body_maps_bytes: 512 * MIB,
        town_maps_bytes: 512 * MIB,
        models_bytes: 1_024 * MIB,
        large_blocks: 1 << 18,
    };
    /// No room is smaller. Two of the largest maps of shadows fit.
    pub(crate) const LEAST: Self = Self {
        views: 64,
        pictures_bytes: 4 * MIB,
        samples_bytes: 16 * MIB,
        body_maps_bytes: 16 * MIB,
        town_maps_bytes: 64 * MIB,
        models_bytes: 32 * MIB,
        large_blocks: 1 << 13,
    };

    /// Half of it, but for what is as small as can be; `None` if all of it is.
    pub(crate) fn halved(self) -> Option<Self> {
        let least = Self::LEAST;
        let half = Self {
            views: (self.views / 2).max(least.views),
            pictures_bytes: (self.pictures_bytes / 2).max(least.pictures_bytes),
            samples_bytes: (self.samples_bytes / 2).max(least.samples_bytes),
            body_maps_bytes: (self.body_maps_bytes / 2).max(least.body_maps_bytes),
            town_maps_bytes: (self.town_maps_bytes / 2).max(least.town_maps_bytes),
            models_bytes: (self.models_bytes / 2).max(least.models_bytes),
            large_blocks: (self.large_blocks / 2).max(least.large_blocks),
        };
        (half != self).then_some(half)
    }

    /// As much of it as a device of this kind is asked for and binds.
    pub(crate) fn on(self, gpu: &Gpu) -> Self {
        let most = gpu.binding_bytes_max();
        let maps_bytes = match (gpu.software, gpu.has_own_memory) {
            (true, _) => TOWN_MAPS_BYTES_SOFTWARE,
            (false, false) => TOWN_MAPS_BYTES_SHARED,
            (false, true) => self.town_maps_bytes,
        };
        Self {
            samples_bytes: self.samples_bytes.min(most),
            // Both maps are in one buffer.
            body_maps_bytes: self.body_maps_bytes.min(most / 2),
            town_maps_bytes: self.town_maps_bytes.min(maps_bytes).min(most / 2),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_is_halved_to_its_least_and_no_further() {
        let mut room = Room::WHOLE;
        let mut halvings = 0;
        while let Some(half) = room.halved() {
            assert!(half.samples_bytes <= room.samples_bytes && half.views <= room.views);
            room = half;
            halvings += 1;
        }
        assert_eq!((room, halvings), (Room::LEAST, 6));
    }
}
