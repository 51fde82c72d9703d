//! Traffic lights: what they hold, where vehicles wait, and which of them take turns.

use std::collections::BTreeMap;

use crate::landmarks::Landmark;
use crate::map::Map;
use crate::place::Waypoint;
use crate::signals::{SignalPose, is_traffic_light};
use crate::signs::{landmarks_by_signal, signals_in_order};
use crate::trigger::{BoxSize, LanePlace, TriggerBox, driving_lanes};

mod groups;

/// Half the length of a light's boxes, in metres.
const HALF_ALONG_M: f64 = 1.5;
/// How far the middle of a light's box lies before the junction, in metres.
const BACK_M: f64 = 3.0;
/// Half the width of a light's boxes, in lane widths.
const ACROSS_SHARE: f64 = 0.25;

/// All traffic lights of a map and their order of turns. Lights, controllers and groups name each
/// other by position.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrafficLights {
    /// In the order of the file.
    pub lights: Vec<TrafficLight>,
    /// In the order of the file, then those of lights without one.
    pub controllers: Vec<LightController>,
    /// By junction, then those outside junctions.
    pub groups: Vec<LightGroup>,
}

/// One traffic light.
#[derive(Clone, Debug, PartialEq)]
pub struct TrafficLight {
    /// OpenDRIVE id of the signal.
    pub id: String,
    /// Where it stands; the heading is that of the traffic it addresses.
    pub pose: SignalPose,
    /// Position of its controller.
    pub controller: usize,
    /// The driving lanes it holds, where the map says so: often inside the junction.
    pub lanes: Vec<Waypoint>,
    /// One on every lane that leads to those, where vehicles wait for it.
    pub boxes: Vec<TriggerBox>,
}

/// Lights that always show the same.
#[derive(Clone, Debug, PartialEq)]
pub struct LightController {
    /// Its OpenDRIVE id; `None` for a light that no controller lists.
    pub id: Option<String>,
    /// Position of its group.
    pub group: usize,
    /// Positions of its lights.
    pub lights: Vec<usize>,
}

/// Controllers that take turns.
#[derive(Clone, Debug, PartialEq)]
pub struct LightGroup {
    /// The junction they rule; `None` outside of junctions.
    pub junction: Option<u32>,
    /// Positions of the controllers, in the order of their turns.
    pub controllers: Vec<usize>,
}

impl Map {
    /// The traffic lights that a controller lists or that stand at roads outside of junctions.
    ///
    /// **Cost:** linear in the signals of the map. **Source:** how CARLA's server makes lights from
    /// a map. A light in several controllers belongs to the first of them.
    #[must_use]
    pub fn traffic_lights(&self) -> TrafficLights {
        let landmarks = landmarks_by_signal(self);
        let listed = first_controllers(self);
        let is_light = |id: &str, signal: &crate::signals::Signal| {
            let outside = || self.model.road(signal.road).is_some_and(|r| r.junction.is_none());
            is_traffic_light(&signal.signal_type) && (listed.contains_key(id) || outside())
        };
        let lights: Vec<TrafficLight> = signals_in_order(self)
            .filter(|(id, signal)| is_light(id, signal))
            .filter_map(|(id, _)| {
                let places = landmarks.get(id).map_or(&[][..], Vec::as_slice);
                Some(light(self, id, *self.landmarks.poses.get(id)?, places))
            })
            .collect();
        groups::arrange(self, lights, &listed, &landmarks)
    }
}

/// Position in the file of the first controller that lists each signal.
fn first_controllers(map: &Map) -> BTreeMap<&str, usize> {
    let mut first = BTreeMap::new();
    for (position, controller) in map.model.signals.controllers.iter().enumerate() {
        for signal in &controller.signals {
            first.entry(signal.as_str()).or_insert(position);
        }
    }
    first
}

/// A light whose controller is not known yet.
fn light(map: &Map, id: &str, pose: SignalPose, landmarks: &[&Landmark]) -> TrafficLight {
    let mut lanes = Vec::new();
    let mut boxes: Vec<TriggerBox> = Vec::new();
    for held in landmarks.iter().flat_map(|landmark| driving_lanes(map, landmark)) {
        lanes.extend(waypoint(map, held));
        let size = |width_m: f64| BoxSize {
            half_along_m: HALF_ALONG_M,
            half_across_m: ACROSS_SHARE * width_m,
            back_m: BACK_M,
        };
        // Several ways through a junction begin at one lane, which needs one box.
        let waiting = TriggerBox::behind(map, before_junction(map, held), size);
        boxes.extend(waiting.filter(|new| boxes.iter().all(|old| old.middle != new.middle)));
    }
    TrafficLight { id: id.to_owned(), pose, controller: 0, lanes, boxes }
}

fn waypoint(map: &Map, place: LanePlace) -> Option<Waypoint> {
    let entry = map.table.get(place.lane)?;
    let road = map.model.roads.get(entry.road as usize)?.id;
    Some(Waypoint { road, section: entry.section, lane: entry.lane_id, s: place.s })
}

/// The end of the one lane outside junctions that leads to a lane inside; else the place itself.
fn before_junction(map: &Map, held: LanePlace) -> LanePlace {
    let in_junction = |lane| {
        let entry = map.table.get(lane)?;
        Some(map.model.roads.get(entry.road as usize)?.junction.is_some())
    };
    if in_junction(held.lane) != Some(true) {
        return held;
    }
    let before = map.links.previous_of(held.lane).iter().copied();
    let mut outside = before.filter(|lane| in_junction(*lane) == Some(false));
    match (outside.next(), outside.next()) {
        (Some(lane), None) => {
            map.table.get(lane).map_or(held, |entry| LanePlace { lane, s: entry.exit_s() })
        }
        _ => held,
    }
}
