//! Street lights: they stand in the map, burn by night, and clients may set each of them.

use roads::{Map, MapLayer};
use schemas::Vec3;

use super::astray;
use crate::dialect::{LightState, Location};
use crate::endpoint::Endpoint;
use crate::rpc::{Answer, Meta, Payload, Request};

/// Lights that a client may set.
const LIGHTS_MAX: usize = 16_384;
/// `LightGroup::Street`.
const STREET: u8 = 2;
/// Of a street light, as bright and warm as a high-pressure sodium lamp.
const INTENSITY: f32 = 10_000.0;
const COLOUR: (u8, u8, u8) = (255, 214, 170);

pub(super) fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "query_lights_state" => Payload::value(&endpoint.lights),
        "update_lights_state" => {
            let (_, _client, lights, _): (Meta, String, Vec<LightState>, bool) = request.args()?;
            if lights.len() <= LIGHTS_MAX && lights != endpoint.lights {
                endpoint.lights = lights;
                endpoint.lights_are_new = true;
            }
            Ok(Payload::Void)
        }
        "update_day_night_cycle" => {
            let (_, _client, active): (Meta, String, bool) = request.args()?;
            endpoint.lights_follow_the_sun = active;
            endpoint.switch_lights();
            Ok(Payload::Void)
        }
        _ => astray(request),
    }
}

/// The street lights of a map, all off.
pub(crate) fn of_map(map: &Map) -> Vec<LightState> {
    let lamps =
        map.environment_objects().iter().filter(|object| object.layer == MapLayer::StreetLights);
    let light = |(id, lamp): (u32, &roads::EnvironmentObject)| {
        let foot_m: Vec3 = lamp.pose.translation.vector.cast();
        let top_m = foot_m + Vec3::z() * lamp.half_extent_m.z as f32;
        LightState {
            id,
            location: Location::of(top_m),
            intensity: INTENSITY,
            group: STREET,
            colour: COLOUR,
            active: false,
        }
    };
    (1..).zip(lamps).take(LIGHTS_MAX).map(light).collect()
}

impl Endpoint {
    /// Switches the street lights on by night and off by day, while they follow the sun.
    pub(crate) fn switch_lights(&mut self) {
        let is_night = self.weather.ours().sun_altitude_rad <= 0.0;
        if !self.lights_follow_the_sun {
            return;
        }
        let mut lamps = self.lights.iter_mut().filter(|light| light.group == STREET);
        if lamps.any(|light| light.active != is_night) {
            for light in self.lights.iter_mut().filter(|light| light.group == STREET) {
                light.active = is_night;
            }
            self.lights_are_new = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_town_has_street_lights_above_the_ground() {
        let text = roads::town::build("Town02").unwrap();
        let lights = of_map(&Map::parse("Town02", &text).unwrap());
        assert!(lights.len() > 20, "{}", lights.len());
        assert!(lights.iter().all(|light| light.location.z > 3.0 && light.group == STREET));
        assert!(lights.windows(2).all(|pair| pair[0].id < pair[1].id));
    }
}
