//! How things look that no frame tells of: what clients did to lamps of a map.

/// What a render job shows besides its frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Staging {
    /// Of the street lights of a map, those that are not as the hour has them; at most
    /// [`STREET_LIGHTS_MAX`](crate::limits::STREET_LIGHTS_MAX).
    pub street_lights: Vec<StreetLight>,
}

impl Staging {
    /// Whether everything looks as the frame tells.
    pub fn is_empty(&self) -> bool {
        self.street_lights.is_empty()
    }
}

/// How one of a map's street lights was set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreetLight {
    /// Place among the map's street lights, in the order of its environment objects.
    pub index: u32,
    /// Whether it burns.
    pub on: bool,
    /// sRGB, `0xRRGGBB`.
    pub colour_rgb: u32,
    /// As a part of what a street light has by itself; 0 or more.
    pub brightness: f32,
}

/// How light becomes a colour picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure value at ISO 100; none: as the light of the scene wants it.
    pub fixed_ev100: Option<f32>,
    /// Between these the exposure follows the light.
    pub range_ev100: [f32; 2],
    /// Stops by which the picture is brighter than that.
    pub compensation_ev: f32,
    /// Colour temperature that looks white, in kelvin.
    pub temperature_k: f32,
    /// -1 green to 1 magenta.
    pub tint: f32,
}

impl Exposure {
    /// A plain picture's.
    pub const PLAIN: Self = Self {
        fixed_ev100: None,
        range_ev100: [10.0, 12.0],
        compensation_ev: 0.0,
        temperature_k: 6_500.0,
        tint: 0.0,
    };
}

impl Default for Exposure {
    fn default() -> Self {
        Self::PLAIN
    }
}
