//! What happened from one frame to the next.

use schemas::{ActorId, Frame};
use serde_json::{Value, json};

use crate::convert::{nanos, time};

/// Levels of Foxglove's log.
const INFO: u8 = 2;
const WARNING: u8 = 3;
const ERROR: u8 = 4;

/// In a fixed order: spawned, destroyed, collisions, halts.
pub(crate) fn between(before: &Frame, after: &Frame) -> Vec<Value> {
    let name = |frame: &Frame, id: ActorId| {
        let blueprint = frame.actor(id).map_or("", |actor| frame.type_of(actor));
        format!("{} {blueprint}", id.get())
    };
    let mut told = Vec::new();
    for actor in after.actors.iter().filter(|actor| before.actor(actor.id).is_none()) {
        told.push(("spawned", INFO, name(after, actor.id)));
    }
    for actor in before.actors.iter().filter(|actor| after.actor(actor.id).is_none()) {
        told.push(("destroyed", INFO, name(before, actor.id)));
    }
    for collision in after.collisions.iter().filter(|collision| collision.started) {
        let other =
            collision.other.map_or_else(|| "the map".to_owned(), |other| name(after, other));
        let speed = collision.closing_speed_mps;
        let text = format!("{} with {other} at {speed:.1} m/s", name(after, collision.actor));
        told.push(("collision", ERROR, text));
    }
    for halt in after.halted_since(before.tick) {
        told.push(("halted", WARNING, format!("{}: {}", name(after, halt.actor), halt.reason)));
    }
    let now = time(nanos(after.sim_secs));
    let line = |(kind, level, message)| {
        json!({
            "timestamp": now,
            "level": level,
            "message": message,
            "name": kind,
            "file": "",
            "line": 0,
        })
    };
    told.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use schemas::{ActorKind, ActorState, Collision, MapRef, Pose, Vec3, WorldId};

    use super::*;

    fn frame(actors: &[u32]) -> Frame {
        let state = |id: &u32| {
            let id = ActorId::new(*id).unwrap();
            ActorState::at_rest(id, ActorKind::Vehicle, 0, Pose::identity())
        };
        let map = MapRef { name: "Town01".to_owned(), digest: String::new() };
        Frame {
            types: vec!["vehicle.audi.tt".to_owned()],
            actors: actors.iter().map(state).collect(),
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        }
    }

    #[test]
    fn who_comes_goes_and_meets_is_told_by_name_and_only_when_it_begins() {
        let contact = |other, started| Collision {
            actor: ActorId::new(2).unwrap(),
            other,
            started,
            position_m: Vec3::zeros(),
            impulse_ns: Vec3::zeros(),
            closing_speed_mps: 6.25,
        };
        let after = Frame {
            collisions: vec![contact(None, true), contact(ActorId::new(3), false)],
            ..frame(&[2, 3])
        };
        let told = between(&frame(&[1, 2]), &after);
        let lines: Vec<(&str, &str)> = told
            .iter()
            .map(|line| (line["name"].as_str().unwrap(), line["message"].as_str().unwrap()))
            .collect();
        assert_eq!(
            lines,
            [
                ("spawned", "3 vehicle.audi.tt"),
                ("destroyed", "1 vehicle.audi.tt"),
                ("collision", "2 vehicle.audi.tt with the map at 6.2 m/s"),
            ]
        );
        assert_eq!(told[2]["level"], ERROR);
    }
}
