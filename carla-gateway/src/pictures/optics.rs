//! What the attributes of a camera make of the pictures that are drawn: exposure and white balance,
//! which the renderer has to know, and lens, depth of field, motion blur, bloom and gamma, which
//! are done here. A camera with CARLA's defaults takes plain pictures, but for the glow of lamps by
//! night.

use schemas::{Exposure, Image, ImageKind};

use super::blur::{Focus, Streaks};
use super::glow::glow;
use super::lens::{Lens, fringe};
use super::linear;
use crate::dialect::Actor;
use crate::rpc::Refusal;

/// CARLA's defaults.
const BLOOM: f32 = 0.675;
const GAMMA: f32 = 2.2;

/// What one camera does with light.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Optics {
    exposure: Exposure,
    lens: Option<Lens>,
    /// Of a camera for colour; none: nothing is done after the picture is drawn.
    finish: Option<Finish>,
}

#[derive(Clone, Debug, PartialEq)]
struct Finish {
    focus: Option<Focus>,
    streaks: Option<Streaks>,
    bloom: f32,
    /// Intensity, and where it begins: 0 in the middle, 1 at the edge.
    fringe: [f32; 2],
    gamma: f32,
}

/// A colour picture with what is known about its pixels.
pub(crate) struct Photo<'a> {
    pub(crate) image: &'a mut Image,
    /// Metres along the view, where they were asked for.
    pub(crate) depths: Option<&'a Image>,
    /// How far everything moved, where it was asked for.
    pub(crate) flow: Option<&'a [[f32; 2]]>,
    pub(crate) horizontal_fov_rad: f32,
    pub(crate) is_night: bool,
}

impl Optics {
    /// As a camera's attributes ask for it.
    ///
    /// # Errors
    /// Values that no camera can have, in words for whoever spawns it.
    pub(crate) fn of(actor: &Actor) -> Result<Self, Refusal> {
        let lens = Lens::of(actor)?;
        if actor.text("exposure_mode").is_none() || !is_on(actor, "enable_postprocess_effects") {
            return Ok(Self { lens, ..Self::default() });
        }
        let finish = Finish {
            focus: Focus::of(actor)?,
            streaks: Streaks::of(actor)?,
            bloom: actor.number("bloom_intensity", BLOOM)?.clamp(0.0, 100.0),
            fringe: [
                actor.number("chromatic_aberration_intensity", 0.0)?.clamp(0.0, 20.0),
                actor.number("chromatic_aberration_offset", 0.0)?.clamp(0.0, 1.0),
            ],
            gamma: gamma(actor)?,
        };
        Ok(Self { exposure: exposure(actor)?, lens, finish: Some(finish) })
    }

    /// What the renderer has to know.
    pub(crate) fn exposure(&self) -> Exposure {
        self.exposure
    }

    /// Pictures that finishing a colour picture needs besides it.
    pub(crate) fn needs(&self) -> &'static [ImageKind] {
        match &self.finish {
            Some(Finish { streaks: Some(_), .. }) => &[ImageKind::Depth, ImageKind::Instance],
            Some(Finish { focus: Some(_), .. }) => &[ImageKind::Depth],
            _ => &[],
        }
    }

    /// Whether it wants to know how far everything moved.
    pub(crate) fn needs_flow(&self) -> bool {
        self.finish.as_ref().is_some_and(|finish| finish.streaks.is_some())
    }

    /// Finishes a colour picture, but for its lens.
    pub(crate) fn finish(&self, photo: &mut Photo<'_>) {
        let Some(finish) = &self.finish else { return };
        let size_px = [photo.image.width_px, photo.image.height_px];
        let pixels = &mut photo.image.data;
        if pixels.len() != size_px[0] as usize * size_px[1] as usize * 4 {
            return;
        }
        if let (Some(focus), Some(depths)) = (&finish.focus, photo.depths) {
            focus.blur(pixels, &depths.data, size_px, photo.horizontal_fov_rad);
        }
        if let (Some(streaks), Some(flow)) = (&finish.streaks, photo.flow) {
            streaks.blur(pixels, flow, size_px);
        }
        // By day nothing but the sun is bright enough to glow.
        if finish.bloom != BLOOM || photo.is_night {
            glow(pixels, size_px, finish.bloom);
        }
        if finish.fringe[0] > 0.0 {
            fringe(pixels, size_px, finish.fringe);
        }
        if finish.gamma != GAMMA {
            let curve = linear::gamma_curve(GAMMA / finish.gamma);
            for pixel in pixels.as_chunks_mut::<4>().0 {
                let [red, green, blue, _] = *pixel;
                let bent = [red, green, blue].map(|part| curve[usize::from(part)]);
                pixel[..3].copy_from_slice(&bent);
            }
        }
    }

    /// Bends a picture of any kind as the lens does.
    pub(crate) fn bend(&self, image: &mut Image) {
        if let Some(lens) = &self.lens {
            lens.bend(image);
        }
    }
}

/// EV100 = log2(N² / t · 100 / ISO), as photographers have it.
fn exposure(actor: &Actor) -> Result<Exposure, Refusal> {
    let fixed_ev100 = match actor.text("exposure_mode") {
        Some("manual") => {
            let stop = positive(actor, "fstop", 1.4)?;
            let per_sec = positive(actor, "shutter_speed", 200.0)?;
            let iso = positive(actor, "iso", 100.0)?;
            Some((stop * stop * per_sec * 100.0 / iso).log2().clamp(-64.0, 64.0))
        }
        _ => None,
    };
    let range_ev100 = [
        actor.number("exposure_min_bright", Exposure::PLAIN.range_ev100[0])?,
        actor.number("exposure_max_bright", Exposure::PLAIN.range_ev100[1])?,
    ];
    Ok(Exposure {
        fixed_ev100,
        range_ev100,
        compensation_ev: actor.number("exposure_compensation", 0.0)?,
        temperature_k: positive(actor, "temp", Exposure::PLAIN.temperature_k)?,
        tint: actor.number("tint", 0.0)?,
    })
}

/// The usual one where none above 0 is asked for, as Unreal Engine has it.
fn gamma(actor: &Actor) -> Result<f32, Refusal> {
    let asked = actor.number("gamma", GAMMA)?;
    Ok(if asked > 0.0 { asked } else { GAMMA })
}

/// A number above 0.
pub(super) fn positive(actor: &Actor, id: &str, default: f32) -> Result<f32, Refusal> {
    match actor.number(id, default)? {
        value if value > 0.0 => Ok(value),
        value => Err(Refusal(format!("{id} must be more than 0, not {value}"))),
    }
}

fn is_on(actor: &Actor, id: &str) -> bool {
    !actor.text(id).is_some_and(|text| text.eq_ignore_ascii_case("false") || text == "0")
}

#[cfg(test)]
mod tests {
    use schemas::ImageEncoding;

    use super::*;
    use crate::dialect::AttributeValue;

    pub(crate) fn camera(attributes: &[(&str, &str)]) -> Actor {
        let mut actor = Actor::default();
        let all = [("exposure_mode", "histogram")];
        actor.description.attributes = attributes
            .iter()
            .chain(&all)
            .map(|(id, value)| AttributeValue {
                id: (*id).to_owned(),
                kind: 4,
                value: (*value).to_owned(),
            })
            .collect();
        actor
    }

    fn grey(value: u8) -> Image {
        Image {
            camera: 0,
            width_px: 32,
            height_px: 16,
            kind: ImageKind::Rgb,
            encoding: ImageEncoding::Rgba8,
            data: [value, value, value, 255].repeat(32 * 16),
        }
    }

    fn finished(attributes: &[(&str, &str)], image: &Image, is_night: bool) -> Image {
        let mut image = image.clone();
        let mut photo = Photo {
            image: &mut image,
            depths: None,
            flow: None,
            horizontal_fov_rad: 1.5,
            is_night,
        };
        Optics::of(&camera(attributes)).unwrap().finish(&mut photo);
        image
    }

    #[test]
    fn defaults_ask_for_nothing_and_leave_a_picture_by_day_as_it_is() {
        let optics = Optics::of(&camera(&[])).unwrap();
        assert_eq!((optics.exposure(), optics.needs()), (Exposure::PLAIN, &[][..]));
        for value in [0, 128, 255] {
            assert_eq!(finished(&[], &grey(value), false), grey(value));
        }
    }

    #[test]
    fn a_manual_exposure_follows_from_stop_time_and_speed() {
        let manual = [("exposure_mode", "manual"), ("fstop", "8"), ("shutter_speed", "250")];
        let ev100 = Optics::of(&camera(&manual)).unwrap().exposure().fixed_ev100.unwrap();
        assert!((ev100 - 13.966).abs() < 1e-3, "{ev100}");
        let faster =
            [("exposure_mode", "manual"), ("fstop", "8"), ("shutter_speed", "250"), ("iso", "400")];
        let less = Optics::of(&camera(&faster)).unwrap().exposure().fixed_ev100.unwrap();
        assert!((ev100 - less - 2.0).abs() < 1e-4);
        for wrong in [("iso", "0"), ("fstop", "-1"), ("shutter_speed", "fast")] {
            assert!(Optics::of(&camera(&[("exposure_mode", "manual"), wrong])).is_err());
        }
    }

    #[test]
    fn gamma_bends_what_is_between_black_and_white() {
        let of =
            |gamma: &str, value: u8| finished(&[("gamma", gamma)], &grey(value), false).data[0];
        assert_eq!([of("1.1", 0), of("1.1", 255)], [0, 255]);
        assert!(of("1.1", 128) < 70 && of("4.4", 128) > 175);
        assert_eq!(of("0.0", 128), of("2.2", 128));
    }

    #[test]
    fn without_effects_everything_but_the_lens_is_plain() {
        let off = [("enable_postprocess_effects", "False"), ("gamma", "1.0"), ("temp", "3000")];
        let optics = Optics::of(&camera(&off)).unwrap();
        assert_eq!(optics, Optics::default());
    }
}
