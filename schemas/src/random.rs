//! Random numbers from a seed: the same seed gives the same numbers in every process and on every
//! machine.

use serde::{Deserialize, Serialize};

/// SplitMix64: eight bytes of state.
///
/// **Source:** Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// The stream of a seed; any number is one.
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// All that decides how the stream goes on.
    pub const fn state(&self) -> u64 {
        self.state
    }

    /// The next 64 bits.
    pub const fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// One of the items; `None` when there are none.
    ///
    /// The bias of the remainder is below 2⁻³² for lists of less than 2³² items.
    pub fn choose<'a, T>(&mut self, items: &'a [T]) -> Option<&'a T> {
        let count = u64::try_from(items.len()).ok().filter(|&count| count > 0)?;
        items.get(usize::try_from(self.next_u64() % count).ok()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_that_of_the_reference_implementation() {
        let mut random = SplitMix64::new(1_234_567);
        assert_eq!(random.next_u64(), 6_457_827_717_110_365_317);
        assert_eq!(random.next_u64(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn the_same_seed_gives_the_same_choice_and_every_item_is_reachable() {
        let items = [1, 2, 3, 4, 5];
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..200 {
            let first = SplitMix64::new(seed).choose(&items).copied();
            assert_eq!(first, SplitMix64::new(seed).choose(&items).copied());
            seen.extend(first);
        }
        assert_eq!(seen.len(), items.len());
        assert_eq!(SplitMix64::new(1).choose::<u8>(&[]), None);
    }
}
