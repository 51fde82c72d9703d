//! The middles of all lanes as cubics in one table, so that a pose is a look-up and no sum.
//!
//! A lane's middle is the lane offset and the widths of all lanes up to it. Between the starts of
//! any of their records that sum is one cubic; so is the height.

use crate::geometry::{Coefficients, Geometry, evaluate};
use crate::lanes::{LaneEntry, LaneIndex, LanePose, LaneTable, direction, parts, placed};
use crate::model::{Model, Road, Section};

/// Where a stretch of a lane begins on which no record does.
#[derive(Clone, Copy, Debug)]
struct Start {
    s: f64,
    /// Position among the geometries of all roads.
    geometry: u32,
}

/// How a stretch goes on from its start: one line of the processor's cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Stretch {
    /// Left of the reference line, in metres.
    middle: Coefficients,
    height: Coefficients,
}

/// The stretches of all lanes, with all a pose needs in as few steps as possible.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    /// Those of all roads, one after another.
    geometries: Vec<Geometry>,
    stretches: Vec<Stretch>,
    /// Of every stretch: looking for one must not touch them all.
    starts: Vec<Start>,
    /// Where each lane's stretches begin, and at last where all end.
    firsts: Vec<u32>,
}

impl Shapes {
    #[allow(clippy::cast_possible_truncation, reason = "there are fewer records than XML nodes")]
    pub(crate) fn new(model: &Model, table: &LaneTable) -> Self {
        let mut shapes = Self::default();
        let mut first_of_road = Vec::with_capacity(model.roads.len());
        for road in &model.roads {
            first_of_road.push(shapes.geometries.len() as u32);
            shapes.geometries.extend(road.geometries.iter().cloned());
        }
        let mut own = Vec::new();
        for entry in &table.lanes {
            shapes.firsts.push(shapes.starts.len() as u32);
            let Some((road, section, _)) = parts(model, entry) else { continue };
            collect_starts(road, section, entry.lane_id, &mut own);
            let first = first_of_road.get(entry.road as usize).copied().unwrap_or_default();
            let geometry = |s| first + road.geometry_index(s) as u32;
            shapes.starts.extend(own.iter().map(|s| Start { s: *s, geometry: geometry(*s) }));
        }
        shapes.firsts.push(shapes.starts.len() as u32);
        shapes.stretches.reserve_exact(shapes.starts.len());
        for (entry, range) in table.lanes.iter().zip(shapes.firsts.windows(2)) {
            let &[first, end] = range else { continue };
            let Some((road, section, _)) = parts(model, entry) else { continue };
            let own = shapes.starts.get(first as usize..end as usize).unwrap_or_default();
            shapes.stretches.extend(own.iter().map(|start| stretch(road, section, entry, start.s)));
        }
        shapes
    }

    /// Lateral place and slope of a lane's middle at a place within its section.
    pub(crate) fn middle(&self, lane: LaneIndex, s: f64) -> Option<(f64, f64)> {
        let (start, stretch) = self.stretch(lane, s)?;
        Some(evaluate(stretch.middle, s - start.s))
    }

    /// The middle of a lane at a place within its section; `None` elsewhere.
    #[inline]
    pub(crate) fn pose(&self, entry: &LaneEntry, lane: LaneIndex, s: f64) -> Option<LanePose> {
        if !(entry.start_s..=entry.end_s).contains(&s) {
            return None;
        }
        let (start, stretch) = self.stretch(lane, s)?;
        let geometry = self.geometries.get(start.geometry as usize)?;
        let (reference, along) = geometry.at_with_direction(s - geometry.start_s);
        let t = s - start.s;
        let (middle, height) = (evaluate(stretch.middle, t), evaluate(stretch.height, t));
        Some(direction(placed(reference, along, middle, height), entry.sign))
    }

    #[inline]
    fn stretch(&self, lane: LaneIndex, s: f64) -> Option<(&Start, &Stretch)> {
        let first = *self.firsts.get(lane as usize)? as usize;
        let end = *self.firsts.get(lane as usize + 1)? as usize;
        let starts = self.starts.get(first..end)?;
        let own = starts.partition_point(|start| start.s <= s).saturating_sub(1);
        Some((starts.get(own)?, self.stretches.get(first + own)?))
    }
}

/// Where records begin that move the lane, from the start of its section to the end.
fn collect_starts(road: &Road, section: &Section, lane_id: i32, starts: &mut Vec<f64>) {
    starts.clear();
    starts.push(section.start_s);
    let inner = section.lanes.iter().filter(|lane| {
        lane.id.signum() == lane_id.signum() && lane.id.abs() <= lane_id.abs() && lane.id != 0
    });
    let records = inner.flat_map(|lane| &lane.width.0);
    let records = records.chain(&road.elevation.0).chain(&road.lane_offset.0);
    let geometries = road.geometries.iter().map(|geometry| geometry.start_s);
    let inside = |s: &f64| *s > section.start_s && *s <= section.end_s;
    starts.extend(records.map(|record| record.start_s).chain(geometries).filter(inside));
    starts.sort_by(f64::total_cmp);
    starts.dedup();
}

fn stretch(road: &Road, section: &Section, entry: &LaneEntry, start_s: f64) -> Stretch {
    let sign = f64::from(entry.lane_id.signum());
    let mut middle = road.lane_offset.cubic_within(start_s, section.end_s);
    for lane in &section.lanes {
        let is_inner = lane.id != 0
            && lane.id.signum() == entry.lane_id.signum()
            && lane.id.abs() <= entry.lane_id.abs();
        if is_inner {
            let share = if lane.id == entry.lane_id { sign / 2.0 } else { sign };
            middle = middle.plus(&lane.width.cubic_at(start_s), share);
        }
    }
    let height = road.elevation.cubic_at(start_s);
    Stretch { middle: middle.coefficients(), height: height.coefficients() }
}
