//! What render jobs tell besides their frame.

use flatbuffers::{FlatBufferBuilder, Vector, WIPOffset};

use super::check_count;
use super::parts::finite;
use crate::generated as fb;
use crate::limits::STREET_LIGHTS_MAX;
use crate::{Error, Exposure, Staging, StreetLight};

type Lights<'a> = WIPOffset<Vector<'a, fb::StreetLight>>;

/// Nothing where nothing is told.
pub(super) fn staging_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    staging: &Staging,
) -> Option<Lights<'a>> {
    let lights: Vec<fb::StreetLight> = staging
        .street_lights
        .iter()
        .map(|light| {
            fb::StreetLight::new(light.index, light.colour_rgb, light.brightness, light.on)
        })
        .collect();
    (!lights.is_empty()).then(|| b.create_vector(&lights))
}

/// # Errors
/// For too much of it, and for numbers that are none.
pub(super) fn staging_in(raw: &fb::RenderJob<'_>) -> Result<Staging, Error> {
    let lights = raw.street_lights();
    check_count("street lights", lights.map_or(0, |raw| raw.len()), STREET_LIGHTS_MAX)?;
    let street_lights = lights.iter().flatten().map(|raw| {
        Ok(StreetLight {
            index: raw.index(),
            on: raw.on(),
            colour_rgb: raw.colour_rgb(),
            brightness: finite(raw.brightness(), "brightness")?,
        })
    });
    Ok(Staging { street_lights: street_lights.collect::<Result<_, Error>>()? })
}

/// Nothing for a plain picture's.
pub(super) fn exposure_out(exposure: &Exposure) -> Option<fb::Exposure> {
    let [low, high] = exposure.range_ev100;
    (*exposure != Exposure::PLAIN).then(|| {
        fb::Exposure::new(
            exposure.fixed_ev100.is_some(),
            exposure.fixed_ev100.unwrap_or_default(),
            low,
            high,
            exposure.compensation_ev,
            exposure.temperature_k,
            exposure.tint,
        )
    })
}

/// # Errors
/// For numbers that are none.
pub(super) fn exposure_in(raw: Option<&fb::Exposure>) -> Result<Exposure, Error> {
    let Some(raw) = raw else { return Ok(Exposure::PLAIN) };
    let fixed_ev100 = finite(raw.ev100(), "ev100")?;
    Ok(Exposure {
        fixed_ev100: raw.fixed().then_some(fixed_ev100),
        range_ev100: [
            finite(raw.least_ev100(), "least_ev100")?,
            finite(raw.most_ev100(), "most_ev100")?,
        ],
        compensation_ev: finite(raw.compensation_ev(), "compensation_ev")?,
        temperature_k: finite(raw.temperature_k(), "temperature_k")?,
        tint: finite(raw.tint(), "tint")?,
    })
}
