//! Lists over the whole lane graph.

use crate::error::TooManyWaypoints;
use crate::kinds::LaneType;
use crate::lanes::{LaneEntry, LaneTable, parts};
use crate::limits;
use crate::links::Links;
use crate::model::{Model, Road, Section};
use crate::place::Waypoint;

/// Where the client library takes the first place of a road, in metres.
const FIRST_S: f64 = 2.2e-15;

pub(crate) fn generate_waypoints(
    model: &Model,
    step_m: f64,
) -> Result<Vec<Waypoint>, TooManyWaypoints> {
    let mut places = Vec::new();
    let lengths = model.roads.iter().map(|road| road.length_m);
    let count: f64 = model.roads.iter().map(|road| count_max(road, step_m)).sum();
    if !(step_m > 0.0 && count <= limits::GENERATED_WAYPOINTS_MAX) {
        return Err(TooManyWaypoints { step_m, metres: lengths.sum() });
    }
    for road in &model.roads {
        let (mut s, mut section_index) = (FIRST_S, 0);
        // The client stops as far before the end, which tells where a step ends there.
        while s < road.length_m - FIRST_S {
            let begins =
                |index: usize| road.sections.get(index).is_some_and(|one| one.start_s <= s);
            while begins(section_index + 1) {
                section_index += 1;
            }
            let lanes = road.sections.get(section_index).map_or(&[][..], |s| &s.lanes);
            // Some maps call their centre lanes driving lanes; nobody drives there.
            let driving =
                lanes.iter().filter(|lane| lane.id != 0 && lane.lane_type == LaneType::Driving);
            let section = u32::try_from(section_index).unwrap_or(u32::MAX);
            places.extend(driving.map(|l| Waypoint { road: road.id, section, lane: l.id, s }));
            s += step_m;
        }
    }
    Ok(places)
}

/// No less than the steps along a road and the waypoints generated there together.
fn count_max(road: &Road, step_m: f64) -> f64 {
    let of = |section: &Section| {
        let driving = section.lanes.iter().filter(|lane| lane.lane_type == LaneType::Driving);
        ((section.end_s - section.start_s) / step_m + 1.0) * (driving.count() + 1) as f64
    };
    road.length_m / step_m + road.sections.iter().map(of).sum::<f64>()
}

/// How far inside a lane its start is taken, in metres.
const INSIDE_M: f64 = 2.2e-14;

/// `place_at` finds the place at a road coordinate of a road's lane.
pub(crate) fn topology(
    model: &Model,
    table: &LaneTable,
    links: &Links,
    place_at: impl Fn(u32, i32, f64) -> Option<Waypoint>,
) -> Vec<(Waypoint, Waypoint)> {
    let start = |entry: &LaneEntry| {
        let inward_m = if entry.forward { INSIDE_M } else { -INSIDE_M };
        waypoint(model, entry, entry.entry_s() + inward_m)
    };
    let mut pairs = Vec::new();
    for (index, entry) in (0..).zip(&table.lanes) {
        let is_driving = parts(model, entry)
            .is_some_and(|(_, _, lane)| lane.id != 0 && lane.lane_type == LaneType::Driving);
        let Some(from) = start(entry).filter(|_| is_driving) else { continue };
        let followers = links.listed_next_of(index);
        if followers.is_empty() {
            pairs.extend(place_at(from.road, from.lane, entry.exit_s()).map(|to| (from, to)));
        }
        let entries = followers.iter().filter_map(|to| table.get(*to));
        pairs.extend(entries.filter_map(start).map(|to| (from, to)));
    }
    pairs
}

fn waypoint(model: &Model, entry: &LaneEntry, s: f64) -> Option<Waypoint> {
    let road = model.roads.get(entry.road as usize)?.id;
    Some(Waypoint { road, section: entry.section, lane: entry.lane_id, s })
}

/// Every driving lane of every section: where its traffic enters it and where it leaves it.
pub(crate) fn driving_lanes(model: &Model, table: &LaneTable) -> Vec<(Waypoint, Waypoint)> {
    let driving = table.lanes.iter().filter(|entry| {
        parts(model, entry)
            .is_some_and(|(_, _, lane)| lane.id != 0 && lane.lane_type == LaneType::Driving)
    });
    driving
        .filter_map(|entry| {
            let enters = waypoint(model, entry, entry.entry_s())?;
            Some((enters, waypoint(model, entry, entry.exit_s())?))
        })
        .collect()
}

pub(crate) fn joints(model: &Model, table: &LaneTable, links: &Links) -> Vec<(Waypoint, Waypoint)> {
    let mut joints = Vec::new();
    for (index, from) in (0..).zip(&table.lanes) {
        for to in links.next_of(index).iter().filter_map(|to| table.get(*to)) {
            let end = waypoint(model, from, from.exit_s());
            if let (Some(end), Some(start)) = (end, waypoint(model, to, to.entry_s())) {
                joints.push((end, start));
            }
        }
    }
    joints
}
