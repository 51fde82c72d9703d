//! Faults of a map that can be read: what breaks CARLA's client, and what is probably a mistake.

mod corners;
mod forks;

use crate::error::{Diagnostic, Report, Severity};
use crate::geometry::Shape;
use crate::kinds::LaneType;
use crate::lanes::{LaneEntry, LaneIndex, parts};
use crate::limits::{ACTOR_ABS_MAX, CROSSED_PIECES_MAX, CROSSED_PLACES_MAX, CROSSING_BOXES_MAX};
use crate::map::Map;
use crate::model::Road;

/// Lane ends that are further apart leave a step, in metres.
const GAP_MAX_M: f64 = 0.01;
/// Lane ends that differ by more in direction make a kink, in radians.
const KINK_MAX_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// A lane of this length begins where it ends in the client's single precision, in metres.
const SLIVER_MAX_M: f64 = 1.0e-6;
/// The client finds no place on the lanes of a last section that is shorter, in metres.
const SECTION_M_MIN: f64 = 1.0e-12;
/// How far a road's length may differ from the sum of its geometries, in metres.
const LENGTH_OFF_MAX_M: f64 = 0.01;

impl Map {
    /// Looks for faults that the reader tolerates.
    ///
    /// **Order:** by kind of fault, then by road. **Cost:** some milliseconds for a town.
    #[must_use]
    pub fn check(&self) -> Report {
        let mut report = Report::default();
        // First, as large maps may have more faults than are told.
        searches(self, &mut report);
        for road in &self.model.roads {
            geometry(road, &mut report);
            lane_ids(road, &mut report);
            ids(self, road, &mut report);
        }
        for (index, entry) in (0..).zip(&self.table.lanes) {
            missing_target(self, entry, &mut report);
            dead_end(self, index, entry, &mut report);
            sliver(self, entry, &mut report);
        }
        far(self, &mut report);
        forks::check(self, &mut report);
        joints(self, &mut report);
        report
    }
}

fn fault(
    severity: Severity,
    road: &Road,
    s: Option<f64>,
    wanted: impl Into<String>,
    found: impl Into<String>,
) -> Diagnostic {
    Diagnostic { severity, road: Some(road.id), s, wanted: wanted.into(), found: found.into() }
}

/// Tells of searches that ended at a limit.
fn searches(map: &Map, report: &mut Report) {
    let mut tell = |wanted: String, found: &str| {
        let (severity, found) = (Severity::Suspicious, found.to_owned());
        report.push(Diagnostic { severity, road: None, s: None, wanted, found });
    };
    if !map.kerbs().is_whole() {
        tell(
            format!(
                "at most {CROSSED_PLACES_MAX} places where roads cross {CROSSED_PIECES_MAX} pieces \
                 of sidewalks"
            ),
            "more: the other sidewalks are a step high where roads cross them",
        );
    }
    if !map.has_all_crossings() {
        tell(
            format!("at most {CROSSING_BOXES_MAX} boxes on ways that cross those of signs"),
            "more, or too many ways: the last stop and yield signs hold nobody for who crosses",
        );
    }
}

/// Tells of the first road only: where one is far away, all are.
fn far(map: &Map, report: &mut Report) {
    let places = map
        .model
        .roads
        .iter()
        .flat_map(|road| road.geometries.iter().map(move |geometry| (road, geometry)));
    let is_far = |metres: f64| metres.abs() > ACTOR_ABS_MAX;
    let found = places
        .into_iter()
        .find(|(_, geometry)| is_far(geometry.start.x) || is_far(geometry.start.y));
    if let Some((road, geometry)) = found {
        report.push(fault(
            Severity::Suspicious,
            road,
            Some(geometry.start_s),
            "roads within 100 km of the origin; beyond, nothing can be spawned",
            format!("x = {} m, y = {} m: move the map", geometry.start.x, geometry.start.y),
        ));
    }
}

fn geometry(road: &Road, report: &mut Report) {
    for geometry in &road.geometries {
        if let Shape::Spiral { curvature_start, curvature_end } = geometry.shape
            && curvature_start == curvature_end
        {
            report.push(fault(
                Severity::BreaksClient,
                road,
                Some(geometry.start_s),
                "a spiral whose curvature changes, or an arc",
                format!("the curvature {curvature_start} at both ends"),
            ));
        }
    }
    let flat = road.geometries.iter().find(|one| one.shape == Shape::Arc { curvature: 0.0 });
    if let Some(geometry) = flat {
        let (wanted, found) = ("an arc that bends, or a line", "the curvature 0");
        report.push(fault(Severity::BreaksClient, road, Some(geometry.start_s), wanted, found));
    }
    let late = road.geometries.first().filter(|first| first.start_s > 0.0);
    if let Some(first) = late {
        let found = format!("s = {}", first.start_s);
        report.push(fault(
            Severity::BreaksClient,
            road,
            None,
            "the first geometry at s = 0",
            found,
        ));
    }
    let with_lanes = || road.sections.iter().filter(|section| section.lanes.len() > 1);
    let beyond = road.sections.iter().find(|section| {
        let has_lanes = section.lanes.len() > 1;
        let least_m = if has_lanes { SECTION_M_MIN } else { 0.0 };
        section.start_s + least_m > road.length_m
    });
    if let Some(section) = beyond {
        report.push(fault(
            Severity::BreaksClient,
            road,
            Some(section.start_s),
            "lane sections that begin on the road",
            format!("one at or beyond its length of {} m", road.length_m),
        ));
    }
    let again = with_lanes().zip(with_lanes().skip(1)).find(|(a, b)| a.start_s == b.start_s);
    if let Some((_, section)) = again {
        let (wanted, found) = ("lane sections that begin one after the other", "two at one place");
        report.push(fault(Severity::BreaksClient, road, Some(section.start_s), wanted, found));
    }
    let sum_m: f64 = road.geometries.iter().map(|geometry| geometry.length_m).sum();
    if (sum_m - road.length_m).abs() > LENGTH_OFF_MAX_M {
        let wanted = format!("geometries of {} m, the length of the road", road.length_m);
        report.push(fault(Severity::Suspicious, road, None, wanted, format!("{sum_m} m")));
    }
}

/// The client looks for the mark between a lane and the one inside of it when it is asked for a
/// place on the lane.
fn lane_ids(road: &Road, report: &mut Report) {
    for section in &road.sections {
        let ids = || section.lanes.iter().map(|lane| lane.id);
        let missing =
            ids().filter(|id| *id != 0).find(|id| section.lane(id - id.signum()).is_none());
        if let Some(id) = missing {
            let wanted = "lane ids without gaps";
            let found = format!("lane {id} and no lane {}", id - id.signum());
            let s = Some(section.start_s);
            report.push(fault(Severity::BreaksClient, road, s, wanted, found));
        }
    }
}

fn ids(map: &Map, road: &Road, report: &mut Report) {
    if road.id == 0 {
        let found = "0, which also stands for no link";
        report.push(fault(Severity::Suspicious, road, None, "road ids above 0", found));
    }
    if map.model.junction(road.id).is_some() {
        let wanted = "an id that no junction has";
        let found = "a junction of the same id, whose links are lost";
        report.push(fault(Severity::Suspicious, road, None, wanted, found));
    }
}

/// A lane that names a lane which the sections beyond or the next road do not have. Only the link
/// in travel direction is followed.
fn missing_target(map: &Map, entry: &LaneEntry, report: &mut Report) {
    let Some((road, _, lane)) = parts(&map.model, entry) else { return };
    let (link_id, next_road) = if entry.forward {
        (lane.successor, road.successor)
    } else {
        (lane.predecessor, road.predecessor)
    };
    let section = entry.section as usize;
    let beyond =
        if entry.forward { road.sections.get(section + 1..) } else { road.sections.get(..section) };
    let beyond = beyond.filter(|sections| !sections.is_empty());
    let next = || map.model.road(next_road).map(|road| (next_road, road.sections.as_slice()));
    let Some((target, sections)) = beyond.map(|sections| (road.id, sections)).or_else(next) else {
        return;
    };
    if link_id != 0 && !sections.iter().any(|section| section.lane(link_id).is_some()) {
        report.push(fault(
            Severity::BreaksClient,
            road,
            Some(entry.exit_s()),
            format!("lane {} to lead to a lane of road {target}", lane.id),
            format!("lane {link_id}, which that road does not have there"),
        ));
    }
}

fn dead_end(map: &Map, index: LaneIndex, entry: &LaneEntry, report: &mut Report) {
    let Some((road, section, lane)) = parts(&map.model, entry) else { return };
    let driven = lane.id != 0 && lane.lane_type == LaneType::Driving;
    // A lane that closes before its end leads its traffic into the lane beside it.
    let open = lane.width.value(entry.exit_s()) > 0.5;
    let beside = section.lanes.iter().any(|other| {
        other.lane_type == LaneType::Driving
            && other.id.signum() == lane.id.signum()
            && (other.id - lane.id).abs() == 1
    });
    if driven && map.links.next_of(index).is_empty() && (open || !beside) {
        let wanted = format!("lane {} to lead on", lane.id);
        let found = if map.links.is_mutual(index) {
            "a lane that leads back into it, where the client's `next` ends; two lane sections \
             instead of one help"
        } else {
            "a dead end, where vehicles are taken away"
        };
        report.push(fault(Severity::Suspicious, road, Some(entry.exit_s()), wanted, found));
    }
}

/// **Source:** CARLA's `agents` library, which asks the client for the direction from one end of
/// each lane to the other.
fn sliver(map: &Map, entry: &LaneEntry, report: &mut Report) {
    let Some((road, _, lane)) = parts(&map.model, entry) else { return };
    let driven = lane.id != 0 && lane.lane_type == LaneType::Driving;
    if driven && entry.length_m() < SLIVER_MAX_M {
        let wanted = format!("lane {} of a length, in sections and roads that have one", lane.id);
        let found = format!(
            "{:.1e} m; the route planner of CARLA's agents library refuses the map: \
             \"length > 2.0f * std::numeric_limits<float>::epsilon()\"",
            entry.length_m()
        );
        report.push(fault(Severity::Suspicious, road, Some(entry.start_s), wanted, found));
    }
}

fn joints(map: &Map, report: &mut Report) {
    for (from, to) in map.lane_joints() {
        let (Some(end), Some(start)) = (map.lane_pose(&from), map.lane_pose(&to)) else { continue };
        let Some(road) = map.model.road(from.road) else { continue };
        let gap_m = (end.point - start.point).norm();
        let turn_rad = (end.heading_rad - start.heading_rad).sin().abs();
        if gap_m > GAP_MAX_M || turn_rad > KINK_MAX_RAD {
            report.push(fault(
                Severity::Suspicious,
                road,
                Some(from.s),
                format!("lane {} to meet lane {} of road {}", from.lane, to.lane, to.road),
                format!("a gap of {gap_m:.3} m and a turn of {turn_rad:.4} rad"),
            ));
        }
    }
}
