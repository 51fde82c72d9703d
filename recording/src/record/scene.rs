//! Lights of the map, and the weather.

use crate::bytes::{Cursor, Field, Malformed, record};

record! {
    /// What a traffic light shows.
    LightState {
        /// Which one.
        id: u32,
        /// Whether it stays as it is.
        is_frozen: bool,
        /// Since it shows this.
        elapsed_secs: f32,
        /// 0 red, 1 yellow, 2 green, 3 off.
        state: u8,
    }
}

record! {
    /// A lamp of the map.
    SceneLight {
        /// Which one.
        id: i32,
        /// In the unit of the map.
        intensity: f32,
        /// Red, green, blue and alpha, 0 to 1.
        colour: [f32; 4],
        /// Whether it burns.
        is_on: bool,
        /// 0 none, 1 vehicle, 2 street, 3 building, 4 other.
        group: u8,
    }
}

record! {
    /// How long a traffic light shows what.
    LightTimes {
        /// Which one.
        id: u32,
        /// Green.
        green_secs: f32,
        /// Yellow.
        yellow_secs: f32,
        /// Red.
        red_secs: f32,
    }
}

/// The weather: the numbers of CARLA's `WeatherParameters`, in its order and units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weather(pub [f32; 14]);

impl Field for Weather {
    const BYTES_MIN: usize = <[f32; 14]>::BYTES_MIN;

    fn put(&self, out: &mut Vec<u8>) {
        self.0.put(out);
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        Field::take(cursor).map(Self)
    }
}
