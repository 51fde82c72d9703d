//! Solid things beside the roads.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::environment::{self, SemanticLabel};
use crate::lanes::lateral_point;
use crate::map::Map;
use crate::model::{Object, Road};

/// What a scenery box is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum SceneryKind {
    /// A house.
    Building,
    /// A post of a light or a sign.
    Pole,
    /// The trunk of a tree; its crown is only drawn.
    Tree,
    /// A wall, fence or crash barrier.
    Barrier,
    /// Anything else that stands in the way: benches, bins, boxes.
    Prop,
}

/// A solid box that stands on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneryBox {
    /// Middle of the box.
    pub pose: Isometry3<f64>,
    /// Half of its size along its own axes, in metres.
    pub half_extent_m: Vector3<f64>,
    /// What it is.
    pub kind: SceneryKind,
    /// What cameras and lidars see in it.
    pub label: SemanticLabel,
    /// Height of the whole thing above its foot in metres; more than the box for trees.
    pub height_m: f64,
    /// Radius of a tree's crown in metres, 0 for everything else.
    pub crown_radius_m: f64,
}

/// Trunk of a tree: half of its width.
const TRUNK_HALF_M: f64 = 0.2;
/// Share of a tree's height that is bare trunk.
const TRUNK_SHARE: f64 = 0.4;

pub(crate) fn boxes(map: &Map) -> Vec<SceneryBox> {
    map.roads_with_objects()
        .flat_map(|(road, objects)| objects.filter_map(move |object| scenery_box(road, object)))
        .collect()
}

pub(crate) fn kind(object: &Object) -> Option<SceneryKind> {
    match object.object_type.as_str() {
        "building" => Some(SceneryKind::Building),
        "pole" | "streetLamp" => Some(SceneryKind::Pole),
        "tree" | "vegetation" => Some(SceneryKind::Tree),
        "barrier" | "railing" | "soundBarrier" => Some(SceneryKind::Barrier),
        "obstacle" => Some(SceneryKind::Prop),
        _ => None,
    }
}

pub(crate) fn scenery_box(road: &Road, object: &Object) -> Option<SceneryBox> {
    let kind = kind(object)?;
    let (label, _) = environment::of_object(object)?;
    let (length_m, width_m) = if object.radius_m > 0.0 {
        (2.0 * object.radius_m, 2.0 * object.radius_m)
    } else {
        (object.length_m, object.width_m)
    };
    if !(length_m > 0.0 && width_m > 0.0 && object.height_m > 0.0) {
        return None;
    }
    let (half_extent_m, crown_radius_m) = if kind == SceneryKind::Tree {
        let half_height_m = object.height_m * TRUNK_SHARE / 2.0;
        (Vector3::new(TRUNK_HALF_M, TRUNK_HALF_M, half_height_m), length_m / 2.0)
    } else {
        (Vector3::new(length_m, width_m, object.height_m) / 2.0, 0.0)
    };
    let foot = lateral_point(road, object.s, object.t, object.z_offset_m);
    let heading_rad = road.reference(object.s).heading_rad + object.heading_rad;
    let middle = foot + Vector3::z() * half_extent_m.z;
    Some(SceneryBox {
        pose: Isometry3::from_parts(
            Translation3::from(middle.coords),
            UnitQuaternion::from_euler_angles(0.0, 0.0, heading_rad),
        ),
        half_extent_m,
        kind,
        label,
        height_m: object.height_m,
        crown_radius_m,
    })
}
