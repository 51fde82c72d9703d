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
