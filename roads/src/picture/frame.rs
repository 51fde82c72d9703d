//! What is around the map: land, grid, title, key and scale bar.

use super::canvas::{Canvas, Paint, Shapes};
use super::{Pixel, lettering, roads, signs, things};

/// Height of the strip below the map in pixels, at least.
const FOOT_MIN_PX: f64 = 64.0;
/// Width of the title's column in pixels, at least.
const TITLE_WIDTH_PX: f64 = 240.0;
/// Distance between the rows of the key in pixels.
const ROW_PX: f64 = 16.0;
/// Distance of the lines of the grid in metres; more on maps where they would be too close.
const GRID_M: f64 = 100.0;
/// Lines of the grid are further apart, in pixels.
const GRID_PX: f64 = 40.0;
/// Most lines of the grid along either axis.
const LINES_MAX: f64 = 400.0;
/// Height of the letters of the title and of the others in pixels.
const TITLE_PX: f64 = 16.0;
const LABEL_PX: f64 = 7.0;
const INK: &str = "#202020";

fn key() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    roads::KEY.iter().chain(things::KEY).chain(signs::KEY)
}

/// Where the entries of the key begin: pixels from the left, and rows from the top.
fn key_places(name: &str, width_px: f64) -> Vec<[f64; 2]> {
    let left = 36.0 + lettering::width(name, TITLE_PX).max(TITLE_WIDTH_PX);
    let mut at = [left, 0.0];
    let mut places = Vec::new();
    for (label, _) in key() {
        let own_px = 18.0 + lettering::width(label, LABEL_PX) + 12.0;
        if at[0] + own_px > width_px && at[0] > left {
            at = [left, at[1] + 1.0];
        }
        places.push(at);
        at[0] += own_px;
    }
    places
}

/// Height of the strip below the map in pixels.
pub(super) fn foot_px(name: &str, width_px: u32) -> f64 {
    let rows = key_places(name, f64::from(width_px)).last().map_or(1.0, |[_, row]| row + 1.0);
    FOOT_MIN_PX.max(22.0 + rows * ROW_PX)
}

/// Lawn with a grid and its coordinates.
pub(super) fn land(canvas: &mut Canvas, [min, max]: [[f64; 2]; 2], pixel: Pixel, foot_m: f64) {
    let rectangle = |low: [f64; 2], high: [f64; 2]| {
        let mut shapes = Shapes::default();
        shapes.polygon(&[low, [high[0], low[1]], high, [low[0], high[1]]]);
        shapes
    };
    canvas.paint(&rectangle([min[0], min[1] - foot_m], max), Paint::fill("#ffffff"));
    canvas.paint(&rectangle(min, max), Paint::fill("#dde5d0"));
    let mut step_m = GRID_M;
    let longest_m = (max[0] - min[0]).max(max[1] - min[1]);
    while step_m < pixel.metres(GRID_PX) || step_m < longest_m / LINES_MAX {
        step_m *= 2.0;
    }
    let (mut lines, mut numbers) = (Shapes::default(), Shapes::default());
    let label_m = pixel.metres(LABEL_PX);
    for axis in 0..2 {
        let mut at_m = (min[axis] / step_m).ceil() * step_m;
        // Where numbers are so large that a step is lost in them, there is no grid.
        while at_m < max[axis] && at_m + step_m > at_m {
            let label = format!("{at_m:.0}");
            if axis == 0 {
                lines.polyline(&[[at_m, min[1]], [at_m, max[1]]]);
                numbers.text(&label, [at_m + label_m / 2.0, max[1] - 1.5 * label_m], label_m);
            } else {
                lines.polyline(&[[min[0], at_m], [max[0], at_m]]);
                numbers.text(&label, [min[0] + label_m / 2.0, at_m + label_m / 2.0], label_m);
            }
            at_m += step_m;
        }
    }
    canvas.paint(&lines, Paint::line("#c4cfb4", pixel.metres(0.8)));
    canvas.paint(&numbers, Paint::line("#7f8a70", pixel.metres(0.9)));
}

/// Title, scale bar and the meaning of the colours.
pub(super) fn caption(name: &str, canvas: &mut Canvas, [min, max]: [[f64; 2]; 2], pixel: Pixel) {
    let px = |pixels: f64| pixel.metres(pixels);
    let top = min[1];
    let mut title = Shapes::default();
    title.text(name, [min[0] + px(12.0), top - px(27.0)], px(TITLE_PX));
    canvas.paint(&title, Paint::line(INK, px(2.0)));
    scale_bar(canvas, [min[0] + px(12.0), top - px(44.0)], max[0] - min[0], pixel);
    let places = key_places(name, (max[0] - min[0]) / px(1.0));
    for ((label, paint), [left, row]) in key().zip(places) {
        let mut swatch = Shapes::default();
        let (x, y) = (min[0] + px(left), top - px(22.0 + row * ROW_PX));
        let (right, high) = (x + px(12.0), y + px(LABEL_PX));
        swatch.polygon(&[[x, y], [right, y], [right, high], [x, high]]);
        canvas.paint(&swatch, Paint { stroke: INK, width_m: px(0.5), ..Paint::fill(paint) });
        let mut text = Shapes::default();
        text.text(label, [x + px(17.0), y], px(LABEL_PX));
        canvas.paint(&text, Paint::line(INK, px(0.9)));
    }
}

/// A bar of a round length, at most a fifth of the picture and 200 pixels.
fn scale_bar(canvas: &mut Canvas, [x, y]: [f64; 2], width_m: f64, pixel: Pixel) {
    let longest_m = (width_m / 5.0).min(pixel.metres(200.0));
    let mut length_m = 1.0;
    for factor in [2.0, 2.5, 2.0].into_iter().cycle().take(18) {
        if length_m * factor > longest_m {
            break;
        }
        length_m *= factor;
    }
    let tick_m = pixel.metres(4.0);
    let mut bar = Shapes::default();
    bar.polyline(&[[x, y + tick_m], [x, y], [x + length_m, y], [x + length_m, y + tick_m]]);
    let label_at = [x + length_m + pixel.metres(6.0), y];
    bar.text(&format!("{length_m:.0} m"), label_at, pixel.metres(LABEL_PX));
    canvas.paint(&bar, Paint::line(INK, pixel.metres(1.2)));
}
