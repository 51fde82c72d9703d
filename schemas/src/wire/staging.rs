//! What render jobs tell besides their frame.

use flatbuffers::{FlatBufferBuilder, Vector, WIPOffset};

use super::check_count;
use super::parts::{finite, pose_in, pose_out};
use crate::generated as fb;
use crate::limits::{LIMBS_MAX, STREET_LIGHTS_MAX};
use crate::{ActorId, Error, ErrorCode, Exposure, Limb, PosedLimb, Staging, StreetLight};

type Lights<'a> = WIPOffset<Vector<'a, fb::StreetLight>>;
type Limbs<'a> = WIPOffset<Vector<'a, fb::PosedLimb>>;

/// Nothing where nothing is told.
pub(super) fn staging_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    staging: &Staging,
) -> (Option<Lights<'a>>, Option<Limbs<'a>>) {
    let lights: Vec<fb::StreetLight> = staging
        .street_lights
        .iter()
        .map(|light| {
            fb::StreetLight::new(light.index, light.colour_rgb, light.brightness, light.on)
        })
        .collect();
    let limbs: Vec<fb::PosedLimb> = staging
        .limbs
        .iter()
        .map(|limb| {
            let pose = pose_out(&limb.world_from_limb);
            fb::PosedLimb::new(limb.walker.get(), limb.limb as u8, &pose)
        })
        .collect();
    let lights = (!lights.is_empty()).then(|| b.create_vector(&lights));
    (lights, (!limbs.is_empty()).then(|| b.create_vector(&limbs)))
}

/// # Errors
/// For too much of it, and for numbers that are none.
pub(super) fn staging_in(raw: &fb::RenderJob<'_>) -> Result<Staging, Error> {
    let (lights, limbs) = (raw.street_lights(), raw.limbs());
    check_count("street lights", lights.map_or(0, |raw| raw.len()), STREET_LIGHTS_MAX)?;
    check_count("limbs", limbs.map_or(0, |raw| raw.len()), LIMBS_MAX)?;
    let street_lights = lights.iter().flatten().map(|raw| {
        Ok(StreetLight {
            index: raw.index(),
            on: raw.on(),
            colour_rgb: raw.colour_rgb(),
            brightness: finite(raw.brightness(), "brightness")?,
        })
    });
    Ok(Staging {
        street_lights: street_lights.collect::<Result<_, Error>>()?,
        limbs: limbs.iter().flatten().map(limb_in).collect::<Result<_, Error>>()?,
    })
}

fn limb_in(raw: &fb::PosedLimb) -> Result<PosedLimb, Error> {
    let refused = |what: &str| Error::new(ErrorCode::InvalidMessage, what.to_owned());
    let limb = Limb::ALL.get(usize::from(raw.limb())).ok_or_else(|| {
        refused("a walker has no such limb")
            .wanted(format_args!("0 to {}", Limb::ALL.len() - 1))
            .found(raw.limb())
    })?;
    Ok(PosedLimb {
        walker: ActorId::new(raw.walker())
            .ok_or_else(|| refused("a limb of nobody").wanted("an actor's id").found(0))?,
        limb: *limb,
        world_from_limb: pose_in(raw.world_from_limb(), "world_from_limb")?,
    })
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
