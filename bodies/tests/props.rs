//! Things in the street have colours.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::collections::BTreeSet;

use bodies::{linear, opaque, place};
use schemas::{ActorId, ActorKind, ActorState, Pose, Vec3};

/// Of CARLA's library, those whose looks no word of a row told.
const NAMES: [&str; 22] = [
    "atm",
    "barbeque",
    "brokentile01",
    "calibrator",
    "clothesline",
    "doghouse",
    "foodcart",
    "fountain",
    "gardenlamp",
    "gnome",
    "haybale",
    "haybalelb",
    "mesh",
    "mobile",
    "motorhelmet",
    "purse",
    "shoppingcart",
    "shoppingtrolley",
    "slide",
    "streetfountain",
    "trampoline",
    "vendingmachine",
];

fn tint(name: &str, colour_rgb: u32) -> [u8; 4] {
    let id = ActorId::new(7).unwrap();
    let at_rest = ActorState::at_rest(id, ActorKind::Prop, 0, Pose::identity());
    let box_half_extent_m = Vec3::repeat(0.5);
    let actor = ActorState { colour_rgb, box_half_extent_m, ..at_rest };
    let placed = place(&actor, &format!("static.prop.{name}"), 0.0, &[]);
    placed.parts[0].instance.tints[0]
}

#[test]
fn a_prop_without_a_colour_of_its_own_is_not_black() {
    let tints: BTreeSet<_> = NAMES.iter().map(|name| tint(name, 0)).collect();
    assert!(!tints.contains(&opaque(linear(0))), "{tints:?}");
    assert!(tints.len() > 3, "{tints:?}");
}

#[test]
fn a_prop_that_no_row_names_keeps_its_own_colour() {
    assert_eq!(tint("purse", 0x33_6699), opaque(linear(0x33_6699)));
}
