//! The generated town, read back through the parser: every street can be driven, and driven on.

#[path = "common/towns.rs"]
mod generated;

use generated::town;
use nalgebra::Point3;
use roads::{LaneChange, LaneType, LaneTypes, Map, Waypoint};

fn driving_places(map: &Map, step_m: f64) -> Vec<Waypoint> {
    map.generate_waypoints(step_m).expect("a step above 0")
}

#[test]
fn the_town_is_the_same_in_every_run_and_unknown_names_give_none() {
    let build = || roads::town::build("Town10HD_Opt").unwrap();
    assert_eq!(build(), build());
    assert_eq!(town("Town10HD_Opt").digest(), town("Town10HD_Opt").digest());
    assert_eq!(town("Town10HD_Opt").digest().len(), 64);
    assert!(roads::town::build("Town99").is_none());
}

#[test]
fn spawn_points_lie_on_driving_lanes_half_a_metre_up_and_look_along_them() {
    let map = town("Town10HD_Opt");
    assert!(map.spawn_points().len() >= 155, "{}", map.spawn_points().len());
    for spawn in map.spawn_points() {
        let place = map.nearest(spawn.translation.vector.into(), LaneTypes::ANY).unwrap();
        let info = map.lane(&place);
        assert_eq!(info.lane_type, LaneType::Driving, "{place:?}");
        assert!(!info.is_junction, "{place:?}");
        let pose = map.pose(&place);
        let gap = spawn.translation.vector - pose.translation.vector;
        // The client's chords cut the begin of a bend short.
        assert!(gap.xy().norm() < 0.5, "{place:?} is {} m off", gap.xy().norm());
        assert!((0.3..=0.6).contains(&gap.z));
        assert!(spawn.rotation.angle_to(&pose.rotation) < 0.05, "{place:?}");
    }
}

#[test]
fn every_driving_lane_leads_on_and_can_be_reached() {
    let map = town("Town10HD_Opt");
    for place in driving_places(&map, 10.0) {
        assert!(!map.next(&place, 60.0).is_empty(), "dead end after {place:?}");
        assert!(!map.previous(&place, 60.0).is_empty(), "no way to {place:?}");
    }
}

#[test]
fn every_driving_lane_can_be_driven_to_with_lane_changes_where_they_are_allowed() {
    let map = town("Town10HD_Opt");
    let start = map.nearest(Point3::origin(), LaneTypes::DRIVING).unwrap();
    let key = |w: &Waypoint| (w.road, w.section, w.lane);
    let lanes: std::collections::BTreeSet<_> = driving_places(&map, 2.0).iter().map(key).collect();
    let mut reached = std::collections::BTreeSet::from([key(&start)]);
    let mut pending = vec![start];
    while let Some(place) = pending.pop() {
        let change = map.lane(&place).lane_change;
        let to_left = matches!(change, LaneChange::Left | LaneChange::Both);
        let to_right = matches!(change, LaneChange::Right | LaneChange::Both);
        let beside = [
            map.left_driving(&place).filter(|_| to_left),
            map.right_driving(&place).filter(|_| to_right),
        ];
        for next in map.next(&place, 2.0).into_iter().chain(beside.into_iter().flatten()) {
            let same_lane = key(&next) == key(&place);
            if same_lane || reached.insert(key(&next)) {
                pending.push(next);
            }
        }
    }
    let missing: Vec<_> = lanes.difference(&reached).collect();
    assert!(missing.is_empty(), "not reached: {missing:?}");
}

#[test]
fn lane_ends_meet_within_a_centimetre_and_a_tenth_of_a_degree() {
    let map = town("Town10HD_Opt");
    for (from, to) in map.lane_joints() {
        let (end, start) = (map.pose(&from), map.pose(&to));
        let gap_m = (end.translation.vector - start.translation.vector).norm();
        assert!(gap_m < 0.01, "{gap_m} m between {from:?} and {to:?}");
        let turn_rad = end.rotation.angle_to(&start.rotation);
        assert!(turn_rad < 0.1_f64.to_radians(), "{turn_rad} rad between {from:?} and {to:?}");
    }
}

#[test]
fn the_ring_offers_lanes_on_both_sides_and_60_m_straight_ahead() {
    let map = town("Town10HD_Opt");
    let suitable = map.spawn_points().iter().filter(|spawn| {
        let place = map.nearest(spawn.translation.vector.into(), LaneTypes::DRIVING).unwrap();
        let both_sides =
            |w: &Waypoint| map.left_driving(w).is_some() && map.right_driving(w).is_some();
        let ahead = map.next(&place, 60.0);
        both_sides(&place)
            && ahead.len() == 1
            && ahead
                .iter()
                .all(|w| both_sides(w) && map.pose(w).rotation.angle_to(&spawn.rotation) < 1e-3)
    });
    assert!(suitable.count() >= 3);
}

#[test]
fn streets_have_up_to_three_driving_lanes_per_direction_and_broken_lines_between_them() {
    let map = town("Town10HD_Opt");
    let mut counts = std::collections::BTreeSet::new();
    for place in driving_places(&map, 20.0) {
        let info = map.lane(&place);
        assert!((info.width_m - 3.5).abs() < 1e-9);
        if info.is_junction {
            continue;
        }
        let beside = |step: fn(&Map, &Waypoint) -> Option<Waypoint>| {
            std::iter::successors(step(&map, &place), |w| step(&map, w)).count()
        };
        let (left, right) = (beside(Map::left_driving), beside(Map::right_driving));
        counts.insert(left + right + 1);
        let left_mark = info.left_mark.unwrap();
        let is_beside_the_strip =
            map.left(&place).is_some_and(|w| map.lane(&w).lane_type == LaneType::Median);
        let expected = match left {
            0 if is_beside_the_strip => (roads::MarkType::Solid, roads::MarkColor::White),
            0 => (roads::MarkType::Solid, roads::MarkColor::Yellow),
            _ => (roads::MarkType::Broken, roads::MarkColor::White),
        };
        assert_eq!((left_mark.mark_type, left_mark.color), expected, "{place:?}");
    }
    assert_eq!(counts, [1, 2, 3].into());
}

#[test]
fn houses_trees_and_posts_stand_off_the_driving_lanes() {
    let map = town("Town10HD_Opt");
    assert!(map.scenery().len() > 240, "{}", map.scenery().len());
    for place in driving_places(&map, 3.0) {
        let at = map.pose(&place).translation.vector;
        for thing in map.scenery() {
            let local = thing.pose.inverse_transform_point(&Point3::from(at));
            let reach = local.coords.abs() - thing.half_extent_m;
            let clear_m = reach.x.max(reach.y);
            assert!(clear_m > 1.75, "{:?} stands {clear_m} m beside {place:?}", thing.kind);
        }
    }
}
