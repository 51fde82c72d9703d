//! `signal`, `signalReference` and `controller` elements, and objects that stand for signals.

use super::number::{Numbers, lane_id, number_or_zero, text};
use super::tree::Node;
use super::{child, children};
use crate::error::{Report, shown};
use crate::model::Road;
use crate::signals::{Orientation, Reference, Signal, SignalPose, Signals};
use nalgebra::Point3;

/// How far before a road's end a signal beyond it is moved, in metres.
const END_GAP_M: f64 = 1e-5;

/// The signals of the roads so far.
#[derive(Default)]
pub(super) struct Reading {
    pub(super) data: Signals,
    /// The client reads all signals before the objects that stand for some.
    objects: Vec<(Reference, Signal)>,
}

impl Reading {
    pub(super) fn add_road(&mut self, road: &Road, node: Node<'_, '_>, report: &mut Report) {
        let mut numbers = Numbers { road: road.id, report };
        for element in children(node, "signals").flat_map(|parent| parent.children()) {
            match element.name() {
                "signal" => {
                    let reference = reference(element, road, &mut numbers);
                    let signal = signal(element, &reference, &mut numbers);
                    self.add(reference, signal);
                }
                "signalReference" => {
                    self.data.references.push(reference(element, road, &mut numbers));
                }
                _ => {}
            }
        }
        let objects = children(node, "objects").flat_map(|parent| children(parent, "object"));
        self.objects.extend(objects.filter_map(|object| speed_object(object, road, &mut numbers)));
    }

    pub(super) fn end(mut self, report: &mut Report) -> Signals {
        for (reference, signal) in std::mem::take(&mut self.objects) {
            self.add(reference, signal);
        }
        for reference in &self.data.references {
            if !self.data.definitions.contains_key(&reference.signal) {
                let wanted = "signal references to signals of the map";
                let found = shown(&reference.signal);
                report.add(Some(reference.road), Some(reference.s), wanted, found);
            }
        }
        self.data
    }

    fn add(&mut self, reference: Reference, signal: Signal) {
        self.data.definitions.insert(reference.signal.clone(), signal);
        self.data.references.push(reference);
    }
}

fn reference(node: Node<'_, '_>, road: &Road, numbers: &mut Numbers<'_>) -> Reference {
    let s = numbers.required(node, "s");
    if s < 0.0 {
        let wanted = "signals at s of 0 or more";
        numbers.report.add(Some(road.id), Some(s), wanted, shown(text(node, "s")));
    }
    Reference {
        signal: text(node, "id").to_owned(),
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
fn speed_object(
    object: Node<'_, '_>,
    road: &Road,
    numbers: &mut Numbers<'_>,
) -> Option<(Reference, Signal)> {
    let name = text(object, "name");
    let rest = name.strip_prefix("Speed_").or_else(|| name.strip_prefix("speed_"))?;
    let rest = rest.strip_prefix("STATIC_").unwrap_or(rest);
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    let mut reference = reference(object, road, numbers);
    let Ok(value) = digits.parse::<f64>() else {
        let wanted = "a number after Speed_ in an object's name";
        numbers.report.add(Some(road.id), Some(reference.s), wanted, shown(name));
        return None;
    };
    reference.validities.clear();
    let mut signal = signal(object, &reference, numbers);
    // A heading of the object turns what is drawn, not whom it addresses.
    signal.heading_offset_rad = numbers.optional(object, "hdg");
    signal.signal_type = "274".to_owned();
    signal.country = "OpenDRIVE".to_owned();
    signal.unit = "mph".to_owned();
    (signal.subtype, signal.text, signal.value) = (digits.clone(), digits, value);
    Some((reference, signal))
}
