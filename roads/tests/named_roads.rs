//! Roads that programs of CARLA's users name by their numbers are in our towns.

#[path = "common/towns.rs"]
mod generated;

use std::collections::BTreeSet;

use generated::town;
use nalgebra::Point3;
use roads::{LaneType, LaneTypes, Map, Waypoint, mesh};

/// What scenario_runner's and the leaderboard's `background_activity.py` asks for: road, lane and s
/// by CARLA's numbers. Beside it, a place on a driving lane inside of the junction that it is to
/// be part of, in our frame; none where it is to be part of one that nobody drives through.
type Asked = (u32, i32, f64, Option<[f64; 2]>);

/// The middle of Town03's roundabout, and how far its junctions reach from there, in metres.
const RING: ([f64; 2], f64) = ([-0.5, -0.4], 40.0);
const RING_EAST: Option<[f64; 2]> = Some([21.3, -0.4]);
const RING_NORTH: Option<[f64; 2]> = Some([-0.5, 21.4]);
const RING_WEST: Option<[f64; 2]> = Some([-22.3, -0.4]);
const RING_SOUTH: Option<[f64; 2]> = Some([-0.5, -22.2]);

const TOWN03: [Asked; 8] = [
    (1100, -5, 16.6, RING_EAST),
    (1624, -5, 25.3, RING_NORTH),
    (1655, -5, 8.3, RING_WEST),
    (1772, 3, 16.2, RING_SOUTH),
    (1206, -5, 5.9, RING_EAST),
    (1031, -1, 11.3, None),
    (100, -1, 18.8, None),
    (1959, -1, 22.7, None),
];
const TOWN04: [Asked; 3] = [(518, -1, 8.1, None), (886, 1, 10.11, None), (467, 1, 25.8, None)];

fn towns() -> [(Map, Vec<Asked>); 2] {
    [(town("Town03"), TOWN03.to_vec()), (town("Town04"), TOWN04.to_vec())]
}

#[test]
fn what_background_traffic_asks_for_is_there_and_part_of_its_junction() {
    for (map, asked) in towns() {
        for (road, lane, s, place) in asked {
            let what = format!("{}: road {road}", map.name());
            let found = map.waypoint(road, lane, s).expect(&what);
            let junction = map.lane(&found).junction_id.expect(&what);
            let Some([x, y]) = place else { continue };
            let inside = map.nearest(Point3::new(x, y, 0.0), LaneTypes::DRIVING).expect(&what);
            assert_eq!(map.lane(&inside).junction_id, Some(junction), "{what}");
        }
    }
}

/// Background traffic joins the junctions of the roads that it asks for, and scenario_runner 0.9.16
/// raises where a route comes through one of them: on CARLA's roundabout, and on ours.
#[test]
fn of_the_junctions_that_are_joined_only_those_of_the_roundabout_are_driven_through() {
    for (map, asked) in towns() {
        let of = |place: &Waypoint| map.lane(place).junction_id;
        let junctions = |on_ring: bool| -> BTreeSet<u32> {
            asked
                .iter()
                .filter(|(.., place)| place.is_some() == on_ring)
                .filter_map(|(road, lane, s, _)| of(&map.waypoint(*road, *lane, *s)?))
                .collect()
        };
        let [joined, apart] = [junctions(true), junctions(false)];
        let mut met = BTreeSet::new();
        for place in map.generate_waypoints(1.0).unwrap() {
            let Some(junction) = of(&place) else { continue };
            assert!(!apart.contains(&junction), "{}: {place:?}", map.name());
            if joined.contains(&junction) {
                let ([x, y], reach_m) = RING;
                let point = map.lane_pose(&place).unwrap().point;
                assert!((point.x - x).hypot(point.y - y) < reach_m, "{}: {place:?}", map.name());
                met.insert(junction);
            }
        }
        assert_eq!(met, joined, "{}", map.name());
    }
}

/// They lie where nobody drives, walks or is led.
#[test]
fn nobody_drives_there() {
    for (map, asked) in towns() {
        let roads: BTreeSet<u32> = asked.iter().map(|(road, ..)| *road).collect();
        let drive = map.driving_lanes().into_iter().chain(map.topology());
        let drive = drive.flat_map(|(from, to)| [from, to]);
        let drive = drive.chain(map.generate_waypoints(2.0).unwrap());
        let named: Vec<Waypoint> = drive.filter(|place| roads.contains(&place.road)).collect();
        assert_eq!(named, [], "{}", map.name());
        for (road, lane, s, _) in asked {
            let place = map.waypoint(road, lane, s).unwrap();
            let what = format!("{}: {place:?}", map.name());
            assert_eq!(map.lane(&place).lane_type, LaneType::None, "{what}");
            assert_eq!(map.next(&place, 100.0), [], "{what}");
            assert_eq!(map.previous(&place, 100.0), [], "{what}");
            let middle = map.lane_pose(&place).unwrap().point;
            let over = map.inside(middle, LaneTypes::ANY);
            assert_eq!(over, None, "{what}: a lane lies there");
        }
    }
}

/// A strip of another height would stand out of the grass.
#[test]
fn nothing_is_paved_there() {
    for (map, asked) in towns() {
        let ground = mesh::ground(&map);
        for (road, lane, ..) in asked {
            let start = map.lane_pose(&map.waypoint(road, lane, 0.0).unwrap()).unwrap().point;
            let near = |corner: &&[f32; 3]| {
                let [x, y, _] = corner.map(f64::from);
                (x - start.x).hypot(y - start.y) < 0.25
            };
            assert_eq!(ground.positions_m.iter().find(near), None, "{}: {road}", map.name());
            let name = format!("Road_{road}");
            assert!(map.environment_objects().iter().all(|object| object.name != name), "{name}");
        }
    }
}

/// `.xosc` examples of scenario_runner begin here, on the street that leads east 131.5 m south of
/// the origin: 48.58 m from its western end, on the right.
#[test]
fn road_4_of_town01_is_the_street_that_carla_has_there() {
    let map = town("Town01");
    let pose = map.lane_pose(&map.waypoint(4, -1, 48.58).unwrap()).unwrap();
    let carla = Point3::new(150.0, -133.4, 0.0);
    assert!((pose.point - carla).norm() < 2.0, "{pose:?}");
    assert!(pose.heading_rad.abs() < 0.01, "{pose:?}");
}
