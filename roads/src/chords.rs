//! Lanes cut into straight pieces, as the client library cuts them for its projection.

use nalgebra::{Point3, Vector3};

use crate::arc::{PlanPose, unit};
use crate::geometry::Shape;
use crate::lanes::{LaneEntry, LaneIndex, LaneTable, direction, parts, placed, sign};
use crate::model::{Model, Road, Section};
use crate::shapes::Shapes;

/// Places at the very end of a lane belong to the next one.
const END_GAP_M: f64 = 1e-6;
const STEP_M: f64 = 1.0;
const CHORD_LENGTH_MAX_M: f64 = 100.0;
const TURN_MAX_RAD: f64 = 1.8 * std::f64::consts::PI / 180.0;

/// A straight piece of a lane's middle line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chord {
    pub(crate) from: Point3<f64>,
    pub(crate) to: Point3<f64>,
    from_s: f64,
    to_s: f64,
    pub(crate) lane: LaneIndex,
    pub(crate) type_bits: u32,
}

impl Chord {
    /// Squared distance of `point`.
    pub(crate) fn distance2(&self, point: &Point3<f64>) -> f64 {
        let along = self.to - self.from;
        let length2 = along.norm_squared();
        let rate = if length2 > 0.0 {
            ((point - self.from).dot(&along) / length2).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (point - (self.from + along * rate)).norm_squared()
    }

    /// How far along the chord the foot of `point` lies, both seen from above: the client looks
    /// for the nearest chord in space, and for the place on it in the plane.
    pub(crate) fn along_m(&self, point: &Point3<f64>) -> f64 {
        let along = (self.to - self.from).xy();
        let length2 = along.norm_squared();
        if length2 > 0.0 {
            ((point - self.from).xy().dot(&along) / length2).clamp(0.0, 1.0) * length2.sqrt()
        } else {
            0.0
        }
    }

    /// The road coordinates of its ends, in travel direction.
    pub(crate) fn ends_s(&self) -> [f64; 2] {
        [self.from_s, self.to_s]
    }

    /// The road coordinate `along_m` after the chord's start in travel direction.
    pub(crate) fn s_after(&self, along_m: f64) -> f64 {
        let (low, high) = (self.from_s.min(self.to_s), self.from_s.max(self.to_s));
        let s =
            if self.to_s >= self.from_s { self.from_s + along_m } else { self.from_s - along_m };
        s.clamp(low, high)
    }
}

/// Cuts all lanes into chords, each in travel direction.
pub(crate) fn chords(model: &Model, table: &LaneTable, shapes: &Shapes) -> Vec<Chord> {
    let mut chords = Vec::with_capacity(table.lanes.len());
    let mut line = Line::default();
    let mut of = None;
    for (index, entry) in (0..).zip(&table.lanes) {
        let Some((road, section, lane)) = parts(model, entry) else { continue };
        if entry.lane_id == 0 || entry.length_m() <= 0.0 {
            continue;
        }
        if of != Some((entry.road, entry.section, entry.forward)) {
            of = Some((entry.road, entry.section, entry.forward));
            line.follow(road, section, entry);
        }
        let mut places = line.places.iter().filter_map(|place| {
            let middle = shapes.middle(index, place.s)?;
            Some(place.on_lane(middle, entry.forward))
        });
        let Some(mut from) = places.next() else { continue };
        for here in places {
            let turned = from.direction.dot(&here.direction) < TURN_MAX_RAD.cos();
            if here.is_last || turned || here.m - from.m > CHORD_LENGTH_MAX_M {
                chords.push(Chord {
                    from: from.point,
                    to: here.point,
                    from_s: from.s,
                    to_s: here.s,
                    lane: index,
                    type_bits: lane.lane_type as u32,
                });
                from = here;
            }
        }
    }
    chords
}

/// The reference line of a section in one direction of travel. Its lanes share it: it is most of
/// what a place on a lane takes to compute.
#[derive(Default)]
struct Line {
    places: Vec<Place>,
}

/// A place on the reference line.
struct Place {
    s: f64,
    /// Way from the start, in travel direction.
    m: f64,
    is_last: bool,
    reference: PlanPose,
    /// Sine and cosine of its heading.
    along: [f64; 2],
    /// Height and grade.
    height: (f64, f64),
}

/// A place in the middle of a lane, in travel direction.
struct LanePlace {
    s: f64,
    m: f64,
    is_last: bool,
    point: Point3<f64>,
    direction: Vector3<f64>,
}

impl Line {
    fn follow(&mut self, road: &Road, section: &Section, entry: &LaneEntry) {
        let length_m = entry.length_m();
        let end_m = (length_m - END_GAP_M).max(0.0);
        let place = |m: f64, is_last: bool| {
            let s = if entry.forward { entry.start_s + m } else { entry.end_s - m };
            let (reference, along) = road.reference_with_direction(s);
            Place { s, m, is_last, reference, along, height: road.elevation.at(s) }
        };
        let is_straight = is_straight(road, section);
        self.places.clear();
        let mut at_m = END_GAP_M.min(length_m / 2.0);
        self.places.push(place(at_m, false));
        while at_m + STEP_M < end_m && !is_straight {
            at_m += STEP_M;
            self.places.push(place(at_m, false));
        }
        self.places.push(place(end_m, true));
    }
}

/// Whether one chord stands for the whole section: straight reference line, grades without bend.
fn is_straight(road: &Road, section: &Section) -> bool {
    let first = road.geometry_index(section.start_s);
    road.geometries.get(first).is_some_and(|geometry| {
        geometry.shape == Shape::Line && geometry.start_s + geometry.length_m >= section.end_s
    }) && road.elevation.is_linear()
}

impl Place {
    fn on_lane(&self, middle: (f64, f64), forward: bool) -> LanePlace {
        let pose = placed(self.reference, self.along, middle, self.height);
        let turned = if middle.1 == 0.0 { self.along } else { unit(pose.heading_rad) };
        let pose = direction(pose, sign(forward));
        let [sin, cos] = turned.map(|v| if forward { v } else { -v });
        let level = pose.pitch_rad == 0.0;
        let (sin_pitch, cos_pitch) = if level { (0.0, 1.0) } else { pose.pitch_rad.sin_cos() };
        LanePlace {
            s: self.s,
            m: self.m,
            is_last: self.is_last,
            point: pose.point,
            direction: Vector3::new(cos * cos_pitch, sin * cos_pitch, sin_pitch),
        }
    }
}
