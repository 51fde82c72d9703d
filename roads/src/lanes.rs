//! All lanes of a map in one table, and where they lie in space.

use std::ops::Range;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};

use crate::arc::{PlanPose, unit};
use crate::model::{Lane, Model, Road, Section};

/// Position of one lane of one section in the [`LaneTable`].
pub(crate) type LaneIndex = u32;

/// One lane of one section.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneEntry {
    /// Position in [`Model::roads`].
    pub(crate) road: u32,
    pub(crate) road_id: u32,
    pub(crate) section: u32,
    /// Position in [`Section::lanes`].
    pub(crate) lane: u32,
    pub(crate) lane_id: i32,
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// Whether its traffic runs along s.
    pub(crate) forward: bool,
    /// 1 where it does, -1 where it does not: that cannot be foreseen, and a factor costs less than
    /// a branch.
    pub(crate) sign: f64,
}

impl LaneEntry {
    /// The road coordinate where its traffic enters it.
    pub(crate) fn entry_s(&self) -> f64 {
        if self.forward { self.start_s } else { self.end_s }
    }

    /// The road coordinate where its traffic leaves it.
    pub(crate) fn exit_s(&self) -> f64 {
        if self.forward { self.end_s } else { self.start_s }
    }

    pub(crate) fn length_m(&self) -> f64 {
        self.end_s - self.start_s
    }
}

/// Where the lanes of one section stand in the table.
#[derive(Clone, Copy, Debug)]
struct SectionLanes {
    first: LaneIndex,
    end: LaneIndex,
    least_id: i32,
}

#[derive(Debug, Default)]
pub(crate) struct LaneTable {
    /// By road, section, lane id.
    pub(crate) lanes: Vec<LaneEntry>,
    /// For every section of every road: its lanes.
    sections: Vec<SectionLanes>,
    roads: Vec<RoadSections>,
    /// The same for every road id up to the largest, if that is not too large.
    by_id: Vec<RoadSections>,
}

/// A road, and where its sections stand in the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoadSections {
    /// Position in [`Model::roads`].
    pub(crate) road: u32,
    first: u32,
    end: u32,
}

impl RoadSections {
    const NONE: Self = Self { road: u32::MAX, first: 0, end: 0 };
}

impl LaneTable {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the reader accepts fewer XML nodes than fit into 32 bits"
    )]
    pub(crate) fn new(model: &Model) -> Self {
        let mut table = Self::default();
        for (road_index, road) in model.roads.iter().enumerate() {
            let first = table.sections.len() as u32;
            let end = first + road.sections.len() as u32;
            table.roads.push(RoadSections { road: road_index as u32, first, end });
            for (section_index, section) in road.sections.iter().enumerate() {
                let first = table.lanes.len() as u32;
                let end = first + section.lanes.len() as u32;
                let least_id = section.lanes.first().map_or(0, |lane| lane.id);
                table.sections.push(SectionLanes { first, end, least_id });
                table.lanes.extend(section.lanes.iter().enumerate().map(|(lane_index, lane)| {
                    let forward = road.runs_forward(lane.id);
                    LaneEntry {
                        road: road_index as u32,
                        road_id: road.id,
                        section: section_index as u32,
                        lane: lane_index as u32,
                        lane_id: lane.id,
                        start_s: section.start_s,
                        end_s: section.end_s,
                        forward,
                        sign: sign(forward),
                    }
                }));
            }
        }
        table.by_id = by_id(model, &table.roads);
        table
    }

    pub(crate) fn get(&self, index: LaneIndex) -> Option<&LaneEntry> {
        self.lanes.get(index as usize)
    }

    /// All lanes of the road at this position in [`Model::roads`].
    pub(crate) fn lanes_of(&self, road: usize) -> Range<LaneIndex> {
        let own = self.roads.get(road).map(|road| road.first as usize..road.end as usize);
        let sections = own.and_then(|own| self.sections.get(own)).unwrap_or_default();
        let (first, last) = (sections.first(), sections.last());
        first.zip(last).map_or(0..0, |(first, last)| first.first..last.end)
    }

    /// The lane with this id in a section of the road at this position in [`Model::roads`].
    pub(crate) fn find(&self, road: usize, section: usize, lane_id: i32) -> Option<LaneIndex> {
        self.find_in(*self.roads.get(road)?, section, lane_id)
    }

    /// The lane with this id in a section of a road.
    #[inline]
    pub(crate) fn find_in(
        &self,
        road: RoadSections,
        section: usize,
        lane_id: i32,
    ) -> Option<LaneIndex> {
        let own = self.sections.get(road.first as usize..road.end as usize)?;
        let SectionLanes { first, end, least_id } = *own.get(section)?;
        // Ids mostly have no gaps; where they have, the lane stands before its place.
        let guess = i64::from(first) + i64::from(lane_id) - i64::from(least_id);
        let guess = u32::try_from(guess).ok().filter(|guess| *guess >= first)?;
        if guess < end && self.get(guess)?.lane_id == lane_id {
            return Some(guess);
        }
        self.find_among(first..end.min(guess), lane_id)
    }

    /// As [`LaneTable::find_in`], where ids have gaps.
    #[cold]
    fn find_among(&self, mut lanes: Range<LaneIndex>, lane_id: i32) -> Option<LaneIndex> {
        lanes.find(|index| self.get(*index).is_some_and(|entry| entry.lane_id == lane_id))
    }

    /// The road with this id.
    #[inline]
    pub(crate) fn road(&self, model: &Model, id: u32) -> Option<RoadSections> {
        if self.by_id.is_empty() {
            return self.roads.get(model.road_index(id)?).copied();
        }
        self.by_id.get(id as usize).copied().filter(|road| road.first < road.end)
    }
}

/// The road of every id; nothing where ids are so large that a search is better.
fn by_id(model: &Model, roads: &[RoadSections]) -> Vec<RoadSections> {
    const SPARSE_MAX: usize = 64;
    let largest = model.roads.last().map_or(0, |road| road.id as usize);
    if largest > roads.len() * SPARSE_MAX {
        return Vec::new();
    }
    let mut by_id = vec![RoadSections::NONE; largest + 1];
    for (sections, road) in roads.iter().zip(&model.roads) {
        if let Some(known) = by_id.get_mut(road.id as usize) {
            *known = *sections;
        }
    }
    by_id
}

/// The parts of the model one lane entry stands for.
pub(crate) fn parts<'m>(
    model: &'m Model,
    entry: &LaneEntry,
) -> Option<(&'m Road, &'m Section, &'m Lane)> {
    let road = model.roads.get(entry.road as usize)?;
    let section = road.sections.get(entry.section as usize)?;
    Some((road, section, section.lanes.get(entry.lane as usize)?))
}

/// A place on a lane, with the angles the client library reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LanePose {
    /// Middle of the lane.
    pub point: Point3<f64>,
    /// Direction of travel, counter-clockwise from east.
    pub heading_rad: f64,
    /// Climb in the direction of travel, nose up positive.
    pub pitch_rad: f64,
}

impl LanePose {
    /// The same as a transform: x along the direction of travel, y left, z up.
    #[must_use]
    pub fn isometry(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.point.coords),
            // A positive turn about y (left) tips the nose down.
            UnitQuaternion::from_euler_angles(0.0, -self.pitch_rad, self.heading_rad),
        )
    }
}

/// Lateral place of a lane's inner and outer border and middle, with the slope of the middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lateral {
    pub(crate) middle: f64,
    pub(crate) middle_slope: f64,
    pub(crate) inner: f64,
    pub(crate) outer: f64,
}

/// Sums the widths from the centre outward to lane `lane_id`.
pub(crate) fn lateral(road: &Road, section: &Section, lane_id: i32, s: f64) -> Lateral {
    let (offset, offset_slope) = road.lane_offset.at_within(s, section.end_s);
    let sign = f64::from(lane_id.signum());
    let (mut inner, mut inner_slope) = (0.0, 0.0);
    let (mut width, mut width_slope) = (0.0, 0.0);
    let mut step = |lane: &Lane| {
        inner += width;
        inner_slope += width_slope;
        (width, width_slope) = lane.width.at(s);
    };
    // Lanes are ordered by id, so that the way outward goes up on the left and down on the right.
    let centre = section.lanes.partition_point(|lane| lane.id < 0);
    if lane_id > 0 {
        let outward = section.lanes.iter().skip(centre).filter(|lane| lane.id > 0);
        outward.take_while(|lane| lane.id <= lane_id).for_each(&mut step);
    } else if lane_id < 0 {
        let outward = section.lanes.iter().take(centre).rev();
        outward.take_while(|lane| lane.id >= lane_id).for_each(&mut step);
    }
    Lateral {
        middle: offset + sign * (inner + width / 2.0),
        middle_slope: offset_slope + sign * (inner_slope + width_slope / 2.0),
        inner: offset + sign * inner,
        outer: offset + sign * (inner + width),
    }
}

/// The middle of a lane at `s`.
pub(crate) fn lane_pose(road: &Road, section: &Section, lane_id: i32, s: f64) -> LanePose {
    let reference = road.reference(s);
    let lateral = lateral(road, section, lane_id, s);
    let middle = (lateral.middle, lateral.middle_slope);
    let pose = placed(reference, unit(reference.heading_rad), middle, road.elevation.at(s));
    direction(pose, sign(road.runs_forward(lane_id)))
}

/// A place beside the reference line, looking along s. `unit` is sine and cosine of the line's
/// heading; lateral place and height come with their slopes.
#[inline]
pub(crate) fn placed(
    reference: PlanPose,
    [sin, cos]: [f64; 2],
    (middle, middle_slope): (f64, f64),
    (z, slope): (f64, f64),
) -> LanePose {
    LanePose {
        point: Point3::new(reference.x - middle * sin, reference.y + middle * cos, z),
        // The client library adds slopes as if they were angles; so do we, to agree with it.
        heading_rad: reference.heading_rad + middle_slope,
        pitch_rad: slope,
    }
}

/// 1 for traffic along s, -1 against.
pub(crate) fn sign(forward: bool) -> f64 {
    if forward { 1.0 } else { -1.0 }
}

/// The same place, looking the way its traffic runs, which `sign` says.
#[inline]
pub(crate) fn direction(pose: LanePose, sign: f64) -> LanePose {
    let turn_rad = (1.0 - sign) * std::f64::consts::FRAC_PI_2;
    LanePose { heading_rad: pose.heading_rad + turn_rad, pitch_rad: pose.pitch_rad * sign, ..pose }
}

/// A point at lateral place `t` beside the reference line.
pub(crate) fn lateral_point(road: &Road, s: f64, t: f64, z_offset_m: f64) -> Point3<f64> {
    let reference = road.reference(s);
    let (sin, cos) = reference.heading_rad.sin_cos();
    let [x, y] = [reference.x - t * sin, reference.y + t * cos];
    Point3::new(x, y, road.surface_m(s, [x, y]) + z_offset_m)
}
