//! All generated towns, read back through the parser: every lane can be driven, and driven on.

#[path = "common/towns.rs"]
mod generated;

use std::collections::{BTreeMap, BTreeSet};

use generated::town;
use nalgebra::Point3;
use roads::town::Style;
use roads::{LaneChange, LaneType, LaneTypes, Map, Waypoint};

type Lane = (u32, u32, i32);

/// One of each pair of names, and some new towns of each style.
fn towns() -> Vec<Map> {
    let mut maps: Vec<Map> = generated::towns().collect();
    assert_eq!(maps.len(), 8);
    for style in [Style::City, Style::Village, Style::Country] {
        for (seed, blocks) in [(1, 2), (2, 3), (u64::MAX, 4), (77, 6)] {
            maps.push(styled(style, seed, blocks));
        }
    }
    maps
}

fn styled(style: Style, seed: u64, blocks: usize) -> Map {
    let text = roads::town::build_styled(style, seed, blocks);
    let name = format!("{style:?} {seed} {blocks}");
    Map::parse(&name, &text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_new_town_depends_on_style_seed_and_size_only() {
    let build = roads::town::build_styled;
    assert_eq!(build(Style::City, 5, 3), build(Style::City, 5, 3));
    assert_ne!(build(Style::City, 5, 3), build(Style::City, 6, 3));
    assert_ne!(build(Style::City, 5, 3), build(Style::Village, 5, 3));
    let places = |blocks| styled(Style::Village, 5, blocks).generate_waypoints(10.0).unwrap().len();
    assert!(places(6) > 2 * places(3));
    assert_eq!(places(0), places(2));
    assert_eq!(places(usize::MAX), places(10));
}

fn key(place: &Waypoint) -> Lane {
    (place.road, place.section, place.lane)
}

#[test]
fn a_town_is_the_same_in_every_run_and_under_both_of_its_names() {
    for name in generated::names() {
        let text = roads::town::build(name).unwrap();
        assert_eq!(text, roads::town::build(name).unwrap());
        let twin = format!("{name}_Opt");
        let renamed = text.replace(&format!("name=\"{name}\""), &format!("name=\"{twin}\""));
        assert_eq!(renamed, roads::town::build(&twin).unwrap());
    }
}

#[test]
fn lane_ends_meet_within_a_centimetre_and_a_tenth_of_a_degree() {
    for map in towns() {
        for (from, to) in map.lane_joints() {
            let (end, start) = (map.pose(&from), map.pose(&to));
            let gap_m = (end.translation.vector - start.translation.vector).norm();
            assert!(gap_m < 0.01, "{}: {gap_m} m between {from:?} and {to:?}", map.name());
            let turn_rad = end.rotation.angle_to(&start.rotation);
            let limit_rad = 0.1_f64.to_radians();
            assert!(turn_rad < limit_rad, "{}: {turn_rad} rad, {from:?} {to:?}", map.name());
        }
    }
}

/// Lanes that traffic in a lane can go on to: ahead, and beside where the line may be crossed.
fn ways_on(map: &Map) -> BTreeMap<Lane, BTreeSet<Lane>> {
    let mut ways: BTreeMap<Lane, BTreeSet<Lane>> = BTreeMap::new();
    let driving = |place: &Waypoint| map.lane(place).lane_type == LaneType::Driving;
    for place in map.generate_waypoints(2.0).expect("a step above 0") {
        let on = ways.entry(key(&place)).or_default();
        let change = map.lane(&place).lane_change;
        if matches!(change, LaneChange::Left | LaneChange::Both) {
            on.extend(map.left_driving(&place).as_ref().map(key));
        }
        if matches!(change, LaneChange::Right | LaneChange::Both) {
            on.extend(map.right_driving(&place).as_ref().map(key));
        }
    }
    for (from, to) in map.lane_joints() {
        if driving(&from) && driving(&to) {
            ways.entry(key(&from)).or_default().insert(key(&to));
        }
    }
    ways
}

fn reached(ways: &BTreeMap<Lane, BTreeSet<Lane>>, start: Lane) -> BTreeSet<Lane> {
    let mut reached = BTreeSet::from([start]);
    let mut pending = vec![start];
    while let Some(lane) = pending.pop() {
        for next in ways.get(&lane).into_iter().flatten() {
            if reached.insert(*next) {
                pending.push(*next);
            }
        }
    }
    reached
}

#[test]
fn from_every_driving_lane_every_other_can_be_reached() {
    for map in towns() {
        let ways = ways_on(&map);
        let mut back: BTreeMap<Lane, BTreeSet<Lane>> = BTreeMap::new();
        for (from, followers) in &ways {
            for to in followers {
                back.entry(*to).or_default().insert(*from);
            }
        }
        let lanes: BTreeSet<Lane> = ways.keys().copied().collect();
        let start = *lanes.first().unwrap();
        for (graph, what) in [(&ways, "not reached"), (&back, "no way back from")] {
            let missing: Vec<_> = lanes.difference(&reached(graph, start)).copied().collect();
            assert!(missing.is_empty(), "{}: {what}: {missing:?}", map.name());
        }
    }
}

#[test]
fn every_driving_lane_leads_on_and_somewhere_leads_into_it() {
    for map in towns() {
        let joints: Vec<(Lane, Lane)> =
            map.lane_joints().iter().map(|(from, to)| (key(from), key(to))).collect();
        let ends: BTreeSet<Lane> = joints.iter().map(|(from, _)| *from).collect();
        for lane in map.generate_waypoints(2.0).unwrap().iter().map(key) {
            assert!(ends.contains(&lane), "{}: {lane:?} ends nowhere", map.name());
        }
    }
}

#[test]
fn spawn_points_lie_on_driving_lanes_half_a_metre_up_and_look_along_them() {
    for map in towns() {
        assert!(map.spawn_points().len() > 40, "{}: {}", map.name(), map.spawn_points().len());
        for spawn in map.spawn_points() {
            let on_road = spawn.translation.vector - nalgebra::Vector3::z() * 0.5;
            let place = map.nearest(on_road.into(), LaneTypes::ANY).unwrap();
            let info = map.lane(&place);
            assert_eq!(info.lane_type, LaneType::Driving, "{}: {place:?}", map.name());
            assert!(!info.is_junction, "{}: {place:?}", map.name());
            let pose = map.pose(&place);
            let gap = spawn.translation.vector - pose.translation.vector;
            // The client counts metres of a chord as metres of the road, which is 0.6 m wrong along
            // the outer lane of a wide road in a bend.
            let apart = pose.inverse_transform_vector(&gap);
            assert!(apart.y.abs() < 0.1, "{}: {place:?} is {apart} off", map.name());
            assert!(apart.x.abs() < 0.75, "{}: {place:?} is {apart} off", map.name());
            assert!((0.2..=0.8).contains(&gap.z), "{}: {place:?} is {gap} off", map.name());
        }
    }
}

#[test]
fn houses_trees_and_posts_stand_off_all_driving_lanes() {
    for map in towns() {
        for place in map.generate_waypoints(3.0).unwrap() {
            let pose = map.pose(&place);
            for thing in map.scenery() {
                // From a tyre's height to a lorry's; a road may lead over or under things.
                let local = thing.pose.inverse_transform_point(&pose.translation.vector.into());
                if local.z > thing.half_extent_m.z || local.z < -thing.half_extent_m.z - 4.0 {
                    continue;
                }
                let reach = local.coords.abs() - thing.half_extent_m;
                let clear_m = reach.x.max(0.0).hypot(reach.y.max(0.0));
                assert!(clear_m > 1.75, "{}: {thing:?} at {clear_m} m, {place:?}", map.name());
            }
        }
    }
}

/// As CARLA's are at their steepest, where a town has streets as high as CARLA's.
const STEEPEST: [(&str, f64); 2] = [("Town03", 0.36), ("Town05", 0.15)];

#[test]
fn roads_are_nowhere_steeper_than_a_tenth_or_than_those_of_carla() {
    for map in towns() {
        let known = STEEPEST.iter().find(|(name, _)| *name == map.name());
        let steepest = known.map_or(0.1, |(_, steepest)| *steepest);
        for place in map.generate_waypoints(5.0).unwrap() {
            let pitch_rad = map.lane_pose(&place).unwrap().pitch_rad;
            assert!(pitch_rad.abs() < steepest, "{}: {pitch_rad} at {place:?}", map.name());
        }
    }
}

/// Points of a rectangle, five metres apart.
fn grid([x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let steps = |from: f64, to: f64| {
        std::iter::successors(Some(from), |v| Some(v + 5.0)).take_while(move |v| *v <= to)
    };
    steps(x0, x1).flat_map(move |x| steps(y0, y1).map(move |y| [x, y]))
}

#[test]
fn the_places_that_scripts_for_these_towns_expect_are_level_and_free() {
    let square = town("Town03");
    let avenue = town("Town05_Opt");
    let stretches =
        [(&square, [25.0, 165.0], [200.0, 265.0]), (&avenue, [25.0, 38.0], [-200.0, 205.0])];
    for (map, xs, ys) in stretches {
        for [x, y] in grid(xs, ys) {
            for thing in map.scenery() {
                let local = thing.pose.inverse_transform_point(&Point3::new(x, y, 1.0));
                let reach = local.coords.abs() - thing.half_extent_m;
                assert!(reach.x.max(reach.y) > 1.0, "{}: {thing:?} at {x} {y}", map.name());
            }
        }
    }
    for [x, y] in grid([25.0, 38.0], [-200.0, 205.0]) {
        let place = avenue.nearest(Point3::new(x, y, 0.0), LaneTypes::ANY).unwrap();
        assert_eq!(avenue.lane(&place).lane_type, LaneType::Driving, "{x} {y}");
        assert!(avenue.pose(&place).translation.z.abs() < 1e-9);
    }
    let stands_at = |x: f64, y: f64| {
        square.scenery().iter().any(|thing| {
            let local = thing.pose.inverse_transform_point(&Point3::new(x, y, 0.5));
            (local.coords.abs() - thing.half_extent_m).max() < 0.0
        })
    };
    for [x, y] in grid([28.0, 32.0], [0.0, 12.0]) {
        assert!(!stands_at(x, y), "no room for a car at {x} {y}");
    }
    assert!(stands_at(30.0, 18.0), "nothing to run into north of 30 6");
    let middle = square.nearest(Point3::new(235.0, 1.0, 0.0), LaneTypes::ANY).unwrap();
    assert_eq!(square.lane(&middle).lane_type, LaneType::Driving);
    for [x, y] in grid([234.0, 236.0], [-110.0, 1.0]) {
        assert!(!stands_at(x, y), "something stands in the avenue at {x} {y}");
    }
}

#[test]
fn towns_have_what_their_names_promise() {
    let lanes_each_way = |map: &Map, road: u32| -> i32 {
        let places = map.generate_waypoints(20.0).unwrap();
        let lanes: BTreeSet<i32> =
            places.iter().filter(|p| p.road == road && p.lane < 0).map(|p| p.lane).collect();
        i32::try_from(lanes.len()).unwrap()
    };
    let widest = |map: &Map| (1..1000).map(|road| lanes_each_way(map, road)).max();
    assert_eq!(widest(&town("Town01")), Some(1));
    assert_eq!(widest(&town("Town02")), Some(1));
    assert_eq!(widest(&town("Town05")), Some(3));
    assert_eq!(widest(&town("Town06")), Some(5));
    let heights = |map: &Map| {
        let places = map.generate_waypoints(5.0).unwrap();
        let z = |place: &Waypoint| map.pose(place).translation.z;
        places.iter().map(z).fold([f64::MAX, f64::MIN], |[low, high], z| [low.min(z), high.max(z)])
    };
    for (name, rise_m) in [("Town03", 6.0), ("Town04", 6.5), ("Town05", 5.5), ("Town07", 8.5)] {
        let [low, high] = heights(&town(name));
        assert!(high - low >= rise_m, "{name} rises by {} m only", high - low);
    }
}

/// Places of vehicles in CARLA's towns, as programs name them: east and north in metres, degrees
/// counter-clockwise from east.
const NAMED_PLACES: [(&str, &[[f64; 3]]); 2] = [
    (
        "Town04",
        &[
            [-510.0, -88.0, -91.0],
            [-326.2, -435.8, 0.0],
            [-12.5, 17.0, -90.0],
            [30.4, 285.9, 70.0],
            [388.9, 140.0, -90.0],
            [284.4, -16.4, 180.0],
            [86.9, -144.0, -170.0],
            [125.5, -225.1, 25.0],
            [246.0, 311.0, 179.0],
            [255.0, 224.4, -90.0],
        ],
    ),
    (
        "Town05",
        &[
            [-145.5, 1.0, 180.0],
            [-54.9, -25.3, -90.0],
            [76.4, -83.0, -157.0],
            [90.9, 66.0, -67.0],
            [149.0, 104.4, -90.0],
            [170.6, 182.0, 136.0],
            [-141.0, -208.5, 0.0],
            [-226.9, -100.0, 88.0],
        ],
    ),
];

#[test]
fn places_that_programs_name_in_carlas_towns_lie_in_a_lane_of_their_direction() {
    for (name, places) in NAMED_PLACES {
        let map = town(name);
        for place @ [x, y, heading_deg] in places {
            // Viaducts are the highest there.
            let at = map.nearest(Point3::new(*x, *y, 10.0), LaneTypes::DRIVING).unwrap();
            let pose = map.pose(&at);
            let away_m = (pose.translation.vector.xy() - nalgebra::Vector2::new(*x, *y)).norm();
            assert!(
                away_m < map.lane(&at).width_m / 2.0,
                "{name} {place:?}: {away_m} m from {at:?}"
            );
            let (_, _, yaw_rad) = pose.rotation.euler_angles();
            let along = (yaw_rad - heading_deg.to_radians()).cos();
            assert!(along > 0.9, "{name} {place:?}: {at:?} leads elsewhere");
        }
    }
}

/// What drives below a bridge is lower than this, in metres.
const BRIDGE_CLEAR_M: f64 = 4.5;

#[test]
fn the_land_around_covers_no_driving_lane_even_under_bridges() {
    for map in towns() {
        let ground = roads::mesh::ground(&map);
        let corner = |index: u32| ground.positions_m[index as usize].map(f64::from);
        let land: Vec<[[f64; 3]; 3]> = ground
            .indices
            .iter()
            .zip(&ground.materials)
            .filter(|(_, material)| **material == roads::mesh::Material::Grass)
            .map(|(triangle, _)| triangle.map(corner))
            .collect();
        let places = map.generate_waypoints(7.0).unwrap();
        assert!(land.len() > 100 && places.len() > 100, "{}", map.name());
        for place in places {
            let at = map.pose(&place).translation.vector;
            for triangle in &land {
                let Some(height_m) = height_at(triangle, [at.x, at.y]) else { continue };
                // Far above are the banks of a bridge.
                let covers = (at.z - 0.01..at.z + BRIDGE_CLEAR_M).contains(&height_m);
                assert!(!covers, "{}: land {height_m} m at {place:?}", map.name());
            }
        }
    }
}

/// Height of a triangle over a point, where it lies over it.
fn height_at([a, b, c]: &[[f64; 3]; 3], [x, y]: [f64; 2]) -> Option<f64> {
    let cross = |p: &[f64; 3], q: &[f64; 3]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
    let [u, v, w] = [cross(b, c), cross(c, a), cross(a, b)];
    let sum = u + v + w;
    (sum.abs() > 1e-9 && u * sum >= 0.0 && v * sum >= 0.0 && w * sum >= 0.0)
        .then(|| (u * a[2] + v * b[2] + w * c[2]) / sum)
}
