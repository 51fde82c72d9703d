//! A map drawn from above, as SVG text.

mod canvas;
mod frame;
mod lettering;
mod roads;
mod signs;
mod things;

use canvas::Canvas;

use crate::Map;

/// Land around the lanes that is drawn, in metres.
const MARGIN_M: f64 = 40.0;
/// Smallest and largest width of a picture in pixels.
const WIDTH_PX: [u32; 2] = [200, 10_000];

/// One pixel of the picture in metres, so that lines and letters keep their size in the picture
/// whatever the size of the map.
#[derive(Clone, Copy, Debug)]
struct Pixel(f64);

impl Pixel {
    fn metres(self, pixels: f64) -> f64 {
        self.0 * pixels
    }
}

/// Draws a map: lanes by type with their lines and directions, junctions with their ids,
/// crosswalks, scenery, signals, spawn points with their index where there is room for it, a grid
/// of 100 m and a scale bar.
///
/// - **Frame:** east is right, north is up. The numbers at the grid are the map's coordinates;
///   CARLA's y has the other sign.
/// - **Domain:** widths below 200 and above 10,000 pixels are taken as these.
/// - **Determinism:** the same map and width give the same bytes.
#[must_use]
pub fn draw(map: &Map, width_px: u32) -> String {
    draw_with_caption(map, width_px, width_px)
}

/// The same, with the grid's numbers, title, key and scale bar as large as in a picture of another
/// width: that in which who looks closer at parts of this one sees the whole of it.
#[must_use]
pub fn draw_with_caption(map: &Map, width_px: u32, caption_px: u32) -> String {
    let [width_px, caption_px] =
        [width_px, caption_px].map(|width_px| width_px.clamp(WIDTH_PX[0], WIDTH_PX[1]));
    let bounds = map.bounds().map_or([[0.0; 2]; 2], |(min, max)| [min, max].map(|p| [p.x, p.y]));
    let [min, max] = [bounds[0].map(|v| v - MARGIN_M), bounds[1].map(|v| v + MARGIN_M)];
    let pixel_of = |width_px: u32| Pixel((max[0] - min[0]) / f64::from(width_px));
    let (pixel, caption) = (pixel_of(width_px), pixel_of(caption_px));
    let foot_m = caption.metres(frame::foot_px(map.name(), caption_px));
    let mut canvas = Canvas::new([min[0], min[1] - foot_m], max, width_px);
    frame::land(&mut canvas, [min, max], caption, foot_m);
    things::on_the_ground(map, &mut canvas);
    roads::draw(map, &mut canvas, pixel);
    things::standing(map, &mut canvas, pixel);
    signs::draw(map, &mut canvas, pixel);
    frame::caption(map.name(), &mut canvas, [min, max], caption);
    canvas.finish()
}
