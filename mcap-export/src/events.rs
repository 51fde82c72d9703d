//! What happened from one frame to the next.

use schemas::{ActorId, Frame, Measurement, SensorDatum};
use serde_json::{Value, json};

use crate::convert::{nanos, time};

/// Levels of Foxglove's log.
const INFO: u8 = 2;
const WARNING: u8 = 3;
const ERROR: u8 = 4;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// What: `spawned`, `destroyed`, `collision` or `halted`.
    pub kind: &'static str,
    /// To whom, and what else is known.
    pub text: String,
    level: u8,
}

/// What happened from one frame to the next, in a fixed order: spawned, destroyed, collisions,
/// halts.
pub fn between(before: &Frame, after: &Frame) -> Vec<Event> {
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
    told.into_iter().map(|(kind, level, text)| Event { kind, text, level }).collect()
}

/// An event as a line of a log.
pub(crate) fn logged(sim_secs: f64, event: &Event) -> Value {
    line(sim_secs, (event.kind, event.level, event.text.clone()))
}

/// What a sensor tells that is an event; contacts are told of everybody. `name` is that of the
/// sensor, `frame` knows whom it met.
pub(crate) fn of_sensor(datum: &SensorDatum, name: &str, frame: Option<&Frame>) -> Option<Value> {
    let told = match &datum.measurement {
        Measurement::Obstacle { other, distance_m, .. } => {
            let blueprint = |id: ActorId| {
                let found = frame.and_then(|frame| Some(frame.type_of(frame.actor(id)?)));
                format!("{} {}", id.get(), found.unwrap_or_default())
            };
            let ahead = other.map_or_else(|| "the map".to_owned(), blueprint);
            ("obstacle", INFO, format!("{name}: {ahead} at {distance_m:.1} m"))
        }
        Measurement::LaneInvasion { marks } => {
            ("lane_invasion", INFO, format!("{name}: {}", marks.join(", ")))
        }
        _ => return None,
    };
    Some(line(datum.sim_secs, told))
}

fn line(sim_secs: f64, (kind, level, message): (&str, u8, String)) -> Value {
    json!({
        "timestamp": time(nanos(sim_secs)),
        "level": level,
        "message": message,
        "name": kind,
        "file": "",
        "line": 0,
    })
}

#[cfg(test)]
mod tests {
    use schemas::{ActorKind, ActorState, Collision, MapRef, Pose, Tick, Vec3, WorldId};

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
    fn what_a_sensor_sees_ahead_and_which_marks_it_crosses_are_events() {
        let seen = |measurement| {
            let datum = SensorDatum {
                sensor: ActorId::new(7).unwrap(),
                tick: Tick(1),
                sim_secs: 0.05,
                world_from_sensor: Pose::identity(),
                measurement,
            };
            let line = of_sensor(&datum, "ego/obstacle/7", Some(&frame(&[3])))?;
            Some((line["name"].as_str()?.to_owned(), line["message"].as_str()?.to_owned()))
        };
        let obstacle = |other| Measurement::Obstacle { other, tag: 14, distance_m: 4.25 };
        let told = |kind: &str, message: &str| Some((kind.to_owned(), message.to_owned()));
        let car = told("obstacle", "ego/obstacle/7: 3 vehicle.audi.tt at 4.2 m");
        assert_eq!(seen(obstacle(ActorId::new(3))), car);
        assert_eq!(seen(obstacle(None)), told("obstacle", "ego/obstacle/7: the map at 4.2 m"));
        let marks = vec!["solid".to_owned(), "broken".to_owned()];
        let crossed = told("lane_invasion", "ego/obstacle/7: solid, broken");
        assert_eq!(seen(Measurement::LaneInvasion { marks }), crossed);
        let contact = Measurement::Collision { other: None, tag: 0, impulse_ns: Vec3::zeros() };
        assert_eq!(seen(contact), None);
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
        let lines: Vec<(&str, &str)> =
            told.iter().map(|event| (event.kind, event.text.as_str())).collect();
        assert_eq!(
            lines,
            [
                ("spawned", "3 vehicle.audi.tt"),
                ("destroyed", "1 vehicle.audi.tt"),
                ("collision", "2 vehicle.audi.tt with the map at 6.2 m/s"),
            ]
        );
        assert_eq!(logged(0.0, &told[2])["level"], ERROR);
    }
}
