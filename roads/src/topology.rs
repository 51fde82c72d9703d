//! Lists over the whole lane graph.

use crate::kinds::LaneType;
use crate::lanes::{LaneEntry, LaneTable};
use crate::links::Links;
use crate::map::Waypoint;
use crate::model::Model;

/// Smaller steps are taken for a mistake, in metres.
const STEP_MIN_M: f64 = 1e-3;
/// Where the client library takes the first place of a road, in metres.
const FIRST_S: f64 = 2.2e-15;

pub(crate) fn generate_waypoints(model: &Model, step_m: f64) -> Vec<Waypoint> {
    let mut places = Vec::new();
    if step_m.is_nan() || step_m < STEP_MIN_M {
        return places;
    }
    for road in &model.roads {
        let mut s = FIRST_S;
        while s < road.length_m {
            let section_index = road.section_index(s);
            let lanes = road.sections.get(section_index).map_or(&[][..], |s| &s.lanes);
            let driving = lanes.iter().filter(|lane| lane.lane_type == LaneType::Driving);
            let section = u32::try_from(section_index).unwrap_or(u32::MAX);
            places.extend(driving.map(|l| Waypoint { road: road.id, section, lane: l.id, s }));
            s += step_m;
        }
    }
    places
}

pub(crate) fn joints(model: &Model, table: &LaneTable, links: &Links) -> Vec<(Waypoint, Waypoint)> {
    let place = |entry: &LaneEntry, s: f64| {
        let road = model.roads.get(entry.road as usize)?.id;
        Some(Waypoint { road, section: entry.section, lane: entry.lane_id, s })
    };
    let mut joints = Vec::new();
    for (from, followers) in table.lanes.iter().zip(&links.next) {
        for to in followers.iter().filter_map(|to| table.get(*to)) {
            if let (Some(end), Some(start)) = (place(from, from.exit_s()), place(to, to.entry_s()))
            {
                joints.push((end, start));
            }
        }
    }
    joints
}
