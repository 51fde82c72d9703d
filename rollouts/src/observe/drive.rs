//! What `route` holds, then the light ahead on the way, and the nearest others.

use schemas::TrafficLightColour as Colour;

use super::{Column, View, route};
use crate::scene::Neighbour;

/// Others that are shown, and within which distance of the vehicle's middle.
pub(super) const PARTNERS: usize = 16;
const WITHIN_M: f32 = 60.0;
/// Columns of one of them.
pub(super) const PARTNER: usize = 10;
/// Columns of the light.
const LIGHT: usize = 4;
/// A light farther ahead along the way is not seen.
const LIGHT_M: f32 = 60.0;

pub(super) const BLOCKS: [(&str, usize, usize); 5] = [
    route::BLOCKS[0],
    route::BLOCKS[1],
    route::BLOCKS[2],
    ("light", 1, LIGHT),
    ("partners", PARTNERS, PARTNER),
];

pub(super) fn columns() -> Vec<Column> {
    let mut columns = route::columns();
    columns.push(Column::new("light.distance", "m", (0.0, LIGHT_M), 1.0 / 50.0));
    for colour in ["red", "yellow", "green"] {
        columns.push(Column::new(format!("light.{colour}"), "", (0.0, 1.0), 1.0));
    }
    for index in 0..PARTNERS {
        let new = |name: &str, unit, most: f32, scale| {
            Column::new(format!("partners.{index}.{name}"), unit, (-most, most), scale)
        };
        let plain = |name: &str, unit, most: f32, scale| {
            Column::new(format!("partners.{index}.{name}"), unit, (0.0, most), scale)
        };
        columns.extend([
            plain("is_vehicle", "", 1.0, 1.0),
            plain("is_walker", "", 1.0, 1.0),
            new("x", "m", 100.0, 1.0 / 50.0),
            new("y", "m", 100.0, 1.0 / 20.0),
            new("speed.x", "m/s", 150.0, 1.0 / 15.0),
            new("speed.y", "m/s", 150.0, 1.0 / 15.0),
            new("heading.cos", "", 1.0, 1.0),
            new("heading.sin", "", 1.0, 1.0),
            plain("length", "m", 20.0, 1.0 / 10.0),
            plain("width", "m", 5.0, 1.0 / 5.0),
        ]);
    }
    columns
}

/// Writes values in the columns' units; places without anybody are zero.
pub(super) fn encode(view: &View<'_>, row: &mut [f32]) {
    let (own, rest) = row.split_at_mut(route::WIDTH);
    route::encode(view, own);
    let (light, partners) = rest.split_at_mut(LIGHT);
    let ahead = view.light.map(|light| (light.at_m - view.place.at_m, light.colour));
    let (distance_m, colour) = ahead
        .filter(|(distance_m, _)| *distance_m <= LIGHT_M)
        .unwrap_or((LIGHT_M, Colour::Unknown));
    light[0] = distance_m;
    for (value, shown) in light[1..].iter_mut().zip([Colour::Red, Colour::Yellow, Colour::Green]) {
        *value = f32::from(u8::from(colour == shown));
    }
    partners.fill(0.0);
    // Nearest first; as many as there are places are kept in order.
    let mut nearest = [(f32::INFINITY, 0_usize); PARTNERS];
    let mut count = 0;
    view.around(WITHIN_M, |away, index| {
        let at = nearest[..count].partition_point(|(nearer, _)| *nearer <= away);
        if at < PARTNERS {
            count = (count + 1).min(PARTNERS);
            nearest[at..count].rotate_right(1);
            nearest[at] = (away, index);
        }
    });
    for (place, (_, index)) in partners.chunks_exact_mut(PARTNER).zip(&nearest[..count]) {
        place.copy_from_slice(&partner(view, &view.scene.everybody[*index]));
    }
}

/// Velocities are relative to the ground.
fn partner(view: &View<'_>, other: &Neighbour) -> [f32; PARTNER] {
    let (x_m, y_m) = view.seen(other.x_m, other.y_m);
    let (x_mps, y_mps) = view.turned(other.x_mps, other.y_mps);
    let (cos, sin) = view.turned(other.cos, other.sin);
    let number = |holds: bool| f32::from(u8::from(holds));
    let kinds = [number(!other.is_walker), number(other.is_walker)];
    let [is_vehicle, is_walker] = kinds;
    let (length_m, width_m) = (other.length_m, other.width_m);
    [is_vehicle, is_walker, x_m, y_m, x_mps, y_mps, cos, sin, length_m, width_m]
}
