//! What of a town is switched off.

use serde::{Deserialize, Serialize};

/// Things of the map that are not there for bodies, rays and cameras.
///
/// Only things with a place in the map's scenery can be hidden (houses, trees, lamps, walls,
/// props), and the posts of lights and signs, whose places come after those. Roads, sidewalks and
/// crossings always stay.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HiddenScenery {
    /// CARLA's `MapLayer` flags of the layers that are not loaded.
    pub layers: u16,
    /// One bit for each place of the scenery, the lowest bit of a byte first; set: hidden. The last
    /// byte is not 0, so that equal sets have equal bytes.
    bits: Vec<u8>,
}

impl HiddenScenery {
    /// From the flags of unloaded layers and [`bits`](Self::bits) of any length.
    pub fn new(layers: u16, mut bits: Vec<u8>) -> Self {
        trim(&mut bits);
        Self { layers, bits }
    }

    /// Whether everything is there.
    pub fn is_none(&self) -> bool {
        self.bits.is_empty()
    }

    /// Whether the thing at a place of the scenery is hidden.
    pub fn contains(&self, place: u32) -> bool {
        self.bits.get(place as usize / 8).is_some_and(|byte| byte >> (place % 8) & 1 == 1)
    }

    /// Hides the thing at a place of the scenery, or shows it.
    pub fn set(&mut self, place: u32, hidden: bool) {
        let (at, bit) = (place as usize / 8, 1u8 << (place % 8));
        if hidden && at >= self.bits.len() {
            self.bits.resize(at + 1, 0);
        }
        let Some(byte) = self.bits.get_mut(at) else { return };
        if hidden {
            *byte |= bit;
        } else {
            *byte &= !bit;
            trim(&mut self.bits);
        }
    }

    /// One bit for each place of the scenery, the lowest bit of a byte first; set: hidden.
    pub fn bits(&self) -> &[u8] {
        &self.bits
    }

    /// Places from here on are all shown.
    pub fn places_end(&self) -> usize {
        self.bits.last().map_or(0, |last| self.bits.len() * 8 - last.leading_zeros() as usize)
    }
}

fn trim(bits: &mut Vec<u8>) {
    let len = bits.iter().rposition(|byte| *byte != 0).map_or(0, |last| last + 1);
    bits.truncate(len);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hidden_and_shown_again_leaves_no_trace() {
        let mut hidden = HiddenScenery::default();
        for place in [3, 64, 17] {
            hidden.set(place, true);
        }
        assert!(hidden.contains(64) && hidden.contains(3) && !hidden.contains(4));
        assert!(!hidden.contains(1_000_000));
        assert_eq!(hidden.places_end(), 65);
        hidden.set(64, false);
        assert_eq!(hidden.places_end(), 18);
        assert_eq!(hidden, HiddenScenery::new(0, vec![8, 0, 2, 0, 0]));
        hidden.set(17, false);
        hidden.set(3, false);
        hidden.set(99, false);
        assert!(hidden.is_none());
        assert_eq!(hidden, HiddenScenery::default());
    }
}
