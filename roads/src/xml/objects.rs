//! `object` elements.

use super::number::{Numbers, text};
use super::tree::Node;
use super::{child, children};
use crate::model::Object;

pub(super) fn read(road: Node<'_, '_>, numbers: &mut Numbers<'_>) -> Vec<Object> {
    children(road, "objects")
        .flat_map(|parent| children(parent, "object"))
        .map(|node| object(node, numbers))
        .collect()
}

fn object(node: Node<'_, '_>, numbers: &mut Numbers<'_>) -> Object {
    let corners = child(node, "outline")
        .into_iter()
        .flat_map(|outline| children(outline, "cornerLocal"))
        .map(|corner| {
            let [u, v] = ["u", "v"].map(|name| numbers.required(corner, name));
            [u, v, numbers.optional(corner, "z")]
        })
        .collect();
    Object {
        name: text(node, "name").to_owned(),
        object_type: text(node, "type").to_owned(),
        s: numbers.optional(node, "s"),
        t: numbers.optional(node, "t"),
        z_offset_m: numbers.optional(node, "zOffset"),
        heading_rad: numbers.optional(node, "hdg"),
        length_m: numbers.optional(node, "length"),
        width_m: numbers.optional(node, "width"),
        height_m: numbers.optional(node, "height"),
        radius_m: numbers.optional(node, "radius"),
        corners,
    }
}
