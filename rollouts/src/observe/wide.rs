//! 1,847 numbers: the vehicle, its way, 63 others, 4 lights and 196 pieces of road.
//!
//! As many as the driving environments of self-play have, so that rates can be compared:
//! PufferLib's `drive` and GPUDrive have 6 of the vehicle, 63 × 7 of others and 200 × 7 of roads.
//! Places are clamped, as a vehicle may be anywhere; all else is within its bounds by what it is.

use roads::Map;
use schemas::TrafficLightColour as Colour;

use super::roads::Roads;
use super::{Column, View};
use crate::line::StopLine;

const EGO: usize = 2;
/// How far ahead along the way the points are, in metres.
const AHEAD_M: [f32; 2] = [15.0, 40.0];
const PARTNERS: usize = 63;
const LIGHTS: usize = 4;
const PIECES: usize = 196;
/// Columns of a partner, a light and a piece of road each.
const THING: usize = 7;
/// Others, lights and pieces farther from the vehicle's middle are not seen, but for pieces of
/// which a cell has as many as are shown within this and its own size.
const WITHIN_M: f32 = 50.0;

pub(super) const BLOCKS: [(&str, usize, usize); 5] = [
    ("ego", 1, EGO),
    ("route", AHEAD_M.len(), 2),
    ("partners", PARTNERS, THING),
    ("lights", LIGHTS, THING),
    ("road", PIECES, THING),
];

/// Scales of the columns of one thing; an offset, then a direction, then the rest.
type Scales = [f32; THING];

const METRES: f32 = 1.0 / 50.0;
const SPEED: f32 = 1.0 / 15.0;
const PARTNER_SCALES: Scales = [METRES, METRES, 1.0, 1.0, SPEED, 1.0 / 10.0, 1.0 / 5.0];
const LIGHT_SCALES: Scales = [METRES, METRES, 1.0, 1.0, 1.0, 1.0, 1.0];
const PIECE_SCALES: Scales = [METRES, METRES, 1.0, 1.0, 1.0 / 5.0, 1.0 / 5.0, 1.0 / 4.0];
const SPEED_MPS_MAX: f32 = 75.0;
const FAR_M: f32 = 200.0;

/// Writes rows for the worlds of one map.
#[derive(Debug)]
pub(super) struct Wide {
    roads: Roads,
    lines: Vec<StopLine>,
    speed: f32,
    road_wheel: f32,
    metres: f32,
    partner: Scales,
    light: Scales,
    piece: Scales,
}

pub(super) fn columns() -> Vec<Column> {
    let mut columns = vec![
        Column::new("ego.speed", "m/s", (-SPEED_MPS_MAX, SPEED_MPS_MAX), SPEED),
        Column::new("ego.road_wheel", "rad", (-1.5, 1.5), 1.0 / 0.6),
    ];
    for ahead_m in AHEAD_M {
        for axis in ["x", "y"] {
            let name = format!("route.{ahead_m}m.{axis}");
            columns.push(Column::new(name, "m", (-FAR_M, FAR_M), METRES));
        }
    }
    let far = (-FAR_M, FAR_M);
    let unit = (-1.0, 1.0);
    let share = (0.0, 1.0);
    let offset = [("x", "m", far), ("y", "m", far), ("cos", "", unit), ("sin", "", unit)];
    let partner = [("speed", "m/s", (0.0, SPEED_MPS_MAX)), ("length", "m", (0.0, 20.0))];
    let partner = partner.into_iter().chain([("width", "m", (0.0, 5.0))]);
    let light = ["red", "yellow", "green"].map(|colour| (colour, "", share));
    let piece = [("half_length", "m", (0.0, 50.0)), ("width", "m", (0.0, 50.0))];
    let piece = piece.into_iter().chain([("kind", "", (0.0, 4.0))]);
    let mut add = |name: &str, count: usize, rest: Vec<(&str, &'static str, _)>, scales: Scales| {
        for index in 0..count {
            let all = offset.into_iter().chain(rest.iter().copied()).zip(scales);
            columns.extend(all.map(|((column, unit, range), scale)| {
                Column::new(format!("{name}.{index}.{column}"), unit, range, scale)
            }));
        }
    };
    add("partners", PARTNERS, partner.collect(), PARTNER_SCALES);
    add("lights", LIGHTS, light.to_vec(), LIGHT_SCALES);
    add("road", PIECES, piece.collect(), PIECE_SCALES);
    columns
}

impl Wide {
    pub(super) fn new(map: &Map, lines: &[StopLine], normalise: bool) -> Self {
        let scales = |scales: Scales| if normalise { scales } else { [1.0; THING] };
        let scale = |scale: f32| if normalise { scale } else { 1.0 };
        Self {
            roads: Roads::new(map, PIECES),
            lines: lines.to_vec(),
            speed: scale(SPEED),
            road_wheel: scale(1.0 / 0.6),
            metres: scale(METRES),
            partner: scales(PARTNER_SCALES),
            light: scales(LIGHT_SCALES),
            piece: scales(PIECE_SCALES),
        }
    }

    /// - **Domain:** `row` is as wide as there are columns.
    pub(super) fn encode(&self, view: &View<'_>, row: &mut [f32]) {
        let (own, things) = row.split_at_mut(EGO + 2 * AHEAD_M.len());
        let speed_mps = view.motion.speed_mps.clamp(-SPEED_MPS_MAX, SPEED_MPS_MAX);
        own[0] = speed_mps * self.speed;
        own[1] = view.motion.road_wheel_rad.clamp(-1.5, 1.5) * self.road_wheel;
        for (point, ahead_m) in own[EGO..].chunks_exact_mut(2).zip(AHEAD_M) {
            let on_route = view.route.at(view.place.at_m + ahead_m);
            let (x_m, y_m) = view.seen(on_route.x_m, on_route.y_m);
            let near = |metres: f32| metres.clamp(-FAR_M, FAR_M) * self.metres;
            point.copy_from_slice(&[near(x_m), near(y_m)]);
        }
        let (partners, rest) = things.split_at_mut(PARTNERS * THING);
        let (lights, roads) = rest.split_at_mut(LIGHTS * THING);
        self.partners(view, partners);
        self.lights(view, lights);
        self.roads(view, roads);
    }

    /// In their order where there is a place for each, else the nearest.
    fn partners(&self, view: &View<'_>, places: &mut [f32]) {
        let mut kept = [(0.0_f32, 0_usize); PARTNERS];
        let mut count = 0;
        view.around(WITHIN_M, |away, index| {
            if count < PARTNERS {
                kept[count] = (away, index);
                count += 1;
                return;
            }
            let farthest = kept.iter_mut().max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some(place) = farthest.filter(|place| away < place.0) {
                *place = (away, index);
            }
        });
        let (used, free) = places.split_at_mut(count * THING);
        for (place, (_, index)) in used.chunks_exact_mut(THING).zip(&kept) {
            let other = &view.scene.everybody[*index];
            let along_mps = other.x_mps * other.cos + other.y_mps * other.sin;
            let rest = [along_mps.abs().min(SPEED_MPS_MAX), other.length_m, other.width_m];
            let at = ((other.x_m, other.y_m), (other.cos, other.sin));
            write(view, at, rest, &self.partner, place);
        }
        free.fill(0.0);
    }

    /// The nearest lines whose lights show anything.
    fn lights(&self, view: &View<'_>, places: &mut [f32]) {
        let colours = &view.scene.colours;
        places.fill(0.0);
        if colours.is_empty() {
            return;
        }
        let mut nearest: [(f32, usize); LIGHTS] = [(f32::INFINITY, 0); LIGHTS];
        for (index, line) in self.lines.iter().enumerate() {
            let (x, y) = (line.x_m - view.motion.x_m, line.y_m - view.motion.y_m);
            let away = x * x + y * y;
            if away < nearest[LIGHTS - 1].0.min(WITHIN_M * WITHIN_M) {
                let at = nearest.partition_point(|(nearer, _)| *nearer <= away);
                nearest[at..].rotate_right(1);
                nearest[at] = (away, index);
            }
        }
        let found = nearest.iter().filter(|(away, _)| away.is_finite());
        for (place, (_, index)) in places.chunks_exact_mut(THING).zip(found) {
            let line = &self.lines[*index];
            let colour = colours.get(line.light).copied().unwrap_or(Colour::Unknown);
            let rest = [Colour::Red, Colour::Yellow, Colour::Green]
                .map(|shown| f32::from(u8::from(colour == shown)));
            let at = ((line.x_m, line.y_m), (line.cos, line.sin));
            write(view, at, rest, &self.light, place);
        }
    }

    fn roads(&self, view: &View<'_>, places: &mut [f32]) {
        let mut places = places.chunks_exact_mut(THING);
        let pieces = self.roads.near(view.motion.x_m, view.motion.y_m);
        for (piece, place) in pieces.zip(places.by_ref()) {
            let rest = [piece.half_length_m, piece.width_m, piece.kind];
            let at = ((piece.x_m, piece.y_m), (piece.cos, piece.sin));
            write(view, at, rest, &self.piece, place);
        }
        places.for_each(|place| place.fill(0.0));
    }
}

/// Writes one thing: where it is and heads in the vehicle's frame, then the rest.
#[inline]
fn write(
    view: &View<'_>,
    ((x_m, y_m), (cos, sin)): ((f32, f32), (f32, f32)),
    rest: [f32; 3],
    scales: &Scales,
    place: &mut [f32],
) {
    let (x_m, y_m) = view.seen(x_m, y_m);
    let [x_m, y_m] = [x_m, y_m].map(|metres| metres.clamp(-FAR_M, FAR_M));
    let (cos, sin) = view.turned(cos, sin);
    let values = [x_m, y_m, cos, sin, rest[0], rest[1], rest[2]];
    for ((place, value), scale) in place.iter_mut().zip(values).zip(scales) {
        *place = value * scale;
    }
}
