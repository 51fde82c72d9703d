//! One `road` element: links, reference line and profiles.

use std::sync::Arc;

use super::number::{Numbers, id_or_zero, leading_integer, text};
use super::tree::Node;
use super::{child, children, lanes, list, objects};
use crate::arc::PlanPose;
use crate::error::{Report, shown};
use crate::geometry::{Cubic, Geometry, Profile, Shape, Table};
use crate::limits;
use crate::model::{Road, SpeedLimit};

/// Reads a road; `None` for a road without lanes, which has no place in the lane graph.
pub(super) fn read(
    node: Node<'_, '_>,
    polynomial_m: &mut f64,
    report: &mut Report,
) -> Option<Road> {
    let id = id_or_zero(node, "id");
    let mut numbers = Numbers { road: id, report };
    let length_m = numbers.required(node, "length");
    if length_m <= 0.0 {
        numbers.report.add(Some(id), None, "a length above 0 m", shown(text(node, "length")));
        return None;
    }
    let link = |side| {
        child(node, "link")
            .and_then(|link| child(link, side))
            .map_or(0, |neighbour| id_or_zero(neighbour, "elementId"))
    };
    let lanes_node = child(node, "lanes")?;
    let geometries = geometries(node, polynomial_m, &mut numbers);
    let elevation = child(node, "elevationProfile")
        .map_or_else(Profile::default, |parent| profile(parent, "elevation", &mut numbers));
    let lane_offset = profile(lanes_node, "laneOffset", &mut numbers);
    let sections = lanes::sections(lanes_node, length_m, &mut numbers);
    if sections.is_empty() {
        return None;
    }
    let speed_limits = speed_limits(node, &mut numbers);
    let objects = objects::read(node, &mut numbers);
    Some(Road {
        id,
        place: 0,
        length_m,
        junction: leading_integer(node.attribute("junction").unwrap_or("0"))
            .filter(|junction| *junction >= 0),
        left_hand: text(node, "rule").eq_ignore_ascii_case("LHT"),
        predecessor: link("predecessor"),
        successor: link("successor"),
        speed_limits,
        geometries,
        elevation,
        level: None,
        lane_offset,
        sections,
        objects,
    })
}

/// Cubic records in the order of their starts; the first must start at 0.
fn profile(parent: Node<'_, '_>, name: &'static str, numbers: &mut Numbers<'_>) -> Profile {
    let mut records = list(parent, name, |node| cubic(node, numbers.required(node, "s"), numbers));
    records.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    if let Some(first) = records.first()
        && first.start_s > 0.0
    {
        let found = format!("s = {}", first.start_s);
        numbers.report.add(Some(numbers.road), None, format!("the first {name} at s = 0"), found);
    }
    Profile(records)
}

pub(super) fn cubic(node: Node<'_, '_>, start_s: f64, numbers: &mut Numbers<'_>) -> Cubic {
    Cubic {
        start_s,
        a: numbers.coefficient(node, "a"),
        b: numbers.coefficient(node, "b"),
        c: numbers.coefficient(node, "c"),
        d: numbers.coefficient(node, "d"),
    }
}

fn geometries(
    road: Node<'_, '_>,
    polynomial_m: &mut f64,
    numbers: &mut Numbers<'_>,
) -> Vec<Geometry> {
    let of_plan = || child(road, "planView").into_iter().flat_map(|p| children(p, "geometry"));
    let mut geometries = Vec::with_capacity(of_plan().count());
    geometries.extend(of_plan().filter_map(|node| geometry(node, polynomial_m, numbers)));
    geometries.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    if geometries.is_empty() {
        numbers.report.add(Some(numbers.road), None, "a planView with geometry", "none");
    }
    geometries
}

fn geometry(
    node: Node<'_, '_>,
    polynomial_m: &mut f64,
    numbers: &mut Numbers<'_>,
) -> Option<Geometry> {
    let start_s = numbers.required(node, "s");
    let length_m = numbers.required(node, "length");
    let start = PlanPose {
        x: numbers.place(node, "x"),
        y: numbers.place(node, "y"),
        heading_rad: numbers.required(node, "hdg"),
    };
    if length_m <= 0.0 {
        let found = shown(text(node, "length"));
        numbers.report.add(Some(numbers.road), Some(start_s), "a geometry longer than 0 m", found);
        return None;
    }
    let shape_node = node.children().next()?;
    let shape = match shape_node.name() {
        "line" => Shape::Line,
        "arc" => Shape::Arc { curvature: numbers.required(shape_node, "curvature") },
        "spiral" => Shape::Spiral {
            curvature_start: numbers.required(shape_node, "curvStart"),
            curvature_end: numbers.required(shape_node, "curvEnd"),
        },
        name @ ("poly3" | "paramPoly3") => {
            *polynomial_m += length_m;
            if *polynomial_m > limits::POLYNOMIAL_LENGTH_SUM_MAX_M {
                let wanted =
                    format!("at most {} m of polynomials", limits::POLYNOMIAL_LENGTH_SUM_MAX_M);
                numbers.report.add(Some(numbers.road), Some(start_s), wanted, "more");
                return None;
            }
            let table = polynomial(shape_node, name == "poly3", length_m, numbers);
            Shape::Polynomial(Arc::new(table))
        }
        _ => return None,
    };
    Some(Geometry::new(start_s, length_m, start, shape))
}

fn polynomial(
    node: Node<'_, '_>,
    is_poly3: bool,
    length_m: f64,
    numbers: &mut Numbers<'_>,
) -> Table {
    if is_poly3 {
        return Table::poly3(["a", "b", "c", "d"].map(|n| numbers.coefficient(node, n)), length_m);
    }
    let u = ["aU", "bU", "cU", "dU"].map(|n| numbers.coefficient(node, n));
    let v = ["aV", "bV", "cV", "dV"].map(|n| numbers.coefficient(node, n));
    let p_max = if text(node, "pRange") == "arcLength" { length_m } else { 1.0 };
    Table::param_poly3(u, v, p_max, length_m)
}

fn speed_limits(road: Node<'_, '_>, numbers: &mut Numbers<'_>) -> Vec<SpeedLimit> {
    let mut limits = list(road, "type", |node| {
        let limit_mps = child(node, "speed").and_then(|speed| {
            let factor = match text(speed, "unit") {
                "km/h" => 1.0 / 3.6,
                "mph" => 0.447_04,
                _ => 1.0,
            };
            // "no limit" and "undefined" are legal values that are no numbers.
            let max: f64 = text(speed, "max").trim().parse().ok()?;
            (max > 0.0 && max.is_finite()).then_some(max * factor)
        });
        SpeedLimit { start_s: numbers.optional(node, "s"), limit_mps }
    });
    limits.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    limits
}
