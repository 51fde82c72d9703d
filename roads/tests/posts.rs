//! Posts of lights and signs in every town.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

#[path = "common/towns.rs"]
mod generated;
#[path = "common/maps.rs"]
mod maps;

use generated::towns;
use roads::{Carried, LaneType, LaneTypes, Map, Post};

#[test]
fn every_light_of_a_town_has_a_post_with_lamps_and_no_post_stands_where_cars_drive() {
    let mut signs = 0;
    for map in towns() {
        let name = map.name();
        let posts = map.posts();
        let near = posts.iter().filter(|post| !post.is_far_side);
        let with_lamps = near.clone().filter(|post| post.carried == Carried::Lamps);
        let lights: Vec<Option<usize>> = with_lamps.map(|post| post.light).collect();
        let mut known: Vec<usize> = lights.iter().copied().flatten().collect();
        known.sort_unstable();
        let wanted: Vec<usize> = (0..map.traffic_lights().lights.len()).collect();
        assert_eq!((lights.len(), known), (wanted.len(), wanted), "{name}");
        signs += near.count() - lights.len();
        let on_lanes: Vec<_> =
            posts.iter().filter(|post| post.is_on_lane).map(|post| post.foot.translation).collect();
        assert!(on_lanes.is_empty(), "{name}: {on_lanes:?}");
    }
    assert!(signs > 100, "{signs}");
}

/// Lanes on which something rolls or is parked.
fn wheels() -> LaneTypes {
    let others = [LaneType::Parking, LaneType::Shoulder, LaneType::Biking];
    others.into_iter().map(LaneTypes::from).fold(LaneTypes::DRIVING, LaneTypes::union)
}

/// Metres ahead and to the left of where vehicles wait for its light.
fn from_line(map: &Map, post: &Post) -> (f64, f64) {
    let light = &map.traffic_lights().lights[post.light.unwrap()];
    let seen = light.boxes[0].pose.inv_mul(&post.foot).translation;
    (seen.x, seen.y)
}

#[test]
fn lamps_beyond_a_junction_are_seen_from_all_lanes_that_wait() {
    for map in towns() {
        let name = map.name();
        let lights = map.traffic_lights().lights.len();
        let far_side: Vec<&Post> = map.posts().iter().filter(|post| post.is_far_side).collect();
        println!("{name}: {} of {lights} lights", far_side.len());
        assert_eq!(far_side.len(), lights, "{name}");
        for post in far_side {
            let (ahead_m, left_m) = from_line(&map, post);
            assert!((8.0..60.0).contains(&ahead_m), "{name}: {ahead_m} m ahead, {post:?}");
            // Within the picture of a camera that looks ahead, 90° wide.
            assert!(left_m.abs() < 0.8 * ahead_m, "{name}: {left_m} m of {ahead_m}, {post:?}");
            let foot = post.foot.translation.vector.into();
            assert_eq!(map.inside(foot, wheels()), None, "{name}: {post:?}");
            let is_blocked = map.scenery().iter().any(|thing| {
                let seen = thing.pose.inverse() * foot;
                let half_m = thing.half_extent_m;
                seen.x.abs() < half_m.x + 0.2 && seen.y.abs() < half_m.y + 0.2
            });
            assert!(!is_blocked, "{name}: {post:?}");
        }
    }
}

#[test]
fn on_maps_of_others_no_lamps_are_repeated_in_vain_or_on_lanes() {
    // Skips itself, saying so, without maps.
    for judged in maps::all() {
        let (name, map) = (&judged.name, &judged.map);
        let far_side = map.posts().iter().filter(|post| post.is_far_side);
        for post in far_side.clone() {
            let foot = post.foot.translation.vector.into();
            assert_eq!(map.inside(foot, wheels()), None, "{name}: {post:?}");
        }
        let wanted = match name.as_str() {
            // All lights stand beyond their junction themselves.
            "Town10HD" => 0,
            // Lights hold the lanes before their junctions; two have nothing straight ahead.
            "sumo-roundabout" => 19,
            _ => continue,
        };
        assert_eq!(far_side.count(), wanted, "{name}");
    }
}
