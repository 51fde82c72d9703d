//! `signal`, `signalReference` and `controller` elements, and objects that stand for signals.

use super::number::{Numbers, id_or_zero, lane_id, number_or_zero, text};
use super::tree::Node;
use super::{child, children};
use crate::error::{Report, shown};
use crate::model::Road;
use crate::signals::{Controller, Orientation, Reference, Signal, SignalPose, Signals};
use nalgebra::Point3;

/// How far before a road's end a signal beyond it is moved, in metres.
const END_GAP_M: f64 = 1e-5;

pub(super) fn read(root: Node<'_, '_>, roads: &[Road], report: &mut Report) -> Signals {
    let mut signals = Signals::default();
    // The client reads all signals before the objects that stand for some.
    for (road, node) in known_roads(root, roads) {
        signals_of_road(road, node, &mut signals, report);
    }
    for (road, node) in known_roads(root, roads) {
        speed_objects_of_road(road, node, &mut signals, report);
    }
    for reference in &signals.references {
        if !signals.definitions.contains_key(&reference.signal) {
            let wanted = "signal references to signals of the map";
            report.add(Some(reference.road), Some(reference.s), wanted, shown(&reference.signal));
        }
    }
    signals.controllers = children(root, "controller")
        .map(|controller| Controller {
            id: text(controller, "id").to_owned(),
            signals: children(controller, "control")
                .map(|control| text(control, "signalId").to_owned())
                .collect(),
        })
        .collect();
    signals
}

fn known_roads<'a, 'i, 'r>(
    root: Node<'a, 'i>,
    roads: &'r [Road],
) -> impl Iterator<Item = (&'r Road, Node<'a, 'i>)> {
    children(root, "road").filter_map(|node| {
        let index = roads.binary_search_by_key(&id_or_zero(node, "id"), |road| road.id).ok()?;
        Some((roads.get(index)?, node))
    })
}

fn signals_of_road(road: &Road, node: Node<'_, '_>, signals: &mut Signals, report: &mut Report) {
    let mut numbers = Numbers { road: road.id, report };
    let elements = children(node, "signals").flat_map(|parent| parent.children());
    for element in elements {
        match element.name() {
            "signal" => {
                let reference = reference(element, "id", road, &mut numbers);
                let signal = signal(element, &reference, &mut numbers);
                signals.definitions.insert(reference.signal.clone(), signal);
                signals.references.push(reference);
            }
            "signalReference" => {
                signals.references.push(reference(element, "id", road, &mut numbers));
            }
            _ => {}
        }
    }
}

fn reference(node: Node<'_, '_>, id: &str, road: &Road, numbers: &mut Numbers<'_>) -> Reference {
    let s = numbers.required(node, "s");
    if s < 0.0 {
        let wanted = "signals at s of 0 or more";
        numbers.report.add(Some(road.id), Some(s), wanted, shown(text(node, "s")));
    }
    Reference {
        signal: text(node, id).to_owned(),
        road: road.id,
        s: if s > road.length_m { road.length_m - END_GAP_M } else { s },
        t: numbers.optional(node, "t"),
        orientation: Orientation::from_name(text(node, "orientation")),
        validities: children(node, "validity")
            .map(|validity| [lane_id(validity, "fromLane"), lane_id(validity, "toLane")])
            .collect(),
    }
}

fn signal(node: Node<'_, '_>, place: &Reference, numbers: &mut Numbers<'_>) -> Signal {
    let inertial = child(node, "positionInertial").map(|at| SignalPose {
        point: Point3::new(
            numbers.optional(at, "x"),
            numbers.optional(at, "y"),
            numbers.optional(at, "z"),
        ),
        heading_rad: numbers.optional(at, "hdg"),
        pitch_rad: numbers.optional(at, "pitch"),
        roll_rad: numbers.optional(at, "roll"),
    });
    Signal {
        name: text(node, "name").to_owned(),
        signal_type: text(node, "type").to_owned(),
        subtype: text(node, "subtype").to_owned(),
        country: text(node, "country").to_owned(),
        unit: text(node, "unit").to_owned(),
        text: text(node, "text").to_owned(),
        value: number_or_zero(node, "value"),
        dynamic: text(node, "dynamic") == "yes",
        road: place.road,
        s: place.s,
        t: place.t,
        z_offset_m: numbers.optional(node, "zOffset"),
        heading_offset_rad: numbers.optional(node, "hOffset"),
        pitch_rad: numbers.optional(node, "pitch"),
        roll_rad: numbers.optional(node, "roll"),
        height_m: numbers.optional(node, "height"),
        width_m: numbers.optional(node, "width"),
        inertial,
    }
}

/// Objects named `Speed_` and a number are speed limits in miles per hour.
fn speed_objects_of_road(
    road: &Road,
    node: Node<'_, '_>,
    signals: &mut Signals,
    report: &mut Report,
) {
    let mut numbers = Numbers { road: road.id, report };
    for object in children(node, "objects").flat_map(|parent| children(parent, "object")) {
        let name = text(object, "name");
        let Some(rest) = name.strip_prefix("Speed_").or_else(|| name.strip_prefix("speed_")) else {
            continue;
        };
        let rest = rest.strip_prefix("STATIC_").unwrap_or(rest);
        let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
        let mut reference = reference(object, "id", road, &mut numbers);
        let Ok(value) = digits.parse::<f64>() else {
            let wanted = "a number after Speed_ in an object's name";
            numbers.report.add(Some(road.id), Some(reference.s), wanted, shown(name));
            continue;
        };
        reference.validities.clear();
        let mut signal = signal(object, &reference, &mut numbers);
        // A heading of the object turns what is drawn, not whom it addresses.
        signal.heading_offset_rad = numbers.optional(object, "hdg");
        signal.signal_type = "274".to_owned();
        signal.country = "OpenDRIVE".to_owned();
        signal.unit = "mph".to_owned();
        (signal.subtype, signal.text, signal.value) = (digits.clone(), digits, value);
        signals.definitions.insert(reference.signal.clone(), signal);
        signals.references.push(reference);
    }
}
