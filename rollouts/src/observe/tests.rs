use std::collections::BTreeSet;

use schemas::TrafficLightColour as Colour;

use super::*;
use crate::course::Course;
use crate::scene::Neighbour;
use crate::spec::Spec;

const KINDS: [(Observation, usize); 3] =
    [(Observation::Route, 46), (Observation::Drive, 210), (Observation::Wide, 1_847)];

#[test]
fn columns_have_different_names_and_blocks_are_all_of_them() {
    for (observation, width) in KINDS {
        let columns = observation.columns();
        let names: BTreeSet<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!((columns.len(), names.len(), observation.width()), (width, width, width));
        assert!(columns.iter().all(|column| column.low < column.high && column.scale > 0.0));
        for block in observation.blocks() {
            let prefix = format!("{}.", block.name);
            let of_block = &columns[block.first..block.first + block.count * block.width];
            assert!(of_block.iter().all(|column| column.name.starts_with(&prefix)), "{block:?}");
        }
    }
}

fn course() -> Course {
    let spec = Spec { town: "Town02".to_owned(), lights: Some(true), ..Spec::default() };
    let text = ::roads::town::build("Town02").unwrap();
    let map = Arc::new(::roads::Map::parse("Town02", &text).unwrap());
    Course::new(&spec, map).unwrap()
}

/// The row of a vehicle at one of the course's starts, with others around it.
fn encoded(observation: Observation, normalise: bool, others: &[Neighbour]) -> Vec<f32> {
    encoded_at(0.0, observation, normalise, others)
}

/// The same so far to the east of the start.
fn encoded_at(
    east_m: f32,
    observation: Observation,
    normalise: bool,
    others: &[Neighbour],
) -> Vec<f32> {
    let course = course();
    let start = &course.start(3).agents[0];
    let forward = start.pose.rotation * schemas::Vec3::x();
    let at = start.pose.translation.vector + schemas::Vec3::x() * east_m;
    let motion =
        Motion { x_m: at.x, y_m: at.y, cos: forward.x, sin: forward.y, ..Motion::default() };
    let shape = Shape { length_m: 4.9, width_m: 1.9, rear_m: 1.4 };
    let own = Neighbour::agent(&motion, shape, true);
    let placed = others.iter().map(|other| Neighbour {
        x_m: at.x + other.x_m * forward.x - other.y_m * forward.y,
        y_m: at.y + other.x_m * forward.y + other.y_m * forward.x,
        ..*other
    });
    let count = course.lines.iter().map(|line| line.light + 1).max().unwrap_or(0);
    let scene = Scene {
        everybody: std::iter::once(own).chain(placed).collect(),
        colours: vec![Colour::Green; count],
    };
    let place = start.route.abreast(at.x, at.y, 0);
    let light = Some(LightAhead { at_m: place.at_m + 20.0, light: 0, colour: Colour::Red });
    let view = View {
        motion: &motion,
        shape,
        route: &start.route,
        place: &place,
        last: Action::default(),
        light,
        index: 0,
        scene: &scene,
    };
    let encoder = Encoder::new(observation, normalise, &course.map, &course.lines);
    let mut row = vec![f32::NAN; encoder.width()];
    encoder.encode(&view, &mut row);
    row
}

fn other(x_m: f32, y_m: f32, is_walker: bool) -> Neighbour {
    Neighbour { x_m, y_m, cos: 1.0, length_m: 4.0, width_m: 1.8, is_walker, ..Neighbour::default() }
}

fn there(x_m: f32, y_m: f32) -> Neighbour {
    Neighbour { is_there: true, ..other(x_m, y_m, false) }
}

#[test]
fn drive_shows_the_nearest_first_and_the_light_ahead() {
    let gone = other(3.0, 0.0, false);
    let walker = Neighbour { is_walker: true, ..there(8.0, 2.0) };
    let row =
        encoded(Observation::Drive, false, &[there(30.0, 0.0), gone, walker, there(70.0, 0.0)]);
    let names: Vec<String> =
        Observation::Drive.columns().into_iter().map(|column| column.name).collect();
    let value = |name: &str| row[names.iter().position(|known| known == name).unwrap()];
    assert!((value("light.distance") - 20.0).abs() < 1.0e-3);
    assert_eq!((value("light.red"), value("light.green")), (1.0, 0.0));
    assert_eq!((value("partners.0.is_walker"), value("partners.0.is_vehicle")), (1.0, 0.0));
    // The frame begins at the rear axle, 1.4 m behind the middle.
    assert!(
        (value("partners.0.x") - 9.4).abs() < 1.0e-3
            && (value("partners.0.y") - 2.0).abs() < 1.0e-3
    );
    assert!((value("partners.1.x") - 31.4).abs() < 1.0e-3);
    assert_eq!((value("partners.1.is_vehicle"), value("partners.2.is_vehicle")), (1.0, 0.0));
}

#[test]
fn more_others_than_places_leave_the_nearest() {
    let many: Vec<Neighbour> =
        (0..90u8).rev().map(|at| there(f32::from(at) * 0.5 + 1.0, 0.0)).collect();
    for (observation, places) in [(Observation::Drive, 16), (Observation::Wide, 63)] {
        let row = encoded(observation, false, &many);
        let block = observation.blocks().into_iter().find(|it| it.name == "partners").unwrap();
        assert_eq!(block.count, places);
        let x = if observation == Observation::Drive { 2 } else { 0 };
        let farthest = (0..block.count).map(|at| row[block.first + at * block.width + x]);
        let farthest_m = farthest.fold(0.0_f32, f32::max);
        let wanted_m = 1.4 + 1.0 + 0.5 * (places as f32 - 1.0);
        assert!((farthest_m - wanted_m).abs() < 1.0e-2, "{farthest_m} {wanted_m}");
    }
}

#[test]
fn wide_rows_are_within_their_bounds_and_show_the_road_around() {
    let row = encoded(Observation::Wide, false, &[there(10.0, 3.0)]);
    let columns = Observation::Wide.columns();
    for (value, column) in row.iter().zip(&columns) {
        assert!((column.low..=column.high).contains(value), "{column:?}: {value}");
    }
    let block = Observation::Wide.blocks().into_iter().find(|it| it.name == "road").unwrap();
    let pieces: Vec<&[f32]> = row[block.first..].chunks_exact(block.width).collect();
    assert!(pieces.iter().all(|piece| piece[2].hypot(piece[3]) > 0.99), "all places are used");
    // A piece of the own lane's middle under the vehicle, along it.
    let own = pieces.iter().find(|it| it[6] == 0.0 && it[0].abs() < 4.0 && it[1].abs() < 0.8);
    assert!(own.is_some_and(|piece| piece[2] > 0.9), "{own:?}");
    assert!(pieces.iter().any(|piece| piece[6] == 2.0), "edges");
    let scaled = encoded(Observation::Wide, true, &[there(10.0, 3.0)]);
    for ((value, scaled), column) in row.iter().zip(&scaled).zip(&columns) {
        assert!((value * column.scale - scaled).abs() < 1.0e-5, "{column:?}");
    }
}

#[test]
fn far_off_the_map_all_columns_are_within_their_bounds() {
    for (observation, _) in KINDS {
        let row = encoded_at(900.0, observation, false, &[there(10.0, 3.0)]);
        for (value, column) in row.iter().zip(&observation.columns()) {
            assert!((column.low..=column.high).contains(value), "{column:?}: {value}");
        }
    }
}
