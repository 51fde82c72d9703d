//! Textures on things of the map.

use std::collections::BTreeSet;
use std::sync::Arc;

use schemas::limits::{OBJECTS_PER_COMMAND_MAX, TEXTURE_SIDE_PX_MAX};
use schemas::{Command, MaterialParameter, SceneryCommand};

use crate::dialect::{Colour, FloatColour, Linear, Texture};
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;

use super::scenery;

/// CARLA's numbers of what a texture replaces.
const DIFFUSE: u8 = 2;
const EMISSIVE: u8 = 3;

pub(super) async fn put(
    endpoint: &mut Endpoint,
    names: Vec<String>,
    parameter: u8,
    texture: Texture<Colour>,
) -> Result<(), Refusal> {
    paint(endpoint, &names, parameter, &texture).await
}

pub(super) async fn put_float(
    endpoint: &mut Endpoint,
    names: Vec<String>,
    parameter: u8,
    texture: Texture<FloatColour>,
) -> Result<(), Refusal> {
    paint(endpoint, &names, parameter, &texture).await
}

/// As in CARLA, names that nothing has are left out, unless none is left.
async fn paint<C: Linear>(
    endpoint: &mut Endpoint,
    names: &[String],
    parameter: u8,
    texture: &Texture<C>,
) -> Result<(), Refusal> {
    let names: BTreeSet<&str> = names.iter().map(String::as_str).collect();
    let all = scenery::objects(endpoint, scenery::ANY_TAG)?;
    let objects = all.iter().filter(|object| names.contains(object.name.as_str()));
    let objects: Vec<u64> = objects.map(|object| object.id).collect();
    if objects.is_empty() {
        return Err(Refusal("unable to find Actor to apply the texture".to_owned()));
    }
    let parameter = match parameter {
        DIFFUSE => MaterialParameter::Diffuse,
        EMISSIVE => MaterialParameter::Emissive,
        // Surfaces have neither bumps nor roughness of their own.
        _ => return Ok(()),
    };
    let texture = Arc::new(reduced(texture, parameter)?);
    let command = |objects: &[u64]| {
        let (objects, texture) = (objects.to_vec(), Arc::clone(&texture));
        Command::Scenery(SceneryCommand::Paint { objects, parameter, texture })
    };
    for objects in objects.chunks(OBJECTS_PER_COMMAND_MAX) {
        if let Some(Err(error)) = endpoint.run_now(vec![command(objects)]).await?.pop() {
            return Err(Refusal(error.to_string()));
        }
    }
    Ok(())
}

/// A texture with as many pixels as worlds take, each the mean of those in its place. Of light the
/// brightest is as bright as it was; colours end at white.
///
/// # Errors
/// Not as many pixels as the size says.
fn reduced<C: Linear>(
    texture: &Texture<C>,
    parameter: MaterialParameter,
) -> Result<schemas::Texture, Refusal> {
    let size = texture.size_px().ok_or_else(|| {
        Refusal("the texture has no pixels, or not as many as its width and height say".to_owned())
    })?;
    let less = size.map(|side| side.min(TEXTURE_SIDE_PX_MAX as usize));
    let span = |at: usize, axis: usize| {
        at * size[axis] / less[axis]..((at + 1) * size[axis]).div_ceil(less[axis])
    };
    let mut linear = Vec::with_capacity(less[0] * less[1]);
    for row in 0..less[1] {
        linear.extend((0..less[0]).map(|column| texture.mean(span(column, 0), span(row, 1))));
    }
    let brightness = match parameter {
        MaterialParameter::Diffuse => 1.0,
        MaterialParameter::Emissive => linear.as_flattened().iter().copied().fold(1.0, f32::max),
    };
    let rgb: Vec<u8> =
        linear.as_flattened().iter().map(|part| srgb((part / brightness).min(1.0))).collect();
    let size_px = less.map(|side| side as u32);
    schemas::Texture::new(size_px, brightness, &rgb).map_err(|error| Refusal(error.to_string()))
}

fn srgb(linear: f32) -> u8 {
    let part =
        if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (part * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture<C: Linear + serde::de::DeserializeOwned>(
        [width, height]: [u32; 2],
        pixel: impl Fn(u32, u32) -> [f32; 4],
    ) -> Texture<C> {
        let pixels: Vec<[f32; 4]> = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| pixel(column, row))
            .collect();
        let bytes = rmp_serde::to_vec(&(width, height, pixels)).unwrap();
        rmp_serde::from_slice(&bytes).unwrap()
    }

    fn of_bytes(size: [u32; 2], pixel: impl Fn(u32, u32) -> [u8; 4]) -> Texture<Colour> {
        let pixels: Vec<[u8; 4]> = (0..size[1])
            .flat_map(|row| (0..size[0]).map(move |column| (column, row)))
            .map(|(column, row)| pixel(column, row))
            .collect();
        let bytes = rmp_serde::to_vec(&(size[0], size[1], pixels)).unwrap();
        rmp_serde::from_slice(&bytes).unwrap()
    }

    #[test]
    fn a_small_texture_stays_as_it_is() {
        let given = of_bytes([16, 16], |column, row| [(16 * row + column) as u8, row as u8, 9, 0]);
        let kept = reduced(&given, MaterialParameter::Diffuse).unwrap();
        assert_eq!(kept.size_px(), [16, 16]);
        for (at, pixel) in kept.rgb().as_chunks::<3>().0.iter().enumerate() {
            assert_eq!(*pixel, [at as u8, (at / 16) as u8, 9]);
        }
    }

    #[test]
    fn of_a_large_one_the_mean_is_left() {
        // Columns by turns black and white, and half of them where three come on two.
        let given = of_bytes([2 * TEXTURE_SIDE_PX_MAX, 1], |column, _| {
            let part = if column % 2 == 0 { 0 } else { 255 };
            [part, part, part, 255]
        });
        let kept = reduced(&given, MaterialParameter::Diffuse).unwrap();
        assert_eq!(kept.size_px(), [TEXTURE_SIDE_PX_MAX, 1]);
        assert!(kept.rgb().iter().all(|part| *part == 188), "{:?}", &kept.rgb()[..9]);
    }

    #[test]
    fn light_may_be_brighter_than_white_and_colours_may_not() {
        let given: Texture<FloatColour> =
            texture([2, 1], |column, _| if column == 0 { [4.0, 2.0, 0.0, 1.0] } else { [0.5; 4] });
        let light = reduced(&given, MaterialParameter::Emissive).unwrap();
        assert_eq!((light.brightness(), &light.rgb()[..3]), (4.0, &[255, 188, 0][..]));
        let colour = reduced(&given, MaterialParameter::Diffuse).unwrap();
        assert_eq!((colour.brightness(), colour.rgb()), (1.0, &[255, 255, 0, 188, 188, 188][..]));
    }

    #[test]
    fn a_texture_without_all_of_its_pixels_is_refused() {
        let bytes = rmp_serde::to_vec(&(2, 2, vec![[1u8; 4]; 3])).unwrap();
        let given: Texture<Colour> = rmp_serde::from_slice(&bytes).unwrap();
        assert!(reduced(&given, MaterialParameter::Diffuse).is_err());
        let given = of_bytes([0, 0], |_, _| [0; 4]);
        assert!(reduced(&given, MaterialParameter::Diffuse).is_err());
    }
}
