//! Where each array lies in the block; version 1.
//!
//! A header of one page, then slots: each has every array once and begins at a page. Arrays begin
//! at multiples of 64 bytes. Numbers are little-endian, as the machine's.

use rollouts::{Autoreset, EPISODE_COLUMNS, Spec};
use serde::Serialize;

/// Size of the header, and alignment of slots.
pub(crate) const PAGE: usize = 4_096;
/// Alignment of arrays: a line of the cache.
const LINE: usize = 64;
/// Of this layout.
pub(crate) const VERSION: u32 = 1;
/// First bytes of a block.
pub(crate) const MAGIC: [u8; 4] = *b"CWRB";
/// Where in the header the fields of 4 bytes lie.
pub(crate) const STATUS_AT: usize = 40;
pub(crate) const MESSAGE_LENGTH_AT: usize = 44;
/// Where in the header the number of the last batch lies, 8 bytes.
pub(crate) const SEQUENCE_AT: usize = 32;
/// Where in the header the message of a refusal begins.
pub(crate) const MESSAGE_AT: usize = 64;

/// Types of numbers in the block, with numpy's names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Dtype {
    Float32,
    Uint8,
    Uint64,
}

impl Dtype {
    fn bytes(self) -> usize {
        match self {
            Self::Float32 => 4,
            Self::Uint8 => 1,
            Self::Uint64 => 8,
        }
    }
}

/// One array of a slot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Array {
    pub name: &'static str,
    pub dtype: Dtype,
    pub shape: Vec<usize>,
    /// From the start of the slot.
    pub offset: usize,
}

impl Array {
    pub(crate) fn count(&self) -> usize {
        self.shape.iter().product()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.count() * self.dtype.bytes()
    }
}

/// Arrays by position in [`Layout::arrays`].
pub(crate) const ACTIONS: usize = 0;
pub(crate) const OBSERVATIONS: usize = 1;
pub(crate) const FINALS: usize = 2;
pub(crate) const REWARDS: usize = 3;
pub(crate) const TERMINATIONS: usize = 4;
pub(crate) const TRUNCATIONS: usize = 5;
pub(crate) const ALIVE: usize = 6;
pub(crate) const EPISODES: usize = 7;
pub(crate) const SEEDS: usize = 8;
pub(crate) const TICKS: usize = 9;
pub(crate) const HASHES: usize = 10;
const COUNT: usize = 11;

/// Where everything lies.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Layout {
    pub version: u32,
    pub slots: usize,
    /// From the start of the block to the first slot.
    pub first_slot: usize,
    pub slot_bytes: usize,
    pub bytes: usize,
    pub arrays: Vec<Array>,
}

impl Layout {
    /// `None` where the block would be larger than numbers can say.
    pub(crate) fn new(spec: &Spec, slots: usize) -> Option<Self> {
        let (rows, worlds, width) = (spec.rows(), spec.worlds, spec.width());
        // Only where the next episode begins in the step that ends the last one.
        let finals = if spec.autoreset == Autoreset::SameStep { rows } else { 0 };
        let wanted: [(&'static str, Dtype, Vec<usize>); COUNT] = [
            ("actions", Dtype::Float32, vec![rows, rollouts::Action::WIDTH]),
            ("observations", Dtype::Float32, vec![rows, width]),
            ("final_observations", Dtype::Float32, vec![finals, width]),
            ("rewards", Dtype::Float32, vec![rows]),
            ("terminations", Dtype::Uint8, vec![rows]),
            ("truncations", Dtype::Uint8, vec![rows]),
            ("alive", Dtype::Uint8, vec![rows]),
            ("episodes", Dtype::Float32, vec![rows, EPISODE_COLUMNS.len()]),
            ("seeds", Dtype::Uint64, vec![worlds]),
            ("ticks", Dtype::Uint64, vec![worlds]),
            ("hashes", Dtype::Uint64, vec![worlds]),
        ];
        let mut end = 0_usize;
        let mut arrays = Vec::with_capacity(COUNT);
        for (name, dtype, shape) in wanted {
            let offset = end.checked_next_multiple_of(LINE)?;
            let array = Array { name, dtype, shape, offset };
            end = offset.checked_add(array.bytes())?;
            arrays.push(array);
        }
        let slot_bytes = end.checked_next_multiple_of(PAGE)?;
        let bytes = slot_bytes.checked_mul(slots)?.checked_add(PAGE)?;
        Some(Self { version: VERSION, slots, first_slot: PAGE, slot_bytes, bytes, arrays })
    }

    /// From the start of the block.
    pub(crate) fn at(&self, slot: usize, array: usize) -> (usize, &Array) {
        let array = &self.arrays[array];
        (self.first_slot + slot * self.slot_bytes + array.offset, array)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_follow_each_other_in_every_slot_without_overlap() {
        let spec = Spec { worlds: 5, agents: 3, autoreset: Autoreset::SameStep, ..Spec::default() };
        let layout = Layout::new(&spec, 3).unwrap();
        let mut end = layout.first_slot;
        for slot in 0..3 {
            assert_eq!(layout.at(slot, ACTIONS).0 % PAGE, 0);
            for index in 0..COUNT {
                let (offset, array) = layout.at(slot, index);
                assert!(offset >= end && offset.is_multiple_of(LINE), "{array:?}");
                end = offset + array.bytes();
            }
        }
        assert!(end <= layout.bytes);
        assert_eq!(layout.arrays[OBSERVATIONS].shape, [15, spec.width()]);
        assert_eq!(layout.arrays[HASHES].name, "hashes");
        let without = Layout::new(&Spec { autoreset: Autoreset::NextStep, ..spec }, 3).unwrap();
        assert_eq!(without.arrays[FINALS].count(), 0);
    }
}
