//! SVG text, written shape by shape.

use std::fmt::Write;

use super::lettering;

/// How a shape is painted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Paint {
    /// Colour inside, e.g. `#808080`; empty for none.
    pub(super) fill: &'static str,
    /// Colour of the outline; empty for none.
    pub(super) stroke: &'static str,
    /// Width of the outline in metres.
    pub(super) width_m: f64,
    /// Length of dashes and of the gaps between them in metres; 0 for an unbroken line.
    pub(super) dash_m: f64,
    /// Share of what lies below that is hidden.
    pub(super) opacity: Option<f64>,
}

impl Paint {
    pub(super) const fn fill(fill: &'static str) -> Self {
        Self { fill, stroke: "", width_m: 0.0, dash_m: 0.0, opacity: None }
    }

    pub(super) const fn line(stroke: &'static str, width_m: f64) -> Self {
        Self { fill: "", stroke, width_m, dash_m: 0.0, opacity: None }
    }
}

/// Shapes that are painted alike, collected into one `path`.
#[derive(Debug, Default)]
pub(super) struct Shapes(String);

impl Shapes {
    /// Adds a polygon; fewer than three corners add nothing.
    pub(super) fn polygon(&mut self, corners: &[[f64; 2]]) {
        if corners.len() > 2 {
            self.polyline(corners);
            self.0.push('Z');
        }
    }

    /// Adds a line through points; fewer than two add nothing.
    pub(super) fn polyline(&mut self, points: &[[f64; 2]]) {
        if points.len() < 2 {
            return;
        }
        for (index, [x, y]) in points.iter().enumerate() {
            let command = if index == 0 { 'M' } else { 'L' };
            // North is up in the map and down in the picture.
            self.0.push(command);
            self.number(*x);
            self.0.push(' ');
            self.number(-*y);
        }
    }

    /// Adds a regular polygon around a place; many corners make a circle.
    pub(super) fn ring(&mut self, at: [f64; 2], radius_m: f64, corners: u32, turn_rad: f64) {
        let corner = |k: u32| {
            let angle_rad = turn_rad + std::f64::consts::TAU * f64::from(k) / f64::from(corners);
            let (sin, cos) = angle_rad.sin_cos();
            [at[0] + radius_m * cos, at[1] + radius_m * sin]
        };
        self.polygon(&(0..corners).map(corner).collect::<Vec<_>>());
    }

    /// Adds a text whose lower left corner is at a place.
    pub(super) fn text(&mut self, text: &str, at: [f64; 2], height_m: f64) {
        for line in lettering::lines(text, at, height_m) {
            self.polyline(&line);
        }
    }

    /// Centimetres, without trailing zeros.
    fn number(&mut self, value: f64) {
        let text = format!("{value:.2}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        self.0.push_str(if text == "-0" { "0" } else { text });
    }
}

/// A picture that grows from back to front.
#[derive(Debug)]
pub(super) struct Canvas(String);

impl Canvas {
    /// A picture of the land between two corners, `width_px` wide.
    pub(super) fn new(min: [f64; 2], max: [f64; 2], width_px: u32) -> Self {
        let size = [max[0] - min[0], max[1] - min[1]];
        let height_px = (f64::from(width_px) * size[1] / size[0]).ceil();
        let mut canvas = Self(String::with_capacity(1 << 20));
        canvas.write(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px}\" height=\"{height_px}\" \
             viewBox=\"{:.2} {:.2} {:.2} {:.2}\">\n",
            min[0], -max[1], size[0], size[1]
        ));
        canvas
    }

    /// Paints shapes; none paint nothing.
    pub(super) fn paint(&mut self, shapes: &Shapes, paint: Paint) {
        if shapes.0.is_empty() {
            return;
        }
        let named = |colour| if str::is_empty(colour) { "none" } else { colour };
        self.write(format_args!("<path fill=\"{}\"", named(paint.fill)));
        if !paint.stroke.is_empty() {
            self.write(format_args!(
                " stroke=\"{}\" stroke-width=\"{:.2}\" stroke-linejoin=\"round\"",
                paint.stroke, paint.width_m
            ));
        }
        if paint.dash_m > 0.0 {
            self.write(format_args!(" stroke-dasharray=\"{:.2}\"", paint.dash_m));
        }
        if let Some(opacity) = paint.opacity {
            self.write(format_args!(" opacity=\"{opacity:.2}\""));
        }
        self.write(format_args!(" d=\"{}\"/>\n", shapes.0));
    }

    /// The finished text.
    pub(super) fn finish(mut self) -> String {
        self.0.push_str("</svg>\n");
        self.0
    }

    fn write(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail; the error type of the trait is for other targets.
        let _: Result<(), std::fmt::Error> = self.0.write_fmt(text);
    }
}
