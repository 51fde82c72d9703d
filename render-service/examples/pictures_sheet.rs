//! Draws one street by hours and weathers into a JPEG, side by side: `cargo run --release -p
//! render-service --example pictures_sheet -- FILE ADAPTER`. Columns are noon, sunset, rain, night
//! and a rainy night, then fog; rows are a driver's view and one from above, each at high and at
//! low quality, a row of vehicles, and another town.

mod street;

use std::error::Error;
use std::sync::Arc;

use render_service::{AdapterChoice, Renderer, TownScene};
use schemas::{Camera, Image, ImageEncoding, ImageKind, PictureQuality, RenderJob, Staging};
use street::{camera, street, weather_of};
use turbojpeg::{PixelFormat, Subsamp};

const WEATHERS: [&str; 6] = ["noon", "sunset", "rain", "night", "rainy night", "fog"];
/// Town, spawn point, view, quality.
const ROWS: [(&str, usize, &str, PictureQuality); 6] = [
    ("Town10HD_Opt", 0, "", PictureQuality::High),
    ("Town10HD_Opt", 0, "", PictureQuality::Low),
    ("Town10HD_Opt", 0, "above", PictureQuality::High),
    ("Town10HD_Opt", 0, "above", PictureQuality::Low),
    ("Town10HD_Opt", 0, "parade", PictureQuality::High),
    ("Town02", 4, "", PictureQuality::High),
];
const TILE_PX: (u32, u32) = (400, 225);
const GAP_PX: usize = 4;
const JPEG_QUALITY: i32 = 72;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let file = args.next().unwrap_or_else(|| "pictures.jpg".to_owned());
    let mut renderer = Renderer::new(AdapterChoice::parse(&args.next().unwrap_or_default()))?;
    println!("drawn by {}", renderer.adapter_name());
    let mut sheet = Sheet::new(WEATHERS.len(), ROWS.len());
    for (row, (name, spawn_point, view, quality)) in ROWS.into_iter().enumerate() {
        let map = roads::Map::parse(name, &roads::town::build(name).ok_or("no such town")?)?;
        let town = Arc::new(TownScene::of_map(&map));
        let start = map.spawn_points().get(spawn_point).ok_or("no such spawn point")?.cast();
        for (column, weather) in WEATHERS.into_iter().enumerate() {
            let camera = Camera {
                width_px: TILE_PX.0,
                height_px: TILE_PX.1,
                encoding: ImageEncoding::Rgba8,
                quality: Some(quality),
                ..camera(view, ImageKind::Rgb)
            };
            let job = RenderJob {
                tenant: "local".parse()?,
                frame: street(&map, start, weather_of(weather), view == "parade"),
                cameras: vec![camera],
                staging: Staging::default(),
            };
            let images = renderer.render(&[(Arc::clone(&town), &job)]).remove(0)?;
            sheet.put(column, row, images.images.first().ok_or("no picture")?);
        }
    }
    std::fs::write(&file, sheet.jpeg()?)?;
    Ok(())
}

/// Tiles beside each other on white.
struct Sheet {
    width: usize,
    pixels: Vec<[u8; 4]>,
}

impl Sheet {
    fn new(columns: usize, rows: usize) -> Self {
        let side = |count: usize, tile: u32| count * (tile as usize + GAP_PX) - GAP_PX;
        let (width, height) = (side(columns, TILE_PX.0), side(rows, TILE_PX.1));
        Self { width, pixels: vec![[255; 4]; width * height] }
    }

    fn put(&mut self, column: usize, row: usize, image: &Image) {
        let left = column * (TILE_PX.0 as usize + GAP_PX);
        let top = row * (TILE_PX.1 as usize + GAP_PX);
        let (pixels, _) = image.data.as_chunks::<4>();
        for (at, line) in pixels.chunks(TILE_PX.0 as usize).enumerate() {
            let first = (top + at) * self.width + left;
            if let Some(slot) = self.pixels.get_mut(first..first + line.len()) {
                slot.copy_from_slice(line);
            }
        }
    }

    fn jpeg(&self) -> Result<Vec<u8>, turbojpeg::Error> {
        let (width, height) = (self.width, self.pixels.len() / self.width);
        let pixels = self.pixels.as_flattened();
        let (pitch, format) = (width * 4, PixelFormat::RGBX);
        let image = turbojpeg::Image { pixels, width, pitch, height, format };
        Ok(turbojpeg::compress(image, JPEG_QUALITY, Subsamp::Sub2x2)?.to_vec())
    }
}
