//! What people wear: chosen from the actor's id, so that a person looks the same in every frame.

use schemas::ActorId;

use super::{linear, opaque};

const SHIRTS: [u32; 12] = [
    0xb3322b, 0x2d5fa8, 0xe8e4da, 0x2f2f33, 0xd9a527, 0x3f7d46, 0x6d4a8a, 0xd46a3c, 0x3aa0a8,
    0x8a8f98, 0xc24f7e, 0x7a5a3c,
];
const TROUSERS: [u32; 6] = [0x26324d, 0x2b2b2e, 0x5b5148, 0x8c8170, 0x3d4a3a, 0x4a5a78];
const SKINS: [u32; 5] = [0xf0c8a4, 0xd9a27a, 0xb57a50, 0x8a5636, 0x5c3a26];
const HAIRS: [u32; 6] = [0x1c1713, 0x3b2618, 0x6b4423, 0xa67b3e, 0x8c8a88, 0x7a2f1a];

/// Colours and accessories of one person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clothes {
    /// Skin, hair, shirt, trousers.
    pub(super) tints: [[u8; 4]; 4],
    pub(super) long_hair: bool,
    pub(super) backpack: bool,
}

impl Clothes {
    pub(super) fn of(id: ActorId) -> Self {
        // A few rounds of mixing: neighbouring ids must not look alike.
        let mut mixed = id.get().wrapping_mul(0x9e37_79b1);
        mixed = (mixed ^ (mixed >> 16)).wrapping_mul(0x85eb_ca6b);
        mixed ^= mixed >> 13;
        let mut choose = |count: u32| {
            mixed = mixed.wrapping_mul(0x19660d).wrapping_add(0x3c6e_f35f);
            (mixed >> 16) % count
        };
        let mut colour = |palette: &[u32]| {
            let at = choose(palette.len() as u32) as usize;
            opaque(linear(palette.get(at).copied().unwrap_or_default()))
        };
        let shirt = colour(&SHIRTS);
        let tints = [colour(&SKINS), colour(&HAIRS), shirt, colour(&TROUSERS)];
        Self { tints, long_hair: choose(5) < 2, backpack: choose(4) == 0 }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn people_differ_and_stay_the_same() {
        let person = |id: u32| Clothes::of(ActorId::new(id).unwrap());
        let looks: BTreeSet<_> = (1..=20).map(|id| person(id).tints).collect();
        assert!(looks.len() >= 15, "only {} of 20 people look different", looks.len());
        assert_eq!(person(7), person(7));
    }
}
