//! Lane sections, widths and road marks.

use super::number::{Numbers, lane_id, text};
use super::road::cubic;
use super::tree::Node;
use super::{children, list};
use crate::error::shown;
use crate::geometry::Profile;
use crate::kinds::{LaneType, MarkColor, MarkType};
use crate::model::{Lane, Mark, MarkChange, Section};

pub(super) fn sections(
    lanes: Node<'_, '_>,
    road_length_m: f64,
    numbers: &mut Numbers<'_>,
) -> Vec<Section> {
    let mut sections = list(lanes, "laneSection", |node| section(node, numbers));
    sections.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    let ends: Vec<f64> =
        sections.iter().skip(1).map(|section| section.start_s).chain([road_length_m]).collect();
    for (section, end_s) in sections.iter_mut().zip(ends) {
        section.end_s = end_s.max(section.start_s);
    }
    sections
}

fn section(node: Node<'_, '_>, numbers: &mut Numbers<'_>) -> Section {
    let start_s = numbers.required(node, "s");
    let of_sides = || {
        let sides = ["left", "center", "right"].into_iter().flat_map(|side| children(node, side));
        sides.flat_map(|side| children(side, "lane"))
    };
    let mut lanes = Vec::with_capacity(of_sides().count());
    lanes.extend(of_sides().map(|lane_node| lane(lane_node, start_s, numbers)));
    lanes.sort_by_key(|lane| lane.id);
    let road = Some(numbers.road);
    if lanes.windows(2).any(|pair| matches!(pair, [a, b] if a.id == b.id)) {
        numbers.report.add(road, Some(start_s), "lane ids that are unique", "a second one");
    }
    if !lanes.iter().any(|lane| lane.id == 0) {
        numbers.report.add(road, Some(start_s), "a centre lane with id 0", "none");
    }
    Section { start_s, end_s: start_s, lanes }
}

fn lane(node: Node<'_, '_>, section_s: f64, numbers: &mut Numbers<'_>) -> Lane {
    let link = |side| {
        children(node, "link")
            .flat_map(|link| children(link, side))
            .next()
            .map_or(0, |neighbour| lane_id(neighbour, "id"))
    };
    let id = lane_id(node, "id");
    let mut width = list(node, "width", |record| {
        cubic(record, section_s + numbers.required(record, "sOffset"), numbers)
    });
    width.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    if let Some(first) = width.first()
        && first.start_s > section_s
        && id != 0
    {
        let wanted = format!("the first width of lane {id} at the start of its section");
        let found = format!("s = {}", first.start_s);
        numbers.report.add(Some(numbers.road), Some(section_s), wanted, found);
    }
    let mut marks = list(node, "roadMark", |record| mark(record, section_s, numbers));
    marks.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    if node.attribute("id").is_none() {
        let found = shown(text(node, "type"));
        numbers.report.add(Some(numbers.road), Some(section_s), "an id of every lane", found);
    }
    Lane {
        id,
        lane_type: LaneType::from_name(text(node, "type")),
        predecessor: link("predecessor"),
        successor: link("successor"),
        width: Profile(width),
        marks,
    }
}

fn mark(node: Node<'_, '_>, section_s: f64, numbers: &mut Numbers<'_>) -> Mark {
    Mark {
        start_s: section_s + numbers.optional(node, "sOffset"),
        mark_type: MarkType::from_name(text(node, "type")),
        color: MarkColor::from_name(text(node, "color")),
        width_m: numbers.optional(node, "width"),
        change: match text(node, "laneChange") {
            "increase" => MarkChange::Increase,
            "decrease" => MarkChange::Decrease,
            "none" => MarkChange::None,
            _ => MarkChange::Both,
        },
    }
}
