//! Junctions whose connecting roads lie above each other.
//!
//! A map gives each way through a junction heights of its own. Where two of them cover one place
//! and differ, a wheel on the lower one meets the edge of the other as a step. CARLA smooths the
//! heights of junctions as well. What clients read of lanes stays as the map has it.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::geometry::Cubic;
use crate::kinds::LaneType;
use crate::lanes::lateral;
use crate::level::Level;
use crate::limits::{LEVEL_PLACES_MAX, LEVEL_TRIES_MAX};
use crate::model::{Model, Road};

/// Way between places whose heights count, in metres.
const STEP_M: f64 = 2.0;
/// Junctions whose roads differ less from a common height stay as they are, in metres.
const UNEVEN_M: f64 = 0.1;

/// A place on a road.
struct Place {
    s: f64,
    point_m: [f64; 3],
}

/// Gives the roads of each uneven junction a common height.
pub(crate) fn level(model: &mut Model) {
    let mut junctions: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    for (index, road) in model.roads.iter().enumerate() {
        if let Some(junction) = road.junction {
            junctions.entry(junction).or_default().push(index);
        }
    }
    let (mut places_left, mut tries_left) = (LEVEL_PLACES_MAX, LEVEL_TRIES_MAX);
    for roads in junctions.values() {
        let of = |index: &usize| model.roads.get(*index).map(places_max);
        let count: f64 = roads.iter().filter_map(of).sum();
        if count > places_left {
            continue;
        }
        let Some(level) = common(model, roads, &mut tries_left) else { continue };
        places_left -= count;
        let level = Arc::new(level);
        for index in roads {
            if let Some(road) = model.roads.get_mut(*index) {
                road.level = Some(Arc::clone(&level));
            }
        }
    }
}

/// The height that the roads of a junction are to have in common; `None` where they differ little,
/// or where it would take too long to find it.
fn common(model: &Model, roads: &[usize], tries_left: &mut usize) -> Option<Level> {
    let roads = || roads.iter().filter_map(|index| model.roads.get(*index));
    if is_flat(roads()) {
        return None;
    }
    let places: Vec<(&Road, Vec<Place>)> = roads().map(|road| (road, places(road))).collect();
    let all = places.iter().flat_map(|(_, places)| places);
    let level = Level::new(all.map(|place| place.point_m));
    *tries_left = tries_left.checked_sub(level.tries())?;
    let is_uneven = |(road, places): &(&Road, Vec<Place>)| {
        places.iter().any(|place| {
            let [x, y, own_m] = place.point_m;
            let share = road.shared_height(place.s);
            share * (level.height_m([x, y], own_m) - own_m).abs() > UNEVEN_M
        })
    };
    places.iter().any(is_uneven).then_some(level)
}

/// Whether the roads have no slope and one height.
fn is_flat<'m>(mut roads: impl Iterator<Item = &'m Road>) -> bool {
    let Some(first) = roads.next() else { return true };
    let height_m = first.elevation.value(0.0);
    let level = |record: &Cubic| [record.b, record.c, record.d] == [0.0; 3] && record.a == height_m;
    std::iter::once(first).chain(roads).all(|road| road.elevation.0.iter().all(level))
}

/// No fewer than its places.
fn places_max(road: &Road) -> f64 {
    let lanes = road.sections.iter().map(|section| {
        let along = (section.end_s - section.start_s) / STEP_M + 2.0;
        3.0 * along * section.lanes.len() as f64
    });
    lanes.sum()
}

/// Both edges and the middle of all lanes that a wheel may roll on.
fn places(road: &Road) -> Vec<Place> {
    let mut places = Vec::new();
    for section in &road.sections {
        let length_m = section.end_s - section.start_s;
        let steps = (length_m / STEP_M).ceil().max(1.0);
        let shares = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
        for s in shares.take_while(|k| *k <= steps).map(|k| section.start_s + length_m * k / steps)
        {
            let reference = road.reference(s);
            let (sin, cos) = reference.heading_rad.sin_cos();
            let z = road.elevation.value(s);
            for lane in &section.lanes {
                if matches!(lane.lane_type, LaneType::None | LaneType::Sidewalk) {
                    continue;
                }
                let at = lateral(road, section, lane.id, s);
                places.extend([at.inner, at.middle, at.outer].map(|t| Place {
                    s,
                    point_m: [reference.x - t * sin, reference.y + t * cos, z],
                }));
            }
        }
    }
    places
}
