//! The middles of all lanes as cubics in one table, so that a pose is a look-up and no sum.
//!
//! A lane's middle is the lane offset and the widths of all lanes up to it. Between the starts of
//! any of their records that sum is one cubic; so is the height.

use crate::geometry::Cubic;
use crate::lanes::{LaneEntry, LaneIndex, LanePose, LaneTable, direction, placed};
use crate::model::{Model, Road, Section};

/// A stretch of a lane on which nothing begins; all counts from `start_s`.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    start_s: f64,
    /// Left of the reference line, in metres.
    middle: Cubic,
    height: Cubic,
    /// Position among the road's geometries.
    geometry: u32,
}

/// The stretches of all lanes.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    stretches: Vec<Stretch>,
    /// Where each lane's stretches begin, and at last where all end.
    firsts: Vec<u32>,
}

impl Shapes {
    #[allow(clippy::cast_possible_truncation, reason = "there are fewer records than XML nodes")]
    pub(crate) fn new(model: &Model, table: &LaneTable) -> Self {
        let mut shapes = Self::default();
        let mut starts = Vec::new();
        for entry in &table.lanes {
            shapes.firsts.push(shapes.stretches.len() as u32);
            let Some(road) = model.roads.get(entry.road as usize) else { continue };
            let Some(section) = road.sections.get(entry.section as usize) else { continue };
            collect_starts(road, section, entry.lane_id, &mut starts);
            shapes.stretches.extend(starts.iter().map(|s| stretch(road, section, entry, *s)));
        }
        shapes.firsts.push(shapes.stretches.len() as u32);
        shapes
    }

    /// The middle of a lane at a place within its section; `None` elsewhere.
    pub(crate) fn pose(
        &self,
        road: &Road,
        entry: &LaneEntry,
        lane: LaneIndex,
        s: f64,
    ) -> Option<LanePose> {
        if !(entry.start_s..=entry.end_s).contains(&s) {
            return None;
        }
        let first = *self.firsts.get(lane as usize)? as usize;
        let end = *self.firsts.get(lane as usize + 1)? as usize;
        let own = self.stretches.get(first..end)?;
        let stretch = own.get(own.partition_point(|one| one.start_s <= s).saturating_sub(1))?;
        let geometry = road.geometries.get(stretch.geometry as usize)?;
        let along_s = s.clamp(0.0, road.length_m);
        let (reference, unit) = geometry.at_with_direction(along_s - geometry.start_s);
        let middle = (stretch.middle.value(s), stretch.middle.slope(s));
        let height = (stretch.height.value(s), stretch.height.slope(s));
        Some(direction(placed(reference, unit, middle, height), entry.forward))
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

#[allow(clippy::cast_possible_truncation, reason = "there are fewer geometries than XML nodes")]
fn stretch(road: &Road, section: &Section, entry: &LaneEntry, start_s: f64) -> Stretch {
    let sign = f64::from(entry.lane_id.signum());
    let mut middle = road.lane_offset.cubic_at(start_s);
    for lane in &section.lanes {
        let is_inner = lane.id != 0
            && lane.id.signum() == entry.lane_id.signum()
            && lane.id.abs() <= entry.lane_id.abs();
        if is_inner {
            let share = if lane.id == entry.lane_id { sign / 2.0 } else { sign };
            middle = middle.plus(&lane.width.cubic_at(start_s), share);
        }
    }
    let geometry = road.geometries.partition_point(|g| g.start_s <= start_s).saturating_sub(1);
    Stretch { start_s, middle, height: road.elevation.cubic_at(start_s), geometry: geometry as u32 }
}
