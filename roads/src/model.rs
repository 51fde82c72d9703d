//! A map as read: roads with their lanes, before anything is derived from them.

use std::sync::Arc;

use crate::arc::PlanPose;
use crate::geometry::{Geometry, Profile};
use crate::kinds::{LaneType, MarkColor, MarkType};
use crate::level::Level;
use crate::signals::Signals;

#[derive(Clone, Debug)]
pub(crate) struct Road {
    pub(crate) id: u32,
    /// How many roads stand before it in the text.
    pub(crate) place: usize,
    pub(crate) length_m: f64,
    /// The junction this road leads through; `None` for -1.
    pub(crate) junction: Option<i64>,
    pub(crate) left_hand: bool,
    /// Id of a road or a junction; 0 stands for none, and for road 0 where one exists.
    pub(crate) predecessor: u32,
    /// As `predecessor`.
    pub(crate) successor: u32,
    pub(crate) speed_limits: Vec<SpeedLimit>,
    pub(crate) geometries: Vec<Geometry>,
    pub(crate) elevation: Profile,
    /// What it has in common with the other roads of an uneven junction.
    pub(crate) level: Option<Arc<Level>>,
    pub(crate) lane_offset: Profile,
    pub(crate) sections: Vec<Section>,
    pub(crate) objects: Vec<Object>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct SpeedLimit {
    pub(crate) start_s: f64,
    pub(crate) limit_mps: Option<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct Section {
    pub(crate) start_s: f64,
    pub(crate) end_s: f64,
    /// Ordered by id.
    pub(crate) lanes: Vec<Lane>,
}

#[derive(Clone, Debug)]
pub(crate) struct Lane {
    pub(crate) id: i32,
    pub(crate) lane_type: LaneType,
    /// 0 is none.
    pub(crate) predecessor: i32,
    /// 0 is none.
    pub(crate) successor: i32,
    /// Starts are road coordinates.
    pub(crate) width: Profile,
    pub(crate) marks: Vec<Mark>,
}

/// One `roadMark` record of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mark {
    pub(crate) start_s: f64,
    pub(crate) mark_type: MarkType,
    pub(crate) color: MarkColor,
    pub(crate) width_m: f64,
    pub(crate) change: MarkChange,
}

/// The `laneChange` attribute of a road mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MarkChange {
    Increase,
    Decrease,
    Both,
    None,
}

/// One `object` element with the numbers the crate reads.
#[derive(Clone, Debug)]
pub(crate) struct Object {
    pub(crate) name: String,
    pub(crate) object_type: String,
    pub(crate) s: f64,
    pub(crate) t: f64,
    pub(crate) z_offset_m: f64,
    pub(crate) heading_rad: f64,
    pub(crate) length_m: f64,
    pub(crate) width_m: f64,
    pub(crate) height_m: f64,
    pub(crate) radius_m: f64,
    /// Corners `(u, v, z)` of a direct `outline` of `cornerLocal`.
    pub(crate) corners: Vec<[f64; 3]>,
}

impl Object {
    /// Whether the client library takes it for a crosswalk.
    pub(crate) fn is_crosswalk(&self) -> bool {
        self.object_type == "crosswalk" || self.name.contains("rosswalk")
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Junction {
    pub(crate) id: u32,
    /// Connecting roads, one per connection id.
    pub(crate) connecting_roads: Vec<u32>,
    /// Those that several connections name.
    pub(crate) repeated_roads: Vec<u32>,
    /// Ids of the controllers of its lights, in the order of the file.
    pub(crate) controllers: Vec<String>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    /// Ordered by id.
    pub(crate) roads: Vec<Road>,
    /// Ordered by id.
    pub(crate) junctions: Vec<Junction>,
    pub(crate) signals: Signals,
    pub(crate) latitude_deg: Option<f64>,
    pub(crate) longitude_deg: Option<f64>,
}

impl Model {
    pub(crate) fn road_index(&self, id: u32) -> Option<usize> {
        self.roads.binary_search_by_key(&id, |road| road.id).ok()
    }

    pub(crate) fn road(&self, id: u32) -> Option<&Road> {
        self.road_index(id).and_then(|index| self.roads.get(index))
    }

    pub(crate) fn junction(&self, id: u32) -> Option<&Junction> {
        let index = self.junctions.binary_search_by_key(&id, |junction| junction.id).ok()?;
        self.junctions.get(index)
    }
}

impl Road {
    /// The reference line at `s`, kept within the road.
    pub(crate) fn reference(&self, s: f64) -> PlanPose {
        self.reference_with_direction(s).0
    }

    /// As [`Road::reference`], with sine and cosine of the heading.
    pub(crate) fn reference_with_direction(&self, s: f64) -> (PlanPose, [f64; 2]) {
        let s = s.clamp(0.0, self.length_m);
        let origin = PlanPose { x: 0.0, y: 0.0, heading_rad: 0.0 };
        let geometry = self.geometries.get(self.geometry_index(s));
        geometry.map_or((origin, [0.0, 1.0]), |own| own.at_with_direction(s - own.start_s))
    }

    /// Height of the surface at a place across from `s`, in metres: in an uneven junction the
    /// common one, but for both ends, which are as high as the roads that go on there.
    pub(crate) fn surface_m(&self, s: f64, at: [f64; 2]) -> f64 {
        let own_m = self.elevation.value(s);
        let Some(level) = &self.level else { return own_m };
        own_m + self.shared_height(s) * (level.height_m(at, own_m) - own_m)
    }

    /// How much the height that roads of an uneven junction have in common counts at `s`, 0 to 1.
    pub(crate) fn shared_height(&self, s: f64) -> f64 {
        const END_M: f64 = 3.0;
        let share = (s.min(self.length_m - s) / END_M).clamp(0.0, 1.0);
        share * share * (3.0 - 2.0 * share)
    }

    /// Position of the geometry at `s`: the last one starting at or before it.
    pub(crate) fn geometry_index(&self, s: f64) -> usize {
        self.geometries.partition_point(|geometry| geometry.start_s <= s).saturating_sub(1)
    }

    /// Position of the section at `s`: the last one starting at or before it.
    pub(crate) fn section_index(&self, s: f64) -> usize {
        self.sections.partition_point(|section| section.start_s <= s).saturating_sub(1)
    }

    /// Whether it leads through a junction and has no lane of any type: nothing is paved there.
    pub(crate) fn is_for_nobody(&self) -> bool {
        let mut lanes = self.sections.iter().flat_map(|section| &section.lanes);
        self.junction.is_some() && lanes.all(|lane| lane.lane_type == LaneType::None)
    }

    /// Whether lanes with this id run along s.
    pub(crate) fn runs_forward(&self, lane: i32) -> bool {
        if self.left_hand { lane >= 0 } else { lane <= 0 }
    }

    pub(crate) fn speed_limit_mps(&self, s: f64) -> Option<f64> {
        let after = self.speed_limits.partition_point(|limit| limit.start_s <= s);
        self.speed_limits.get(after.checked_sub(1)?)?.limit_mps
    }
}

impl Section {
    pub(crate) fn lane(&self, id: i32) -> Option<&Lane> {
        self.position(id).and_then(|position| self.lanes.get(position))
    }

    /// Position of a lane in `lanes`, which mostly have no gaps between their ids.
    pub(crate) fn position(&self, id: i32) -> Option<usize> {
        let first = self.lanes.first()?.id;
        let guess = usize::try_from(i64::from(id) - i64::from(first)).ok()?;
        if self.lanes.get(guess).is_some_and(|lane| lane.id == id) {
            return Some(guess);
        }
        self.lanes.binary_search_by_key(&id, |lane| lane.id).ok()
    }
}

impl Lane {
    pub(crate) fn mark(&self, s: f64) -> Option<&Mark> {
        let after = self.marks.partition_point(|mark| mark.start_s <= s);
        self.marks.get(after.checked_sub(1)?)
    }
}
