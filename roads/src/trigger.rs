//! Boxes on lanes in which a light or sign counts for a vehicle.

use nalgebra::{Isometry3, Vector3};

use crate::kinds::LaneType;
use crate::landmarks::Landmark;
use crate::lanes::{LaneIndex, lane_pose, parts};
use crate::map::Map;
use crate::place::Waypoint;

/// Half the height of every box, in metres.
const HALF_HEIGHT_M: f64 = 1.0;

/// A box on a lane; a vehicle that touches it is "at" its light or sign.
#[derive(Clone, Debug, PartialEq)]
pub struct TriggerBox {
    /// The lane, and where on it the box has its middle.
    pub middle: Waypoint,
    /// Where traffic leaves the box, or the lane before that: the place to stop at.
    pub front: Waypoint,
    /// Its middle on the ground: x along the direction of travel, y left, z up.
    pub pose: Isometry3<f64>,
    /// Half its size along these axes, in metres.
    pub half_extent_m: Vector3<f64>,
}

/// A place on a lane, before it is made public.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LanePlace {
    pub(crate) lane: LaneIndex,
    pub(crate) s: f64,
}

/// Half the size of a box along and across the lane, in metres, and how far its middle lies back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxSize {
    pub(crate) half_along_m: f64,
    pub(crate) half_across_m: f64,
    pub(crate) back_m: f64,
}

/// The driving lanes that a landmark holds, at its place.
pub(crate) fn driving_lanes(map: &Map, landmark: &Landmark) -> Vec<LanePlace> {
    let Some(road_index) = map.model.road_index(landmark.road) else { return Vec::new() };
    let Some(road) = map.model.roads.get(road_index) else { return Vec::new() };
    let section_index = road.section_index(landmark.s);
    let lanes = road.sections.get(section_index).map_or(&[][..], |section| &section.lanes);
    lanes
        .iter()
        .filter(|lane| lane.id != 0 && lane.lane_type == LaneType::Driving)
        .filter(|lane| landmark.applies_to(lane.id))
        .filter_map(|lane| {
            let lane = map.table.find(road_index, section_index, lane.id)?;
            Some(LanePlace { lane, s: landmark.s })
        })
        .collect()
}

impl TriggerBox {
    /// The box behind a place, `size` made from the lane's width there; its middle stays on the
    /// lane.
    pub(crate) fn behind(
        map: &Map,
        place: LanePlace,
        size: impl FnOnce(f64) -> BoxSize,
    ) -> Option<Self> {
        let entry = map.table.get(place.lane)?;
        let (road, section, lane) = parts(&map.model, entry)?;
        let on_lane = |s: f64| s.min(entry.end_s).max(entry.start_s);
        let size = size(lane.width.value(on_lane(place.s)));
        let ahead = if entry.forward { 1.0 } else { -1.0 };
        let middle_s = on_lane(place.s - ahead * size.back_m);
        let waypoint =
            |s| Waypoint { road: road.id, section: entry.section, lane: entry.lane_id, s };
        Some(Self {
            middle: waypoint(middle_s),
            front: waypoint(on_lane(middle_s + ahead * size.half_along_m)),
            pose: lane_pose(road, section, entry.lane_id, middle_s).isometry(),
            half_extent_m: Vector3::new(size.half_along_m, size.half_across_m, HALF_HEIGHT_M),
        })
    }
}
