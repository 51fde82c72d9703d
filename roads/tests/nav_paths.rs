//! Ways for walkers: over crossings, along sidewalks, and over the road only when allowed.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

#[path = "common/walks.rs"]
mod walks;

use nalgebra::Point3;
use roads::Map;
use roads::nav::{Area, NavMesh};
use walks::{islands, names, town};

/// Points along a way, at most this far apart.
const STEP_M: f64 = 0.5;

fn length_m(way: &[Point3<f64>]) -> f64 {
    way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}

fn along(way: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut points = Vec::new();
    for pair in way.windows(2) {
        let count = ((pair[1] - pair[0]).norm() / STEP_M).ceil().max(1.0);
        let mut k = 0.0;
        while k <= count {
            points.push(pair[0] + (pair[1] - pair[0]) * (k / count));
            k += 1.0;
        }
    }
    points
}

/// The areas a way leads over; fails where it leaves the mesh.
fn areas(name: &str, mesh: &NavMesh, way: &[Point3<f64>]) -> Vec<Area> {
    let mut areas = Vec::new();
    for point in along(way) {
        // A way is straight seen from above: its height between corners is that of the mesh.
        let level = |point: Point3<f64>| {
            mesh.nearest(point).map_or(point, |(_, on)| Point3::new(point.x, point.y, on.z))
        };
        let point = level(level(point));
        let on = [Area::Sidewalk, Area::Crosswalk, Area::Road].into_iter().find(|area| {
            let found = mesh.nearest_in(point, *area);
            found.is_some_and(|(_, place)| (place.xy() - point.xy()).norm() < 2e-3)
        });
        areas.push(on.unwrap_or_else(|| panic!("{name}: {point} is off the mesh")));
    }
    areas.dedup();
    areas
}

/// Places on the sidewalks at the two ends of each crossing.
fn crossings(map: &Map, mesh: &NavMesh) -> Vec<[Point3<f64>; 2]> {
    let ends = |corners: Vec<Point3<f64>>| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| corners[k]);
        let ends =
            if (b - a).norm() > (d - a).norm() { [[a, d], [b, c]] } else { [[a, b], [c, d]] };
        ends.map(|[one, other]| {
            mesh.nearest_in(nalgebra::center(&one, &other), Area::Sidewalk).unwrap().1
        })
    };
    map.crosswalks().into_iter().map(ends).collect()
}

#[test]
fn every_crossing_of_every_town_can_be_walked_without_stepping_on_the_road() {
    let mut loose = Vec::new();
    for name in names() {
        let (map, mesh) = town(name);
        let crossings = crossings(&map, &mesh);
        assert!(!crossings.is_empty(), "{name}");
        for [from, to] in crossings {
            let way = mesh.path(from, to, false);
            let direct_m = (to - from).norm();
            if way.is_empty() || length_m(&way) >= direct_m + 3.0 {
                loose.push((name, from, to));
                continue;
            }
            let [first, last] = [way[0], way[way.len() - 1]];
            assert!((first - from).norm() + (last - to).norm() < 1e-6, "{name}: {first} {last}");
            let areas = areas(name, &mesh, &way);
            assert!(areas.contains(&Area::Crosswalk), "{name}: {areas:?}");
            assert!(!areas.contains(&Area::Road), "{name}: {from} to {to} over {areas:?}");
        }
    }
    assert!(loose.is_empty(), "{loose:?}");
}

#[test]
fn long_ways_stay_on_the_mesh_and_off_the_road_and_are_the_same_both_ways() {
    for name in names() {
        let (_, mesh) = town(name);
        let island = islands(&mesh, |polygon| polygon.area != Area::Road);
        let island_at = |place| island[mesh.nearest(place).unwrap().0 as usize];
        let mut found = 0;
        for draw in 0..20 {
            let [from, to] = [2 * draw, 2 * draw + 1].map(|draw| mesh.random_point(draw).unwrap());
            let way = mesh.path(from, to, false);
            assert_eq!(way.is_empty(), island_at(from) != island_at(to), "{name}: {from} to {to}");
            if way.is_empty() {
                continue;
            }
            found += 1;
            assert!(!areas(name, &mesh, &way).contains(&Area::Road), "{name}: {from} to {to}");
            let back_m = length_m(&mesh.path(to, from, false));
            let ratio = length_m(&way) / back_m;
            assert!((0.8..1.25).contains(&ratio), "{name}: {} m, back {back_m} m", length_m(&way));
        }
        assert!(found > 0, "{name}: no two places are joined");
    }
}

#[test]
fn who_may_cross_roads_takes_the_short_way_over_the_street() {
    for name in ["Town01", "Town02", "Town10HD"] {
        let (_, mesh) = town(name);
        let mut shorter = 0;
        for draw in 0..200 {
            let from = mesh.random_point(draw).unwrap();
            let other_side = (0..8).filter_map(|turn| {
                let (sin, cos) = (f64::from(turn) * std::f64::consts::FRAC_PI_4).sin_cos();
                let far = from + nalgebra::Vector3::new(18.0 * cos, 18.0 * sin, 0.0);
                let (_, place) = mesh.nearest_in(far, Area::Sidewalk)?;
                ((place - far).norm() < 3.0).then_some(place)
            });
            for to in other_side {
                let [around, over] = [false, true].map(|cross| mesh.path(from, to, cross));
                if length_m(&around) > 120.0 && length_m(&over) < 60.0 {
                    assert!(areas(name, &mesh, &over).contains(&Area::Road), "{name}: {from} {to}");
                    shorter += 1;
                }
            }
        }
        assert!(shorter > 0, "{name}: nobody ever gains by crossing");
    }
}

#[test]
fn who_stands_on_the_road_may_leave_it() {
    let (map, mesh) = town("Town01");
    let (mut left, mut on_road) = (0, 0);
    for spawn in map.spawn_points().iter().step_by(7) {
        let (polygon, place) = mesh.nearest(spawn.translation.vector.into()).unwrap();
        if mesh.polygons()[polygon as usize].area != Area::Road {
            continue;
        }
        on_road += 1;
        let (_, to) = mesh.nearest_in(place, Area::Sidewalk).unwrap();
        let way = mesh.path(place, to, false);
        left += usize::from(!way.is_empty());
    }
    assert!(on_road > 5 && left == on_road, "{left} of {on_road}");
}
