//! Random numbers that are the same everywhere.

use schemas::SplitMix64;

/// What varies houses.
pub(crate) struct Random(SplitMix64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// Uniform between the two.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        // 53 bits are what a double holds exactly.
        let share = (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * share
    }

    /// One of the values.
    pub(crate) fn one_of<T: Copy, const N: usize>(&mut self, values: [T; N]) -> T {
        const { assert!(N > 0, "there must be something to choose from") };
        #[allow(clippy::cast_possible_truncation, reason = "the remainder is less than N")]
        let index = (self.0.next_u64() % N as u64) as usize;
        values[index]
    }
}
