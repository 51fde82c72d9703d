//! Hashing of numbers by their bits.

use postcard::ser_flavors::Flavor;
use serde::Serialize;
use xxhash_rust::xxh3::Xxh3Default;

/// Bytes gathered before they are hashed, so that most worlds are one call.
const BUFFER_BYTES: usize = 4 * 1024;

/// Collects a state into one xxh3-64 value.
pub(crate) struct Hasher {
    buffer: Vec<u8>,
    hash: Xxh3Default,
}

impl Hasher {
    pub(crate) fn new() -> Self {
        Self { buffer: Vec::with_capacity(BUFFER_BYTES), hash: Xxh3Default::new() }
    }

    pub(crate) fn integers<const N: usize>(&mut self, values: [u64; N]) {
        for value in values {
            self.buffer.extend_from_slice(&value.to_le_bytes());
        }
        self.flush_if_full();
    }

    /// -0.0 counts as +0.0: they compare equal and behave alike in the physics.
    pub(crate) fn floats(&mut self, values: impl IntoIterator<Item = f32>) {
        // Chains of values are gone through faster from within than by asking for each next one.
        values.into_iter().for_each(|value| {
            self.buffer.extend_from_slice(&(value + 0.0).to_bits().to_le_bytes());
        });
        self.flush_if_full();
    }

    pub(crate) fn real(&mut self, value: f64) {
        self.buffer.extend_from_slice(&(value + 0.0).to_bits().to_le_bytes());
        self.flush_if_full();
    }

    /// Any value, by its serialised bytes.
    pub(crate) fn value(&mut self, value: &impl Serialize) {
        postcard::serialize_with_flavor(value, Appended(&mut self.buffer))
            .expect("a vector takes every byte");
        self.flush_if_full();
    }

    pub(crate) fn finish(mut self) -> u64 {
        self.hash.update(&self.buffer);
        self.hash.digest()
    }

    fn flush_if_full(&mut self) {
        if self.buffer.len() >= BUFFER_BYTES {
            self.hash.update(&self.buffer);
            self.buffer.clear();
        }
    }
}

/// Serialised bytes, behind those that are there.
struct Appended<'a>(&'a mut Vec<u8>);

impl Flavor for Appended<'_> {
    type Output = ();

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.0.extend_from_slice(bytes);
        Ok(())
    }

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.push(byte);
        Ok(())
    }

    fn finalize(self) -> postcard::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(floats: &[f32]) -> u64 {
        let mut hasher = Hasher::new();
        hasher.floats(floats.iter().copied());
        hasher.finish()
    }

    #[test]
    fn both_zeros_are_one_value_and_the_last_bit_counts() {
        assert_eq!(hash(&[-0.0, 1.0]), hash(&[0.0, 1.0]));
        assert_ne!(hash(&[1.0]), hash(&[1.0 + f32::EPSILON]));
    }

    #[test]
    fn the_buffer_size_does_not_show() {
        let many: Vec<f32> = (0..5_000).map(|i| i as f32).collect();
        let bytes: Vec<u8> = many.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(hash(&many), xxhash_rust::xxh3::xxh3_64(&bytes));
    }
}
