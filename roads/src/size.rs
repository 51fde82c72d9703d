//! Bounds on what the numbers of a text ask to be built: a few digits can ask for gigabytes.

use crate::error::{Report, shown};
use crate::geometry::{Geometry, Shape, spiral_panels};
use crate::limits;
use crate::mesh::{panes, strip, stripes};
use crate::model::{Model, Road, Section};

/// Reports what is beyond [`limits`]. The sums are reported once, at the road that passes them.
pub(crate) fn check(model: &Model, report: &mut Report) {
    let mut lane_steps = Sum::new(limits::LANE_STEPS_MAX, "steps of a metre along all lanes");
    let mut pieces = Sum::new(limits::LANE_PIECES_MAX, "flat pieces of all lanes");
    let mut parts = Sum::new(limits::PARTS_MAX, "stripes of crosswalks and windows of houses");
    let mut corners = 0;
    for road in &model.roads {
        road.geometries.iter().for_each(|geometry| turn(road, geometry, report));
        let panels = panels(road);
        for section in &road.sections {
            lanes(road, section, report);
            let lanes = section.lanes.len() as f64;
            let length_m = section.end_s - section.start_s;
            let found = || format!("{length_m} m with {lanes} lanes");
            let marks: usize = section.lanes.iter().map(|lane| lane.marks.len()).sum();
            let flat = lanes * strip::cuts_max(road, section) + marks as f64;
            lane_steps.add(lanes * length_m * panels, road, section.start_s, found, report);
            pieces.add(flat, road, section.start_s, found, report);
        }
        for object in &road.objects {
            let found = || format!("the object {}", shown(&object.name));
            let count = if object.is_crosswalk() {
                // A crossing without corners repeats those of the one before.
                corners = if object.corners.is_empty() { corners } else { object.corners.len() };
                corners as f64 + stripes(object)
            } else {
                panes(object)
            };
            parts.add(count, road, object.s, found, report);
        }
    }
}

/// What is counted over all roads.
struct Sum {
    sum: f64,
    limit: f64,
    what: &'static str,
}

impl Sum {
    fn new(limit: f64, what: &'static str) -> Self {
        Self { sum: 0.0, limit, what }
    }

    fn add(
        &mut self,
        count: f64,
        road: &Road,
        s: f64,
        found: impl Fn() -> String,
        report: &mut Report,
    ) {
        let was_within = self.sum <= self.limit;
        self.sum += count;
        if was_within && self.sum > self.limit {
            let wanted = format!("a map of at most {} {}", self.limit, self.what);
            let found = format!("{:.0} with {}; split the map or correct them", self.sum, found());
            report.add(Some(road.id), Some(s), wanted, found);
        }
    }
}

fn turn(road: &Road, geometry: &Geometry, report: &mut Report) {
    let turn_rad = geometry.turn_max_rad();
    if turn_rad > limits::TURN_MAX_RAD && !matches!(geometry.shape, Shape::Polynomial(_)) {
        let wanted = format!("a bend that turns by at most {} rad", limits::TURN_MAX_RAD);
        let found = format!("{turn_rad:.0} rad within {} m", geometry.length_m);
        report.add(Some(road.id), Some(geometry.start_s), wanted, found);
    }
}

fn lanes(road: &Road, section: &Section, report: &mut Report) {
    let place = (Some(road.id), Some(section.start_s));
    if section.start_s < 0.0 {
        report.add(place.0, place.1, "lane sections at s of 0 or more", "one before the road");
    }
    if section.lanes.len() > limits::SECTION_LANES_MAX {
        let wanted = format!("at most {} lanes in a section", limits::SECTION_LANES_MAX);
        report.add(place.0, place.1, wanted, section.lanes.len().to_string());
    }
}

/// Most panels that the integral over a spiral of a road has.
fn panels(road: &Road) -> f64 {
    let panels = road.geometries.iter().map(|geometry| match geometry.shape {
        Shape::Spiral { .. } => spiral_panels(geometry.turn_max_rad()),
        _ => 1,
    });
    panels.max().unwrap_or(1) as f64
}
