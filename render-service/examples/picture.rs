//! Draws a street of a town into a JPEG file:
//! `cargo run --release -p render-service --example picture -- TOWN FILE SPAWN_POINT WEATHER VIEW
//! KIND ADAPTER QUALITY`, e.g. `Town10HD_Opt picture.jpg 0 sunset above rgb cpu low`. Everything
//! may be left out from the right. Kinds are `rgb`, `depth`, `semantic`, `instance`, `normals`; all
//! but the first are made visible.

mod street;

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use render_service::{AdapterChoice, Renderer, TownScene};
use schemas::{Camera, Image, ImageEncoding, ImageKind, PictureQuality, RenderJob};
use street::{camera, street, weather_of};
use turbojpeg::{PixelFormat, Subsamp};

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "Town10HD_Opt".to_owned());
    let file = args.next().unwrap_or_else(|| "picture.jpg".to_owned());
    let spawn_point: usize = args.next().map_or(Ok(0), |text| text.parse())?;
    let (weather, view) = (args.next().unwrap_or_default(), args.next().unwrap_or_default());
    let kind = kind_of(&args.next().unwrap_or_default())?;
    let adapter = args.next().unwrap_or_default();
    let quality = (args.next().as_deref() == Some("low")).then_some(PictureQuality::Low);

    let text = match roads::town::build(&name) {
        Some(text) => text,
        None => std::fs::read_to_string(&name)?,
    };
    let map = roads::Map::parse(&name, &text)?;
    let town = Arc::new(TownScene::of_map(&map));
    let start = map.spawn_points().get(spawn_point).ok_or("no such spawn point")?.cast();
    let mut renderer = Renderer::new(AdapterChoice::parse(&adapter))?;
    println!("{} triangles, drawn by {}", town.triangle_count(), renderer.adapter_name());

    let job = RenderJob {
        tenant: "local".parse()?,
        frame: street(&map, start, weather_of(&weather), view == "parade"),
        cameras: vec![Camera { quality, ..camera(&view, kind) }],
        staging: schemas::Staging::default(),
    };
    // The first picture also uploads the town.
    for _ in 0..3 {
        let begun = Instant::now();
        let images = renderer.render(&[(Arc::clone(&town), &job)]).remove(0)?;
        println!("drawn in {:?}", begun.elapsed());
        std::fs::write(&file, visible(images.images.first().ok_or("no picture")?)?)?;
    }
    Ok(())
}

fn kind_of(name: &str) -> Result<ImageKind, String> {
    Ok(match name {
        "" | "rgb" => ImageKind::Rgb,
        "depth" => ImageKind::Depth,
        "semantic" => ImageKind::Semantic,
        "instance" => ImageKind::Instance,
        "normals" => ImageKind::Normals,
        other => return Err(format!("no kind {other:?}")),
    })
}

/// A JPEG that shows a picture of any kind.
fn visible(image: &Image) -> Result<Vec<u8>, Box<dyn Error>> {
    let grey = |value: f32| [(value.clamp(0.0, 1.0) * 255.0) as u8; 3];
    let pixels: Vec<u8> = match image.encoding {
        ImageEncoding::DepthF32 => {
            let (metres, _) = image.data.as_chunks::<4>();
            let nearness = |raw: &[u8; 4]| 1.0 - f32::from_le_bytes(*raw).ln() / 1_000f32.ln();
            metres.iter().flat_map(|raw| grey(nearness(raw))).collect()
        }
        ImageEncoding::TagU8 => image.data.iter().flat_map(|tag| hue(u32::from(*tag))).collect(),
        ImageEncoding::TagIdU32 => {
            let (labels, _) = image.data.as_chunks::<4>();
            labels.iter().flat_map(|label| hue(u32::from_le_bytes(*label))).collect()
        }
        ImageEncoding::NormalI8 => image.data.iter().map(|part| part.wrapping_add(128)).collect(),
        ImageEncoding::Jpeg | ImageEncoding::Rgba8 => return Ok(image.data.clone()),
    };
    let (width, height) = (image.width_px as usize, image.height_px as usize);
    let (pitch, format) = (width * 3, PixelFormat::RGB);
    let image = turbojpeg::Image { pixels: pixels.as_slice(), width, pitch, height, format };
    Ok(turbojpeg::compress(image, 95, Subsamp::None)?.to_vec())
}

/// A colour that neighbouring numbers do not share.
fn hue(number: u32) -> [u8; 3] {
    let mixed = number.wrapping_mul(0x9e37_79b1) ^ (number >> 8).wrapping_mul(0x85eb_ca6b);
    let [r, g, b, _] = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d).to_le_bytes();
    [r, g, b]
}
