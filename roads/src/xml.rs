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
use crate::size;
use number::{id_or_zero, text};
use tree::Node;

/// Reads a map. Faults go to the report; what is returned is usable when the report is empty.
pub(crate) fn read(xodr: &str, report: &mut Report) -> Model {
    let xodr = xodr.strip_prefix('\u{feff}').unwrap_or(xodr);
    let mut model = Model::default();
    if xodr.len() > limits::TEXT_BYTES_MAX {
        let found = format!("{} bytes", xodr.len());
        report.add(None, None, format!("at most {} bytes", limits::TEXT_BYTES_MAX), found);
        return model;
    }
    let document = match reader::parse(xodr) {
        Ok(document) => document,
        Err(refusal) => {
            report.add(None, None, refusal.wanted, refusal.found);
            return model;
        }
    };
    let root = document.root();
    if root.name() != "OpenDRIVE" {
        report.add(None, None, "a root element OpenDRIVE", shown(root.name()));
        return model;
    }
    read_geo_reference(root, &mut model);
    model.roads = read_roads(root, report);
    model.junctions = read_junctions(root, &model, report);
    size::check(&model, report);
    model.signals = signals::read(root, &model.roads, report);
    check_controllers(root, &model, report);
    if model.roads.is_empty() && report.is_empty() {
        report.add(None, None, "at least one road with lanes", "none");
    }
    model
}

/// Elements with this name directly below `node`, whatever their namespace.
fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.name() == name)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

fn read_geo_reference(root: Node<'_, '_>, model: &mut Model) {
    let Some(reference) = child(root, "header").and_then(|header| child(header, "geoReference"))
    else {
        return;
    };
    let words = reference.text();
    let value = |key: &str| {
        words
            .split_whitespace()
            .find_map(|word| word.strip_prefix(key))
            .and_then(|number| number.parse::<f64>().ok())
            .filter(|degrees| degrees.abs() <= 360.0)
    };
    model.latitude_deg = value("+lat_0=");
    model.longitude_deg = value("+lon_0=");
}

fn read_roads(root: Node<'_, '_>, report: &mut Report) -> Vec<Road> {
    let mut roads: BTreeMap<u32, Road> = BTreeMap::new();
    let mut polynomial_m = 0.0;
    for node in children(root, "road") {
        let Some(road) = road::read(node, &mut polynomial_m, report) else { continue };
        let id = road.id;
        if roads.insert(id, road).is_some() {
            report.add(
                Some(id),
                None,
                "road ids that are whole numbers and unique",
                "a second road",
            );
        }
    }
    roads.into_values().collect()
}

fn read_junctions(root: Node<'_, '_>, model: &Model, report: &mut Report) -> Vec<Junction> {
    let mut junctions: BTreeMap<u32, Junction> = BTreeMap::new();
    for node in children(root, "junction") {
        let id = id_or_zero(node, "id");
        let mut connections: BTreeMap<u32, u32> = BTreeMap::new();
        for connection in children(node, "connection") {
            let road = id_or_zero(connection, "connectingRoad");
            if model.road(road).is_none() {
                let wanted = format!("junction {id} to connect through roads of the map");
                report.add(None, None, wanted, shown(text(connection, "connectingRoad")));
                continue;
            }
            connections.entry(id_or_zero(connection, "id")).or_insert(road);
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
        let controllers = children(node, "controller").map(|c| text(c, "id").to_owned());
        junction.controllers.extend(controllers);
    }
    junctions.into_values().collect()
}

/// A junction must not list a controller of unknown signals; nobody minds one that no junction
/// lists.
fn check_controllers(root: Node<'_, '_>, model: &Model, report: &mut Report) {
    let listed: BTreeSet<&str> = children(root, "junction")
        .flat_map(|junction| children(junction, "controller"))
        .map(|controller| text(controller, "id"))
        .collect();
    for controller in children(root, "controller") {
        let id = text(controller, "id");
        for signal in children(controller, "control").map(|control| text(control, "signalId")) {
            if listed.contains(id) && !model.signals.definitions.contains_key(signal) {
                let wanted = format!("signals of the map in controller {}", shown(id));
                report.add(None, None, wanted, shown(signal));
            }
        }
    }
}
