//! Street lights: they stand in the map, burn by night, and clients may set each of them.

use roads::{Map, MapLayer};
use schemas::limits::STREET_LIGHTS_MAX;
use schemas::{StreetLight, Vec3};

use crate::dialect::{LightState, Location};

/// Lights that a client may set.
const LIGHTS_MAX: usize = 16_384;
/// `LightGroup::Street`.
const STREET: u8 = 2;
/// Of a street light, as bright and warm as a high-pressure sodium lamp.
const INTENSITY: f32 = 10_000.0;
const COLOUR: (u8, u8, u8) = (255, 214, 170);

/// The street lights of one map, as clients set them.
#[derive(Debug, Default)]
pub(crate) struct StreetLamps {
    lights: Vec<LightState>,
    /// Whether clients have to ask for them again.
    are_new: bool,
    /// Whether they stay as they were set, by day and by night.
    ignore_the_sun: bool,
}

impl StreetLamps {
    /// Those of a map, as they burn at this time of day.
    pub(super) fn of(map: &Map, is_night: bool) -> Self {
        let mut lamps = Self { lights: of_map(map), ..Self::default() };
        lamps.switch(is_night);
        lamps
    }

    /// As clients read them.
    pub(crate) fn lights(&self) -> &[LightState] {
        &self.lights
    }

    /// Takes over what a client set of some; they stay where they stand. Ids that the map does not
    /// have are left out.
    pub(crate) fn set(&mut self, changed: &[LightState]) {
        for one in changed {
            // They are in the order of their ids.
            let found = self.lights.binary_search_by_key(&one.id, |light| light.id);
            let Some(light) = found.ok().and_then(|index| self.lights.get_mut(index)) else {
                continue;
            };
            let set = LightState { location: light.location, ..one.clone() };
            self.are_new |= *light != set;
            *light = set;
        }
    }

    /// Takes over what a recording says of them.
    pub(crate) fn take_over(&mut self, recorded: &[recording::SceneLight]) {
        for one in recorded {
            let light = self.lights.iter_mut().find(|light| light.id == one.id as u32);
            self.are_new |= light.is_some();
            light.into_iter().for_each(|light| light.take_over(one));
        }
    }

    /// Follows the sun from now on, or no longer.
    pub(crate) fn follow_the_sun(&mut self, follow: bool, is_night: bool) {
        self.ignore_the_sun = !follow;
        self.switch(is_night);
    }

    /// Switches on by night and off by day, while following the sun.
    pub(crate) fn switch(&mut self, is_night: bool) {
        if self.ignore_the_sun {
            return;
        }
        for light in self.lights.iter_mut().filter(|light| light.group == STREET) {
            self.are_new |= light.active != is_night;
            light.active = is_night;
        }
    }

    /// Those that are not as street lights are at this time of day, as a renderer is told.
    pub(super) fn unusual(&self, is_night: bool) -> Vec<StreetLight> {
        let is_unusual = |light: &LightState| {
            light.active != is_night || (light.intensity, light.colour) != (INTENSITY, COLOUR)
        };
        let told = |light: &LightState| {
            let (red, green, blue) = light.colour;
            let brightness = light.intensity / INTENSITY;
            Some(StreetLight {
                index: light.id.checked_sub(1)?,
                on: light.active,
                colour_rgb: u32::from_be_bytes([0, red, green, blue]),
                brightness: if brightness > 0.0 { brightness.min(1e3) } else { 0.0 },
            })
        };
        let unusual = self.lights.iter().filter(|light| is_unusual(light));
        unusual.filter_map(told).take(STREET_LIGHTS_MAX).collect()
    }

    /// Whether clients have to ask for them again.
    pub(super) fn are_new(&self) -> bool {
        self.are_new
    }

    /// All who listen have been told to ask again.
    pub(super) fn note_told(&mut self) {
        self.are_new = false;
    }
}

/// The street lights of a map, all off.
fn of_map(map: &Map) -> Vec<LightState> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_renderer_is_told_of_those_that_somebody_set() {
        let text = roads::town::build("Town02").unwrap();
        let mut lamps = StreetLamps::of(&Map::parse("Town02", &text).unwrap(), true);
        assert_eq!(lamps.unusual(true), []);
        let count = lamps.lights().len();
        let [mut third, mut fifth] = [2, 4].map(|index: usize| lamps.lights()[index].clone());
        third.active = false;
        (fifth.colour, fifth.intensity) = ((1, 2, 3), 2.0 * INTENSITY);
        let unknown = LightState { id: 1_000_000, ..third.clone() };
        lamps.set(&[third]);
        lamps.set(&[fifth, unknown]);
        assert_eq!(lamps.lights().len(), count);
        let off = StreetLight { index: 2, on: false, colour_rgb: 0xff_d6_aa, brightness: 1.0 };
        let blue = StreetLight { index: 4, on: true, colour_rgb: 0x01_02_03, brightness: 2.0 };
        assert_eq!(lamps.unusual(true), [off, blue]);
    }

    #[test]
    fn a_town_has_street_lights_above_the_ground() {
        let text = roads::town::build("Town02").unwrap();
        let lights = of_map(&Map::parse("Town02", &text).unwrap());
        assert!(lights.len() > 20, "{}", lights.len());
        assert!(lights.iter().all(|light| light.location.z > 3.0 && light.group == STREET));
        assert!(lights.windows(2).all(|pair| pair[0].id < pair[1].id));
    }
}
