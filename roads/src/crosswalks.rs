//! Pedestrian crossings and stencils, from objects.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::lanes::lateral_point;
use crate::model::{Model, Object, Road};

/// The corners of an object's outline: its origin lies beside the lane offset, and its u axis
/// climbs with the road. So does, in the client library, the way sideways to the origin.
pub(crate) fn corners(
    road: &Road,
    object: &Object,
    outline: &[[f64; 3]],
    z_offset_m: f64,
) -> Vec<Point3<f64>> {
    // The client adds the slope of the lane offset to the heading, as it does for lanes.
    let (offset_m, offset_slope) = road.lane_offset.at(object.s);
    let heading_rad = road.reference(object.s).heading_rad + offset_slope + object.heading_rad;
    let slope_rad = road.elevation.at(object.s).1;
    let lateral_m = offset_m + object.t;
    let climb_m = object.t * slope_rad.sin();
    let origin = lateral_point(road, object.s, lateral_m, z_offset_m + climb_m);
    let world_from_object = Isometry3::from_parts(
        Translation3::from(origin.coords),
        UnitQuaternion::from_euler_angles(0.0, -slope_rad, heading_rad),
    );
    outline.iter().map(|corner| world_from_object * Point3::from(Vector3::from(*corner))).collect()
}

/// The corners of every pedestrian crossing, as the map lists them.
pub(crate) fn list(model: &Model) -> Vec<Vec<Point3<f64>>> {
    let mut crosswalks = Vec::new();
    let mut outline: &[[f64; 3]] = &[];
    for road in &model.roads {
        for object in road.objects.iter().filter(|object| object.is_crosswalk()) {
            if !object.corners.is_empty() {
                outline = &object.corners;
            }
            if !outline.is_empty() {
                crosswalks.push(corners(road, object, outline, 0.0));
            }
        }
    }
    crosswalks
}
