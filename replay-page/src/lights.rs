//! What traffic lights showed.

use std::collections::BTreeMap;

use schemas::{ActorId, Frame, TrafficLightColour};
use serde_json::{Value, json};

/// Where lights are, and their colours when they change.
#[derive(Debug, Default)]
pub(crate) struct Lights(BTreeMap<ActorId, Light>);

#[derive(Debug)]
struct Light {
    place_m: [f32; 2],
    changes: Vec<(usize, &'static str)>,
}

impl Lights {
    pub(crate) fn frame(&mut self, frame: &Frame, index: usize) {
        for state in &frame.traffic_lights {
            let Some(actor) = frame.actor(state.actor) else { continue };
            let place = actor.world_from_actor.translation;
            let light = self
                .0
                .entry(state.actor)
                .or_insert_with(|| Light { place_m: [place.x, place.y], changes: Vec::new() });
            let colour = name(state.colour);
            if light.changes.last().is_none_or(|(_, last)| *last != colour) {
                light.changes.push((index, colour));
            }
        }
    }

    pub(crate) fn told(&self) -> Value {
        let light = |light: &Light| json!({"at": light.place_m, "changes": light.changes});
        self.0.values().map(light).collect()
    }
}

fn name(colour: TrafficLightColour) -> &'static str {
    match colour {
        TrafficLightColour::Red => "red",
        TrafficLightColour::Yellow => "yellow",
        TrafficLightColour::Green => "green",
        TrafficLightColour::Off | TrafficLightColour::Unknown => "off",
    }
}
