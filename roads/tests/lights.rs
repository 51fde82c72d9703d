//! Traffic lights, signs and speed limits of our own towns and of real maps.

#[path = "common/towns.rs"]
mod generated;
#[path = "common/grid.rs"]
mod grid;
#[path = "common/maps.rs"]
mod maps;

use std::collections::{BTreeMap, BTreeSet};

use generated::towns;
use nalgebra::Point3;
use roads::{LaneType, LaneTypes, Map, SignKind, TrafficLights, TriggerBox, Waypoint};

type Lane = (u32, u32, i32);

fn key(place: &Waypoint) -> Lane {
    (place.road, place.section, place.lane)
}

fn heading(map: &Map, place: &Waypoint) -> f64 {
    map.lane_pose(place).expect("a place of this map").heading_rad
}

fn turn_rad(from_rad: f64, to_rad: f64) -> f64 {
    let turn = to_rad - from_rad;
    turn.sin().atan2(turn.cos()).abs()
}

/// Panics unless the middle of the box is the middle of its lane and its corners are inside it.
fn assert_on_lane(map: &Map, trigger: &TriggerBox, what: &str) {
    let name = map.name();
    let info = map.lane(&trigger.middle);
    assert_eq!(info.lane_type, LaneType::Driving, "{name}: {what}: {trigger:?}");
    let gap = map.pose(&trigger.middle).translation.vector - trigger.pose.translation.vector;
    assert!(gap.norm() < 1e-9, "{name}: {what}: {trigger:?}");
    assert!(trigger.half_extent_m.y * 2.0 < info.width_m.max(1e-9), "{name}: {what}: {trigger:?}");
    assert!(turn_rad(heading(map, &trigger.middle), heading(map, &trigger.front)) < 0.5);
}

#[test]
fn every_light_of_our_towns_holds_lanes_and_vehicles_wait_right_before_the_junction() {
    let mut count = 0;
    for map in towns() {
        for light in map.traffic_lights().lights {
            assert!(!light.lanes.is_empty(), "{}: {light:?}", map.name());
            assert!(!light.boxes.is_empty(), "{}: {light:?}", map.name());
            for lane in &light.lanes {
                assert_eq!(map.lane(lane).lane_type, LaneType::Driving);
                assert!(map.lane(lane).is_junction, "{}: {light:?}", map.name());
            }
            for trigger in &light.boxes {
                assert_on_lane(&map, trigger, &light.id);
                let on_ground = Point3::from(trigger.pose.translation.vector);
                let found = map.inside(on_ground, LaneTypes::DRIVING).expect("a lane is there");
                assert_eq!(key(&found), key(&trigger.middle), "{}: {light:?}", map.name());
                assert!(!map.lane(&trigger.middle).is_junction, "{}: {light:?}", map.name());
                // Its front lies 1.5 m before the junction, its light stands near.
                let inside = |ahead_m| {
                    let on = map.next(&trigger.front, ahead_m);
                    on.iter().filter(|place| map.lane(place).is_junction).count()
                };
                assert!(inside(1.4) == 0 && inside(1.6) > 0, "{}: {light:?}", map.name());
                let away_m = (trigger.pose.translation.vector - light.pose.point.coords).norm();
                assert!(away_m < 20.0, "{}: {away_m} m, {light:?}", map.name());
                let own_rad = light.pose.heading_rad;
                assert!(turn_rad(own_rad, heading(&map, &trigger.middle)) < 0.2);
                count += 1;
            }
        }
    }
    assert!(count > 300, "{count}");
}

/// Panics unless lights, controllers and groups name each other, each light once.
fn assert_arranged(map: &Map, lights: &TrafficLights) {
    let name = map.name();
    let mut turns = vec![0; lights.controllers.len()];
    let mut shown = vec![0; lights.lights.len()];
    for (group, members) in lights.groups.iter().enumerate() {
        assert!(!members.controllers.is_empty(), "{name}");
        for controller in &members.controllers {
            turns[*controller] += 1;
            assert_eq!(lights.controllers[*controller].group, group, "{name}");
        }
    }
    for (index, controller) in lights.controllers.iter().enumerate() {
        assert!(!controller.lights.is_empty(), "{name}");
        for light in &controller.lights {
            shown[*light] += 1;
            assert_eq!(lights.lights[*light].controller, index, "{name}");
        }
    }
    assert!(turns.iter().chain(&shown).all(|count| *count == 1), "{name}: {lights:?}");
    let junctions: Vec<u32> = lights.groups.iter().filter_map(|group| group.junction).collect();
    assert_eq!(junctions.iter().collect::<BTreeSet<_>>().len(), junctions.len(), "{name}");
}

#[test]
fn groups_hold_every_light_once_and_junctions_have_one_group() {
    for map in towns() {
        let lights = map.traffic_lights();
        assert_arranged(&map, &lights);
        assert!(lights.groups.iter().all(|group| group.junction.is_some()), "{}", map.name());
        assert!(lights.groups.iter().all(|group| group.controllers.len() > 1), "{}", map.name());
    }
}

/// The way through a junction from a lane's entry, one place per metre.
fn way(map: &Map, from: &Waypoint) -> Vec<Waypoint> {
    let steps = std::iter::successors(Some(*from), |place| map.next(place, 1.0).first().copied());
    steps.take_while(|place| key(place) == key(from)).collect()
}

fn goes_straight(map: &Map, way: &[Waypoint]) -> bool {
    let (Some(first), Some(last)) = (way.first(), way.last()) else { return false };
    turn_rad(heading(map, first), heading(map, last)) < 0.5
}

#[test]
fn crossing_ways_straight_on_are_never_green_together() {
    let mut compared = 0;
    for map in towns() {
        let lights = map.traffic_lights();
        for controller in &lights.controllers {
            let held = controller.lights.iter().flat_map(|light| &lights.lights[*light].lanes);
            let ways: Vec<Vec<Waypoint>> =
                held.map(|lane| way(&map, lane)).filter(|way| goes_straight(&map, way)).collect();
            for (index, one) in ways.iter().enumerate() {
                for other in &ways[index + 1..] {
                    let angle = turn_rad(heading(&map, &one[0]), heading(&map, &other[0]));
                    let crossing = angle > 0.5 && angle < std::f64::consts::PI - 0.5;
                    assert!(
                        !crossing,
                        "{}: {controller:?}, {:?} {:?}",
                        map.name(),
                        one[0],
                        other[0]
                    );
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn every_lane_into_a_junction_with_lights_is_held_by_one_of_them() {
    for map in towns() {
        let lights = map.traffic_lights();
        let ruled: BTreeSet<u32> =
            lights.groups.iter().filter_map(|group| group.junction).collect();
        let mut boxes: BTreeMap<Lane, usize> = BTreeMap::new();
        for trigger in lights.lights.iter().flat_map(|light| &light.boxes) {
            *boxes.entry(key(&trigger.middle)).or_default() += 1;
        }
        for (from, to) in map.lane_joints() {
            let into = map.lane(&to).junction_id.filter(|junction| ruled.contains(junction));
            let driving = map.lane(&from).lane_type == LaneType::Driving;
            if into.is_some() && driving && !map.lane(&from).is_junction {
                assert_eq!(boxes.get(&key(&from)), Some(&1), "{}: {from:?}", map.name());
            }
        }
    }
}

#[test]
fn signs_of_our_towns_stand_before_the_place_where_they_count() {
    let mut kinds = [0; 3];
    for map in towns() {
        for sign in map.traffic_signs() {
            let kind = match sign.kind {
                SignKind::Stop => 0,
                SignKind::Yield => 1,
                SignKind::SpeedLimit { .. } => 2,
            };
            kinds[kind] += 1;
            assert!(!sign.boxes.is_empty(), "{}: {sign:?}", map.name());
            for trigger in &sign.boxes {
                assert_on_lane(&map, trigger, &sign.id);
                let beside = trigger.pose.inverse_transform_point(&sign.pose.point);
                // To the right of the lane, and as far along as the front of the box, but for
                // bends.
                assert!(beside.y < -1.0, "{}: {sign:?}", map.name());
                let ahead_m = beside.x - trigger.half_extent_m.x;
                assert!(ahead_m.abs() < 1.0, "{}: {ahead_m} m, {sign:?}", map.name());
                let inside = |place: &Waypoint| map.lane(place).is_junction;
                let to_junction = map.next(&trigger.front, 1.5).iter().any(inside);
                // Town07 has a road of two metres between two junctions.
                let is_short = map.previous(&trigger.front, 2.5).iter().any(inside);
                let may_be = if kind < 2 { to_junction } else { !to_junction || is_short };
                assert!(may_be, "{}: {sign:?}", map.name());
            }
        }
    }
    assert!(kinds.iter().all(|count| *count > 5), "{kinds:?}");
}

#[test]
fn behind_a_sign_its_limit_holds_and_elsewhere_that_of_the_road_or_the_one_before() {
    /// Limits stand this far behind the junctions of our towns.
    const SIGN_AFTER_M: f64 = 12.0;
    for map in towns() {
        for place in map.generate_waypoints(5.0).unwrap() {
            let limit_mps = map.speed_limit_mps(&place);
            let by_type_mps = map.lane(&place).speed_limit_mps;
            assert!(limit_mps.is_some(), "{}: {place:?}", map.name());
            let before = map.previous(&place, SIGN_AFTER_M + 0.1);
            let leaves_junction = before.iter().any(|place| map.lane(place).is_junction);
            if !leaves_junction && !map.lane(&place).is_junction {
                let off_mps = limit_mps.unwrap_or(0.0) - by_type_mps.unwrap_or(0.0);
                assert!(off_mps.abs() < 1e-9, "{}: {limit_mps:?} at {place:?}", map.name());
            }
        }
    }
}

#[test]
fn a_limit_holds_round_a_ring_until_the_next_sign_and_for_its_lanes_only() {
    let signal = |id: u32, kmh: u32| {
        format!(
            "<signals><signal id=\"{id}\" s=\"10\" t=\"-4\" zOffset=\"0\" orientation=\"-\" \
             dynamic=\"no\" type=\"274\" subtype=\"{kmh}\" value=\"{kmh}\" unit=\"mph\"/></signals>"
        )
    };
    let mut roads: Vec<String> =
        grid::grid(9).split_inclusive("</road>").map(str::to_owned).collect();
    roads[2] = roads[2].replace("</road>", &format!("{}</road>", signal(70, 30)));
    roads[5] = roads[5].replace("</road>", &format!("{}</road>", signal(71, 50)));
    let map = Map::parse("ring", &roads.concat()).unwrap_or_else(|error| panic!("{error}"));
    let kmh_at = |road, s| {
        let limit_mps = map.speed_limit_mps(&Waypoint { road, section: 0, lane: -1, s });
        limit_mps.map(|mps| (mps * 3.6).round())
    };
    assert_eq!(
        [kmh_at(3, 9.9), kmh_at(3, 10.1), kmh_at(5, 3.0)],
        [Some(50.0), Some(30.0), Some(30.0)]
    );
    assert_eq!(
        [kmh_at(6, 9.9), kmh_at(6, 10.1), kmh_at(1, 3.0)],
        [Some(30.0), Some(50.0), Some(50.0)]
    );
    assert_eq!(kmh_at(99, 1.0), None);
    assert!(map.has_speed_limit_signs());
}

#[test]
fn where_nothing_is_posted_there_is_no_limit() {
    let map = Map::parse("ring", &grid::grid(9)).unwrap_or_else(|error| panic!("{error}"));
    let place = Waypoint { road: 1, section: 0, lane: -1, s: 1.0 };
    assert_eq!(map.speed_limit_mps(&place), None);
    assert_eq!(map.traffic_lights(), TrafficLights::default());
    assert!(map.traffic_signs().is_empty() && !map.has_speed_limit_signs());
}

#[test]
fn real_maps_have_boxes_on_their_lanes_and_every_light_in_one_group() {
    for judged in maps::all() {
        let lights = judged.map.traffic_lights();
        assert_arranged(&judged.map, &lights);
        let signs = judged.map.traffic_signs();
        let of_lights = lights.lights.iter().flat_map(|light| &light.boxes);
        for trigger in of_lights.chain(signs.iter().flat_map(|sign| &sign.boxes)) {
            assert_on_lane(&judged.map, trigger, "box");
        }
        let holding = lights.lights.iter().filter(|light| !light.boxes.is_empty()).count();
        println!(
            "{}: {} lights, {holding} hold lanes, {} controllers, {} groups, {} signs",
            judged.name,
            lights.lights.len(),
            lights.controllers.len(),
            lights.groups.len(),
            signs.len()
        );
        // (lights, groups) as CARLA's own towns and our example have them.
        let known = match judged.name.as_str() {
            "Town01" => Some((36, 12)),
            "example-junction" => Some((4, 1)),
            _ => None,
        };
        if let Some((count, groups)) = known {
            assert_eq!((lights.lights.len(), lights.groups.len()), (count, groups));
            assert_eq!(holding, count, "{}", judged.name);
        }
    }
}
