//! Ways through a junction that cross the one on which a sign stands.

use nalgebra::Point3;

use super::STOP_SHARE;
use crate::kinds::LaneType;
use crate::landmarks::Landmark;
use crate::lanes::{LaneEntry, LaneIndex};
use crate::limits::{CROSSING_BOXES_MAX, CROSSING_TRIES_MAX};
use crate::map::Map;
use crate::place::Waypoint;
use crate::trigger::{BoxSize, LanePlace, TriggerBox, driving_lanes};

/// Ways whose middles come nearer than this cross, in metres.
const CROSSING_M: f64 = 1.0;
/// Distance of the places at which ways are compared, in metres.
const STEP_M: f64 = 0.5;
/// How far before the junction vehicles count as well, in metres.
const BEFORE_M: f64 = 10.0;

/// How much more may be looked for on a map.
#[derive(Debug)]
pub(super) struct Budget {
    tries: usize,
    boxes: usize,
}

impl Budget {
    pub(super) const fn of_map() -> Self {
        Self { tries: CROSSING_TRIES_MAX, boxes: CROSSING_BOXES_MAX }
    }
}

/// Boxes on all ways that cross those of a landmark, and on the lanes before them; none where the
/// landmark is not on a way through a junction. Ways that begin on the same road do not count, and
/// none does once the budget is spent.
///
/// **Source:** CARLA's server, which looks there who comes.
pub(super) fn boxes(map: &Map, landmark: &Landmark, left: &mut Budget) -> Vec<TriggerBox> {
    let Some(junction) = map.model.road(landmark.road).and_then(|road| road.junction) else {
        return Vec::new();
    };
    let junction = u32::try_from(junction).ok().and_then(|id| map.model.junction(id));
    let Some(junction) = junction else { return Vec::new() };
    let own: Vec<LaneIndex> =
        driving_lanes(map, landmark).into_iter().map(|place| place.lane).collect();
    let from: Vec<u32> = own.iter().flat_map(|lane| roads_before(map, *lane)).collect();
    let places: Vec<Point3<f64>> = own.iter().flat_map(|lane| middles(map, *lane)).collect();
    let mut boxes = Vec::new();
    for road in junction.connecting_roads.iter().filter(|road| **road != landmark.road) {
        let lanes = map.model.road_index(*road).map_or(0..0, |index| map.table.lanes_of(index));
        for lane in lanes.filter(|lane| is_driving(map, *lane)) {
            let tries = (map.table.get(lane).map_or(0.0, LaneEntry::length_m) / STEP_M) as usize;
            let Some(tries) = left.tries.checked_sub((tries + 2) * (places.len() + 1)) else {
                return boxes;
            };
            left.tries = tries;
            let begins_there = roads_before(map, lane).any(|road| from.contains(&road));
            if !begins_there && crosses(map, lane, &places) {
                let count = boxes.len();
                cover(map, lane, &mut boxes);
                left.boxes = left.boxes.saturating_sub(boxes.len() - count);
            }
            if left.boxes == 0 {
                return boxes;
            }
        }
    }
    boxes
}

fn is_driving(map: &Map, lane: LaneIndex) -> bool {
    let Some(entry) = map.table.get(lane) else { return false };
    let place = map.waypoint_on(lane, entry.start_s);
    place.is_some_and(|place| map.lane(&place).lane_type == LaneType::Driving)
}

fn roads_before(map: &Map, lane: LaneIndex) -> impl Iterator<Item = u32> {
    map.links.previous_of(lane).iter().filter_map(|lane| Some(map.table.get(*lane)?.road_id))
}

/// Road coordinates along a lane, both ends included.
fn along(entry: &LaneEntry, step_m: f64) -> impl Iterator<Item = f64> {
    let (start_s, length_m) = (entry.start_s, entry.length_m());
    let count = (length_m / step_m).ceil().max(1.0);
    let steps = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
    steps.take_while(move |k| *k <= count).map(move |k| start_s + length_m * k / count)
}

fn middles(map: &Map, lane: LaneIndex) -> Vec<Point3<f64>> {
    let Some(entry) = map.table.get(lane) else { return Vec::new() };
    let middle = |s| Some(map.lane_pose(&map.waypoint_on(lane, s)?)?.point);
    along(entry, STEP_M).filter_map(middle).collect()
}

fn crosses(map: &Map, lane: LaneIndex, places: &[Point3<f64>]) -> bool {
    let near = |a: &Point3<f64>, b: &Point3<f64>| (a - b).norm_squared() < CROSSING_M * CROSSING_M;
    middles(map, lane).iter().any(|own| places.iter().any(|place| near(own, place)))
}

/// Adds boxes all along a lane, and along the lanes before it.
fn cover(map: &Map, lane: LaneIndex, boxes: &mut Vec<TriggerBox>) {
    let Some(entry) = map.table.get(lane) else { return };
    let Some(entry_place) = map.waypoint_on(lane, entry.entry_s()) else { return };
    let half_m = (STOP_SHARE * map.lane(&entry_place).width_m).max(STEP_M);
    let size = |_| BoxSize { half_along_m: half_m, half_across_m: half_m, back_m: 0.0 };
    let on = |lane, s| TriggerBox::behind(map, LanePlace { lane, s }, size);
    boxes.extend(along(entry, 2.0 * half_m).filter_map(|s| on(lane, s)));
    let steps = std::iter::successors(Some(2.0 * half_m), |back_m| Some(back_m + 2.0 * half_m));
    for back_m in steps.take_while(|back_m| *back_m <= BEFORE_M) {
        let before: Vec<Waypoint> = map.previous(&entry_place, back_m);
        let lanes = before.iter().filter_map(|place| Some((map.lane_index(place)?, place.s)));
        boxes.extend(lanes.filter_map(|(lane, s)| on(lane, s)));
    }
}
