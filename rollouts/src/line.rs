//! Lines at which traffic lights hold vehicles, seen from above.

use nalgebra::Vector3;
use roads::Map;
use schemas::TrafficLightColour;

/// A line holds whoever heads within about 30° of its traffic.
pub(crate) const HEADING_COS_MIN: f32 = 0.87;

/// The end of one lane before one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StopLine {
    /// Position among the map's lights.
    pub light: usize,
    /// Its middle.
    pub x_m: f32,
    pub y_m: f32,
    /// Of the traffic's direction.
    pub cos: f32,
    pub sin: f32,
    pub half_width_m: f32,
}

/// A light on an agent's way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightAhead {
    /// Along the way from its start.
    pub at_m: f32,
    pub light: usize,
    pub colour: TrafficLightColour,
}

impl StopLine {
    /// Those of a map, in the order of its lights.
    pub(crate) fn all(map: &Map) -> Vec<Self> {
        let lights = map.traffic_lights().lights;
        let fronts = lights
            .iter()
            .enumerate()
            .flat_map(|(light, found)| found.boxes.iter().map(move |held| (light, held.front)));
        let lines = fronts.map(|(light, front)| {
            let pose = map.pose(&front);
            let along = pose.rotation * Vector3::x();
            let level = along.xy().norm().max(1.0e-9);
            Self {
                light,
                x_m: pose.translation.x as f32,
                y_m: pose.translation.y as f32,
                cos: (along.x / level) as f32,
                sin: (along.y / level) as f32,
                half_width_m: map.lane(&front).width_m as f32 / 2.0,
            }
        });
        lines.collect()
    }
}
