//! Traffic lights and signs where they stand.

use std::collections::BTreeMap;

use super::canvas::{Canvas, Paint, Shapes};
use super::{Pixel, lettering};
use crate::Map;
use crate::signals::is_traffic_light;

/// Names and colours for the key.
pub(super) const KEY: &[(&str, &str)] =
    &[("light", LIGHT), ("stop", STOP), ("yield", YIELD), ("limit", LIMIT), ("sign", OTHER)];

const LIGHT: &str = "#18a558";
const STOP: &str = "#d0021b";
const YIELD: &str = "#ffd400";
const LIMIT: &str = "#fdfdfd";
const OTHER: &str = "#7a7fbf";
const INK: &str = "#202020";

/// Shapes of every kind of signal.
#[derive(Default)]
struct Signs {
    lights: Shapes,
    stops: Shapes,
    yields: Shapes,
    limits: Shapes,
    numbers: Shapes,
    others: Shapes,
}

/// Every signal once, also when it applies at several places.
pub(super) fn draw(map: &Map, canvas: &mut Canvas, pixel: Pixel) {
    let px = |pixels: f64| pixel.metres(pixels);
    let up_rad = std::f64::consts::FRAC_PI_2;
    let by_id: BTreeMap<&str, _> =
        map.landmarks().iter().map(|mark| (mark.id.as_str(), mark)).collect();
    let mut signs = Signs::default();
    for mark in by_id.values() {
        let at = [mark.pose.point.x, mark.pose.point.y];
        match mark.signal_type.as_str() {
            light if is_traffic_light(light) => signs.lights.ring(at, px(2.6), 12, 0.0),
            "206" => signs.stops.ring(at, px(3.2), 8, up_rad / 4.0),
            "205" => signs.yields.ring(at, px(3.6), 3, -up_rad),
            "274" => {
                signs.limits.ring(at, px(4.4), 16, 0.0);
                let height = px(3.6);
                let left = at[0] - lettering::width(&mark.subtype, height) / 2.0;
                signs.numbers.text(&mark.subtype, [left, at[1] - height / 2.0], height);
            }
            _ => signs.others.ring(at, px(2.2), 4, up_rad / 2.0),
        }
    }
    let ringed = |fill, stroke| Paint { stroke, width_m: px(0.8), ..Paint::fill(fill) };
    canvas.paint(&signs.others, ringed(OTHER, INK));
    canvas.paint(&signs.limits, ringed(LIMIT, STOP));
    canvas.paint(&signs.numbers, Paint::line(INK, px(0.6)));
    canvas.paint(&signs.stops, ringed(STOP, INK));
    canvas.paint(&signs.yields, ringed(YIELD, STOP));
    canvas.paint(&signs.lights, ringed(LIGHT, INK));
}
