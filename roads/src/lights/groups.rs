//! Which lights take turns.

use std::collections::BTreeMap;

use super::{LightController, LightGroup, TrafficLight, TrafficLights};
use crate::landmarks::Landmark;
use crate::map::Map;

/// What decides the order of groups: junctions by id, then what stands alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum GroupKey {
    Junction(u32),
    Alone(usize),
}

/// Gives every light its controller and every controller its group.
///
/// `listed` is the position in the file of each signal's controller.
pub(super) fn arrange(
    map: &Map,
    mut lights: Vec<TrafficLight>,
    listed: &BTreeMap<&str, usize>,
    landmarks: &BTreeMap<&str, Vec<&Landmark>>,
) -> TrafficLights {
    let mut controllers: Vec<LightController> = Vec::new();
    // Controllers of the file by their place in it, then lights without one by their own.
    let mut members: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (index, light) in lights.iter().enumerate() {
        let key = listed.get(light.id.as_str()).map_or((usize::MAX, index), |file| (*file, 0));
        members.entry(key).or_default().push(index);
    }
    let mut group_keys: BTreeMap<GroupKey, Vec<(usize, usize)>> = BTreeMap::new();
    for ((file, _), members) in members {
        let controller = controllers.len();
        let id = map.model.signals.controllers.get(file).map(|found| found.id.clone());
        let (key, turn) = match &id {
            None => (GroupKey::Alone(controller), 0),
            Some(id) => place(map, id, controller, &lights, &members, landmarks),
        };
        group_keys.entry(key).or_default().push((turn, controller));
        for light in &members {
            if let Some(light) = lights.get_mut(*light) {
                light.controller = controller;
            }
        }
        controllers.push(LightController { id, group: 0, lights: members });
    }
    let groups = group_keys
        .into_iter()
        .enumerate()
        .map(|(group, (key, mut turns))| {
            turns.sort_unstable();
            let in_turn: Vec<usize> = turns.into_iter().map(|(_, controller)| controller).collect();
            for controller in &in_turn {
                if let Some(controller) = controllers.get_mut(*controller) {
                    controller.group = group;
                }
            }
            let junction = match key {
                GroupKey::Junction(id) => Some(id),
                GroupKey::Alone(_) => None,
            };
            LightGroup { junction, controllers: in_turn }
        })
        .collect();
    TrafficLights { lights, controllers, groups }
}

/// The group of a controller of the file and its turn there: as its junction lists it, or, when no
/// junction does, at the end in the junction that its lights hold.
fn place(
    map: &Map,
    id: &str,
    controller: usize,
    lights: &[TrafficLight],
    members: &[usize],
    landmarks: &BTreeMap<&str, Vec<&Landmark>>,
) -> (GroupKey, usize) {
    let listing = map.model.junctions.iter().find_map(|junction| {
        let turn = junction.controllers.iter().position(|listed| listed == id)?;
        Some((GroupKey::Junction(junction.id), turn))
    });
    listing.unwrap_or_else(|| {
        let held = members
            .iter()
            .filter_map(|light| landmarks.get(lights.get(*light)?.id.as_str()))
            .flatten()
            .find_map(|landmark| junction_at(map, landmark));
        (held.map_or(GroupKey::Alone(controller), GroupKey::Junction), usize::MAX)
    })
}

/// The junction that a landmark's road leads through, or into for the traffic it addresses.
fn junction_at(map: &Map, landmark: &Landmark) -> Option<u32> {
    let road = map.model.road(landmark.road)?;
    if let Some(junction) = road.junction {
        return u32::try_from(junction).ok();
    }
    let [first, last] = *landmark.validities.first()?;
    let lane = if first != 0 { first } else { last };
    let next = if road.runs_forward(lane) { road.successor } else { road.predecessor };
    map.model.road(next).is_none().then(|| map.model.junction(next).map(|found| found.id))?
}
