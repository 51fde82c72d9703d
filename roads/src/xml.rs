//! OpenDRIVE text to [`Model`]: every number is checked here, so later code need not ask.

mod lanes;
mod number;
mod objects;
mod reader;
mod road;
mod signals;
mod tree;

use std::collections::{BTreeMap, BTreeSet};

use crate::error::{Report, shown};
use crate::limits;
use crate::model::{Junction, Model, Road};
use crate::signals::Controller;
use number::{NUMBER_CHARS_MAX, id_or_zero, text};
use tree::Node;

/// Reads a map. Faults go to the report; what is returned is usable when the report is empty.
pub(crate) fn read(xodr: &str, report: &mut Report) -> Model {
    let xodr = xodr.strip_prefix('\u{feff}').unwrap_or(xodr);
    if xodr.len() > limits::TEXT_BYTES_MAX {
        let found = format!("{} bytes", xodr.len());
        report.add(None, None, format!("at most {} bytes", limits::TEXT_BYTES_MAX), found);
        return Model::default();
    }
    if let Some(zero) = memchr::memchr(0, xodr.as_bytes()) {
        let line = xodr.bytes().take(zero).filter(|byte| *byte == b'\n').count() + 1;
        let found = format!("a zero byte in line {line}, as UTF-16 and binary files have them");
        report.add(None, None, "UTF-8 text", found);
        return Model::default();
    }
    let mut reading = Reading::default();
    if let Err(refusal) = reader::parse(xodr, |is_root, node| reading.part(is_root, node)) {
        report.add(None, None, refusal.wanted, refusal.found);
        return Model::default();
    }
    reading.end(report)
}

/// What has been read of a map.
#[derive(Default)]
struct Reading {
    report: Report,
    is_map: bool,
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    roads: Vec<Road>,
    /// Metres of polynomials so far.
    polynomial_m: f64,
    signals: signals::Reading,
    junctions: Vec<NamedJunction>,
}

/// A junction whose connecting roads are not looked up yet.
struct NamedJunction {
    id: u32,
    /// Id of the connection, and the connecting road as it is written.
    connections: Vec<(u32, u32, String)>,
    controllers: Vec<String>,
}

impl Reading {
    fn part(&mut self, is_root: bool, node: Node<'_, '_>) {
        match node.name() {
            "OpenDRIVE" if is_root => self.is_map = true,
            other if is_root => {
                self.report.add(None, None, "a root element OpenDRIVE", shown(other));
            }
            _ if !self.is_map => {}
            "header" => self.geo_reference(node),
            "road" => self.road(node),
            "junction" => self.junctions.push(named_junction(node)),
            "controller" => self.signals.data.controllers.push(controller(node)),
            _ => {}
        }
    }

    fn geo_reference(&mut self, header: Node<'_, '_>) {
        let Some(reference) = child(header, "geoReference") else { return };
        let words = reference.text();
        let mut value = |key: &str| {
            let mut numbers = words.split_whitespace().filter_map(|word| word.strip_prefix(key));
            if let Some(none) = numbers.clone().find(|number| !is_degrees(number)) {
                let wanted = format!("a number after {key} in geoReference");
                self.report.add(None, None, wanted, shown(none));
            }
            numbers
                .find_map(|number| number.parse().ok())
                .filter(|degrees: &f64| degrees.abs() <= 360.0)
        };
        let place = [value("+lat_0="), value("+lon_0=")];
        self.latitude_deg = self.latitude_deg.or(place[0]);
        self.longitude_deg = self.longitude_deg.or(place[1]);
    }

    fn road(&mut self, node: Node<'_, '_>) {
        let Some(road) = road::read(node, &mut self.polynomial_m, &mut self.report) else { return };
        self.signals.add_road(&road, node, &mut self.report);
        self.roads.push(Road { place: self.roads.len(), ..road });
    }

    /// The roads in the order of their ids.
    fn sorted_roads(&mut self) -> Vec<Road> {
        let mut roads = std::mem::take(&mut self.roads);
        // Many maps list them so.
        if !roads.is_sorted_by(|a, b| a.id < b.id) {
            roads.sort_by_key(|road| road.id);
            for pair in roads.windows(2) {
                if let [a, b] = pair
                    && a.id == b.id
                {
                    let wanted = "road ids that are whole numbers and unique";
                    self.report.add(Some(b.id), None, wanted, "a second road");
                }
            }
        }
        roads
    }

    fn end(mut self, report: &mut Report) -> Model {
        let mut model = Model {
            roads: self.sorted_roads(),
            latitude_deg: self.latitude_deg,
            longitude_deg: self.longitude_deg,
            ..Model::default()
        };
        std::mem::swap(report, &mut self.report);
        if !self.is_map {
            return model;
        }
        model.junctions = junctions(self.junctions, &model, report);
        model.signals = self.signals.end(report);
        check_controllers(&model, report);
        if model.roads.is_empty() && report.is_empty() {
            report.add(None, None, "at least one road with lanes", "none");
        }
        model
    }
}

/// Whether the client can read it: it ends at text that does not begin with a number, and at
/// numbers too large or too small for double precision.
fn is_degrees(text: &str) -> bool {
    let is_word = |word: &str| {
        text.trim_start_matches(['+', '-']).get(..3).is_some_and(|t| t.eq_ignore_ascii_case(word))
    };
    let mantissa = text.split(['e', 'E']).next().unwrap_or(text);
    let is_zero = !mantissa.contains(|digit| ('1'..='9').contains(&digit));
    let fits = |number: f64| number.is_finite() && (is_zero || number.abs() >= f64::MIN_POSITIVE);
    let starts = (1..=text.len().min(NUMBER_CHARS_MAX)).rev().filter_map(|end| text.get(..end));
    let number = starts.filter_map(|start| start.parse().ok()).next();
    is_word("nan") || is_word("inf") || number.is_some_and(fits)
}

/// Elements with this name directly below `node`, whatever their namespace.
fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children_named(name)
}

/// What is made of each of those elements, in a list with no room to spare: maps are made of short
/// lists.
fn list<T>(node: Node<'_, '_>, name: &'static str, read: impl FnMut(Node<'_, '_>) -> T) -> Vec<T> {
    let mut list = Vec::with_capacity(children(node, name).count());
    list.extend(children(node, name).map(read));
    list
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

fn named_junction(node: Node<'_, '_>) -> NamedJunction {
    let connections = children(node, "connection").map(|connection| {
        let road = id_or_zero(connection, "connectingRoad");
        (id_or_zero(connection, "id"), road, text(connection, "connectingRoad").to_owned())
    });
    NamedJunction {
        id: id_or_zero(node, "id"),
        connections: connections.collect(),
        controllers: children(node, "controller").map(|c| text(c, "id").to_owned()).collect(),
    }
}

fn controller(node: Node<'_, '_>) -> Controller {
    let signals = children(node, "control").map(|control| text(control, "signalId").to_owned());
    Controller { id: text(node, "id").to_owned(), signals: signals.collect() }
}

fn junctions(named: Vec<NamedJunction>, model: &Model, report: &mut Report) -> Vec<Junction> {
    let mut junctions: BTreeMap<u32, Junction> = BTreeMap::new();
    for NamedJunction { id, connections: named, controllers } in named {
        let mut connections: BTreeMap<u32, u32> = BTreeMap::new();
        for (connection, road, written) in named {
            if model.road(road).is_none() {
                let wanted = format!("junction {id} to connect through roads of the map");
                report.add(None, None, wanted, shown(&written));
                continue;
            }
            connections.entry(connection).or_insert(road);
        }
        let mut connecting_roads: Vec<u32> = connections.into_values().collect();
        let mut sorted = connecting_roads.clone();
        sorted.sort_unstable();
        let again = sorted.chunk_by(|a, b| a == b).filter(|alike| alike.len() > 1);
        let mut repeated_roads: Vec<u32> =
            again.filter_map(|alike| alike.first().copied()).collect();
        connecting_roads.dedup();
        let junction = junctions.entry(id).or_insert(Junction {
            id,
            connecting_roads: Vec::new(),
            repeated_roads: Vec::new(),
            controllers: Vec::new(),
        });
        junction.connecting_roads.append(&mut connecting_roads);
        junction.repeated_roads.append(&mut repeated_roads);
        junction.controllers.extend(controllers);
    }
    junctions.into_values().collect()
}

/// A junction must not list a controller of unknown signals; nobody minds one that no junction
/// lists.
fn check_controllers(model: &Model, report: &mut Report) {
    let listed: BTreeSet<&String> =
        model.junctions.iter().flat_map(|junction| &junction.controllers).collect();
    for Controller { id, signals } in &model.signals.controllers {
        for signal in signals {
            if listed.contains(id) && !model.signals.definitions.contains_key(signal) {
                let wanted = format!("signals of the map in controller {}", shown(id));
                report.add(None, None, wanted, shown(signal));
            }
        }
    }
}
