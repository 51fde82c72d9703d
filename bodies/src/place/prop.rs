//! Things that people put into a street: a shape by the words of the blueprint, as large as the
//! actor's box.

use schemas::ActorState;

use super::{Placer, box_scale, linear, opaque};
use crate::shape::Shape;

/// Words of a blueprint id, and the shape and the colour that they mean.
type Row = (&'static [&'static str], Shape, u32);

const ROWS: [Row; 10] = [
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
];

pub(super) fn place(placer: &mut Placer, actor: &ActorState, type_id: &str) {
    let name = type_id.rsplit('.').next().unwrap_or_default();
    let row = ROWS.iter().find(|(words, ..)| words.iter().any(|word| name.contains(word)));
    let (shape, rgb) =
        row.map_or((Shape::Block, actor.colour_rgb), |(_, shape, rgb)| (*shape, *rgb));
    placer.put(shape, box_scale(actor), [opaque(linear(rgb)); 4]);
}
