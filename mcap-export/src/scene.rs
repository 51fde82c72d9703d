//! Actors and traffic lights as things to be drawn.

use std::collections::BTreeMap;

use schemas::{ActorId, ActorKind, ActorState, Frame, Pose, TrafficLightColour, TrafficLightState};
use serde_json::{Value, json};

use crate::convert::{Entity, MAP_FRAME, nanos, opaque, paint, pose, time, vector};

/// Height of letters.
const TEXT_M: f32 = 0.8;
/// How far the arrow of who may move reaches ahead.
const ARROW_M: f32 = 0.8;
/// Of the lamp that is drawn for a traffic light, and how high above its foot.
const LAMP_M: f32 = 0.8;
const LAMP_UP_M: f32 = 5.0;
const WHITE: [f32; 3] = [1.0, 1.0, 1.0];
/// Colours of who has none of its own.
const PROP: [f32; 3] = [0.6, 0.6, 0.6];
const WALKER: [f32; 3] = [0.95, 0.75, 0.3];
/// A deletion of the entity with the id, and not of all.
const MATCHING_ID: u8 = 0;

/// Who is drawn already, and where.
#[derive(Default)]
pub(crate) struct Scene {
    shown: BTreeMap<ActorId, Pose>,
}

impl Scene {
    /// What changes with a frame: who came or moved, and who is gone.
    pub(crate) fn update(&mut self, frame: &Frame, roles: &BTreeMap<ActorId, String>) -> Value {
        let now = nanos(frame.sim_secs);
        let is_gone = |id: &&ActorId| frame.actor(**id).is_none();
        let gone: Vec<ActorId> = self.shown.keys().filter(is_gone).copied().collect();
        self.shown.retain(|id, _| frame.actor(*id).is_some());
        let deletion = |id: &ActorId| {
            let id = id.get().to_string();
            json!({"timestamp": time(now), "type": MATCHING_ID, "id": id})
        };
        let deletions: Vec<Value> = gone.iter().map(deletion).collect();
        let mut entities = Vec::new();
        for actor in frame.actors.iter().filter(|actor| is_drawn(actor)) {
            let place = actor.world_from_actor;
            if self.shown.insert(actor.id, place) != Some(place) {
                let role = roles.get(&actor.id).map_or("", String::as_str);
                entities.push(entity(frame, actor, role, now));
            }
        }
        json!({"deletions": deletions, "entities": entities})
    }
}

fn is_drawn(actor: &ActorState) -> bool {
    matches!(actor.kind, ActorKind::Vehicle | ActorKind::Walker | ActorKind::Prop)
}

fn entity(frame: &Frame, actor: &ActorState, role: &str, now: u64) -> Value {
    let name = frame.type_of(actor);
    let middle =
        Pose::translation(actor.box_centre_m.x, actor.box_centre_m.y, actor.box_centre_m.z);
    let centre = actor.world_from_actor * middle;
    let color = match actor.kind {
        ActorKind::Vehicle => paint(actor.colour_rgb),
        ActorKind::Walker => opaque(WALKER),
        _ => opaque(PROP),
    };
    let size = vector(actor.box_half_extent_m * 2.0);
    let mut entity = Entity::new(actor.id.get());
    entity.cubes.push(json!({"pose": pose(&centre), "size": size, "color": color}));
    let above = Pose::translation(0.0, 0.0, actor.box_half_extent_m.z + TEXT_M);
    let short = name.rsplit('.').next().unwrap_or(name);
    entity.texts.push(json!({
        "pose": pose(&(centre * above)),
        "billboard": true,
        "font_size": TEXT_M,
        "scale_invariant": false,
        "color": opaque(WHITE),
        "text": format!("{} {short}", actor.id.get()),
    }));
    let speed = format!("{:.2}", actor.linear_velocity_mps.norm());
    if actor.kind != ActorKind::Prop {
        // From the front on, the way it looks.
        let front = Pose::translation(actor.box_half_extent_m.x, 0.0, 0.0);
        entity.arrows.push(json!({
            "pose": pose(&(centre * front)),
            "shaft_length": ARROW_M,
            "shaft_diameter": ARROW_M / 5.0,
            "head_length": ARROW_M / 2.0,
            "head_diameter": ARROW_M / 2.0,
            "color": opaque(WHITE),
        }));
    }
    entity.metadata.push(json!({"key": "blueprint", "value": name}));
    entity.metadata.push(json!({"key": "role", "value": role}));
    entity.metadata.push(json!({"key": "speed_mps", "value": speed}));
    entity.message(now)
}

/// Where vehicles, walkers and props are, by id.
pub(crate) fn poses(frame: &Frame) -> Value {
    let drawn = frame.actors.iter().filter(|actor| is_drawn(actor));
    let poses: Vec<Value> = drawn.map(|actor| pose(&actor.world_from_actor)).collect();
    json!({"timestamp": time(nanos(frame.sim_secs)), "frame_id": MAP_FRAME, "poses": poses})
}

/// Whether any traffic light shows something else.
pub(crate) fn lights_differ(before: &Frame, after: &Frame) -> bool {
    let shown = |frame: &Frame| -> Vec<(ActorId, TrafficLightColour)> {
        frame.traffic_lights.iter().map(|light| (light.actor, light.colour)).collect()
    };
    shown(before) != shown(after)
}

/// What all traffic lights show.
pub(crate) fn lights(frame: &Frame) -> Value {
    let now = nanos(frame.sim_secs);
    let lamp = |light: &TrafficLightState| {
        let place = frame.actor(light.actor)?.world_from_actor;
        let color = match light.colour {
            TrafficLightColour::Red => [1.0, 0.1, 0.1],
            TrafficLightColour::Yellow => [1.0, 0.8, 0.0],
            TrafficLightColour::Green => [0.1, 0.9, 0.2],
            TrafficLightColour::Off | TrafficLightColour::Unknown => [0.2, 0.2, 0.2],
        };
        let place = pose(&(place * Pose::translation(0.0, 0.0, LAMP_UP_M)));
        let size = vector(schemas::Vec3::repeat(LAMP_M));
        let mut entity = Entity::new(light.actor.get());
        entity.spheres.push(json!({"pose": place, "size": size, "color": opaque(color)}));
        Some(entity.message(now))
    };
    let entities: Vec<Value> = frame.traffic_lights.iter().filter_map(lamp).collect();
    let none: [Value; 0] = [];
    json!({"deletions": none, "entities": entities})
}

#[cfg(test)]
mod tests {
    use schemas::{MapRef, WorldId};

    use super::*;

    fn frame(actors: &[(u32, ActorKind, f32)]) -> Frame {
        let state = |&(id, kind, x): &(u32, ActorKind, f32)| {
            ActorState::at_rest(ActorId::new(id).unwrap(), kind, 0, Pose::translation(x, 0.0, 0.0))
        };
        let map = MapRef { name: "Town01".to_owned(), digest: String::new() };
        Frame {
            types: vec!["vehicle.audi.tt".to_owned()],
            actors: actors.iter().map(state).collect(),
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        }
    }

    fn ids(update: &Value, what: &str) -> Vec<String> {
        let all = update[what].as_array().unwrap();
        all.iter().map(|one| one["id"].as_str().unwrap().to_owned()).collect()
    }

    #[test]
    fn only_those_are_told_who_come_move_or_go() {
        use ActorKind::{Sensor, Vehicle, Walker};
        let mut scene = Scene::default();
        let roles = BTreeMap::from([(ActorId::FIRST, "hero".to_owned())]);
        let first =
            scene.update(&frame(&[(1, Vehicle, 0.0), (2, Walker, 5.0), (3, Sensor, 0.0)]), &roles);
        assert_eq!(
            (ids(&first, "entities"), ids(&first, "deletions").len()),
            (vec!["1".to_owned(), "2".to_owned()], 0)
        );
        let role = &first["entities"][0]["metadata"][1];
        assert_eq!((&role["key"], &role["value"]), (&json!("role"), &json!("hero")));
        let second = scene.update(&frame(&[(1, Vehicle, 1.0), (2, Walker, 5.0)]), &roles);
        assert_eq!(ids(&second, "entities"), ["1"]);
        let third = scene.update(&frame(&[(1, Vehicle, 1.0)]), &roles);
        assert_eq!(
            (ids(&third, "entities").len(), ids(&third, "deletions")),
            (0, vec!["2".to_owned()])
        );
    }

    #[test]
    fn a_box_is_where_the_box_of_its_actor_is() {
        let mut frame = frame(&[(1, ActorKind::Vehicle, 2.0)]);
        frame.actors[0].box_centre_m = schemas::Vec3::new(0.5, 0.0, 0.75);
        frame.actors[0].box_half_extent_m = schemas::Vec3::new(2.0, 1.0, 0.75);
        let update = Scene::default().update(&frame, &BTreeMap::new());
        let cube = &update["entities"][0]["cubes"][0];
        let arrow = &update["entities"][0]["arrows"][0]["pose"]["position"];
        assert_eq!(*arrow, json!({"x": 4.5, "y": 0.0, "z": 0.75}));
        assert_eq!(cube["pose"]["position"], json!({"x": 2.5, "y": 0.0, "z": 0.75}));
        assert_eq!(cube["size"], json!({"x": 4.0, "y": 2.0, "z": 1.5}));
        assert_eq!(update["entities"][0]["texts"][0]["text"], "1 tt");
    }
}
