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
    is_spent: bool,
}

impl Budget {
    pub(super) const fn of_map() -> Self {
        Self { tries: CROSSING_TRIES_MAX, boxes: CROSSING_BOXES_MAX, is_spent: false }
    }

    /// Whether it has ended a search.
    pub(super) const fn is_spent(&self) -> bool {
        self.is_spent
    }

    /// Takes so many tries; whether they were left, and anything of all else.
    fn spend(&mut self, tries: usize) -> bool {
        let left = self.tries.checked_sub(tries).filter(|_| self.boxes > 0);
        self.is_spent |= left.is_none();
        self.tries = left.unwrap_or(0);
        left.is_some()
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
            if !left.spend((tries + 2) * (places.len() + 1)) {
                return boxes;
            }
            let begins_there = roads_before(map, lane).any(|road| from.contains(&road));
            if !begins_there && crosses(map, lane, &places) {
                let count = boxes.len();
                cover(map, lane, &mut boxes);
                left.boxes = left.boxes.saturating_sub(boxes.len() - count);
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

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    /// Ways of 20 m that all cross in the middle of one junction, each with a stop sign and from a
    /// road of its own.
    fn fan(ways: u32) -> Map {
        let road = |id: u32, junction: i32, start_m: f64, heading_rad: f64, more: &str| {
            let (sin, cos) = heading_rad.sin_cos();
            let (x, y) = (start_m * cos, start_m * sin);
            format!(
                "<road id=\"{id}\" length=\"20\" junction=\"{junction}\"><planView><geometry \
                 s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{heading_rad}\" length=\"20\"><line/></geometry>\
                 </planView><lanes><laneOffset s=\"0\" a=\"1.75\" b=\"0\" c=\"0\" d=\"0\"/>\
                 <laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center><right>\
                 <lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" \
                 d=\"0\"/></lane></right></laneSection></lanes>{more}</road>"
            )
        };
        let (mut text, mut connections) = ("<OpenDRIVE><header/>".to_owned(), String::new());
        for way in 1..=ways {
            let heading_rad = std::f64::consts::PI * f64::from(way) / f64::from(ways);
            let sign = format!(
                "<signals><signal id=\"{way}\" s=\"1\" t=\"-3\" orientation=\"-\" type=\"206\"/>\
                 </signals>"
            );
            text += &road(way, 9, -10.0, heading_rad, &sign);
            text += &road(ways + way, -1, -30.0, heading_rad, "");
            write!(
                connections,
                "<connection id=\"{way}\" incomingRoad=\"{}\" connectingRoad=\"{way}\" \
                 contactPoint=\"start\"/>",
                ways + way
            )
            .unwrap();
        }
        text += &format!("<junction id=\"9\">{connections}</junction></OpenDRIVE>");
        Map::parse("fan", &text).unwrap_or_else(|error| panic!("{error}"))
    }

    /// How many boxes each sign has on ways that cross its own.
    fn counts(map: &Map, left: &mut Budget) -> Vec<usize> {
        let signs = map.traffic_signs_within(left);
        assert!(signs.iter().all(|sign| sign.boxes.len() == 1), "where they count is known anyway");
        signs.iter().map(|sign| sign.crossing.len()).collect()
    }

    fn budget(tries: usize, boxes: usize) -> Budget {
        Budget { tries, boxes, is_spent: false }
    }

    #[test]
    fn a_sign_has_boxes_on_all_ways_that_cross_its_own() {
        let mut left = Budget::of_map();
        let found = counts(&fan(3), &mut left);
        assert!(!left.is_spent());
        assert!(found.len() == 3 && found.iter().all(|count| *count >= 2 * 6), "{found:?}");
    }

    #[test]
    fn without_tries_or_boxes_the_first_signs_are_whole_and_the_last_have_none() {
        let map = fan(3);
        let whole = counts(&map, &mut Budget::of_map());
        let mut used = Budget::of_map();
        counts(&map, &mut used);
        let tries = CROSSING_TRIES_MAX - used.tries;
        for (tries, boxes) in [(tries / 3, usize::MAX), (usize::MAX, whole[0])] {
            let mut left = budget(tries, boxes);
            let found = counts(&map, &mut left);
            assert!(left.is_spent());
            assert_eq!(found, [whole[0], 0, 0], "{tries} tries, {boxes} boxes");
        }
        let mut exact = budget(tries, usize::MAX);
        assert_eq!(counts(&map, &mut exact), whole);
        assert!(!exact.is_spent() && exact.tries == 0);
    }

    /// The search would look at 300 × 300 ways, and give over half a million boxes.
    #[test]
    fn a_hostile_junction_ends_the_search_within_its_budget_which_is_known() {
        let map = fan(300);
        let mut left = Budget::of_map();
        let found = counts(&map, &mut left);
        let most = found.iter().max().unwrap();
        assert!(left.is_spent() && found[0] == *most && *found.last().unwrap() == 0);
        let all: usize = found.iter().sum();
        assert!((CROSSING_BOXES_MAX / 2..CROSSING_BOXES_MAX + most).contains(&all), "{all}");
        assert!(!map.has_all_crossings() && fan(3).has_all_crossings());
    }
}
