//! Solid things beside the roads.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use schemas::SemanticTag;
use serde::{Deserialize, Serialize};

use crate::labels::{self, SceneryKind, kind};
use crate::lanes::lateral_point;
use crate::model::{Object, Road};

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
    pub label: SemanticTag,
    /// Height of the whole thing above its foot in metres; more than the box for trees.
    pub height_m: f64,
    /// Radius of a tree's crown in metres, 0 for everything else.
    pub crown_radius_m: f64,
}

/// Trunk of a tree: half of its width.
const TRUNK_HALF_M: f64 = 0.2;
/// Share of a tree's height that is bare trunk.
const TRUNK_SHARE: f64 = 0.4;

/// Those of all roads with their objects.
pub(crate) fn boxes<'m>(
    roads: impl Iterator<Item = (&'m Road, impl Iterator<Item = &'m Object>)>,
) -> Vec<SceneryBox> {
    roads
        .flat_map(|(road, objects)| objects.filter_map(move |object| scenery_box(road, object)))
        .collect()
}

pub(crate) fn scenery_box(road: &Road, object: &Object) -> Option<SceneryBox> {
    let kind = kind(object)?;
    let (label, _) = labels::of_object(object)?;
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
