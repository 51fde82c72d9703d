//! Things that people put into a street: a shape by the words of the blueprint, as large as the
//! actor's box.

use schemas::ActorState;

use super::{Placer, box_scale, linear, opaque};
use crate::shape::Shape;

/// Words of a blueprint id, and the shape and the colour that they mean.
type Row = (&'static [&'static str], Shape, u32);

const ROWS: [Row; 15] = [
    (&["busstop", "kiosk", "pergola"], Shape::Shelter, 0x56_646e),
    (&["mailbox"], Shape::Block, 0x1c_4fa0),
    (&["cone"], Shape::Cone, 0xff_6a13),
    (&["barrel"], Shape::Barrel, 0xff_6a13),
    (&["barrier", "fence"], Shape::Barricade, 0xd8_3018),
    (&["warning", "streetsign", "advertisement"], Shape::Placard, 0xf0_8a1c),
    (&["bench", "chair", "table", "swing"], Shape::Bench, 0x7a_5232),
    (&["bin", "can", "trash", "garbage", "bottle", "plantpot"], Shape::Barrel, 0x2e_5c38),
    (&["box", "case", "container", "debris", "plank"], Shape::Block, 0xa8_7c4c),
    (&["bag"], Shape::Barrel, 0x24_2428),
    (&["vending"], Shape::Block, 0xa0_2a26),
    (&["haybale"], Shape::Block, 0xc2_a14d),
    (&["atm"], Shape::Block, 0x2b_5a8a),
    (&["fountain", "brokentile", "gnome"], Shape::Block, 0x9a_958c),
    (&["clothesline", "barbeque", "shopping", "lamp"], Shape::Block, 0x70_7579),
];

/// Of props that no row names and that have no colour of their own.
const OTHER_RGB: u32 = 0x8c_7a66;

pub(super) fn place(placer: &mut Placer, actor: &ActorState, type_id: &str) {
    let name = type_id.rsplit('.').next().unwrap_or_default();
    let row = ROWS.iter().find(|(words, ..)| words.iter().any(|word| name.contains(word)));
    let own_rgb = if actor.colour_rgb == 0 { OTHER_RGB } else { actor.colour_rgb };
    let (shape, rgb) = row.map_or((Shape::Block, own_rgb), |(_, shape, rgb)| (*shape, *rgb));
    placer.put(shape, box_scale(actor), [opaque(linear(rgb)); 4]);
}
