//! The posts of lights and signs are in the way of bodies and rays, in worlds with and without
//! lights that work.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::sync::Arc;

use common::*;
use roads::{Carried, Map, Post};
use schemas::{Command, SceneryCommand, SemanticTag, Vec3, WorldId, level_pose};
use world::{Town, World, WorldConfig};

/// A light, a speed limit beside the road, and a stop sign in the middle of a lane.
const SIGNALS: &str = r#"</objects><signals>
  <signal id="1" name="light" s="900" t="-9" zOffset="0" orientation="+" dynamic="yes" type="1000001" subtype="-1" country="OpenDRIVE" value="-1" hOffset="0" height="1" width="1"/>
  <signal id="2" name="limit" s="920" t="-9" zOffset="2" orientation="+" dynamic="no" type="274" subtype="50" country="OpenDRIVE" value="50" unit="km/h" hOffset="0" height="0.8" width="0.8"/>
  <signal id="3" name="Sign_STATIC" s="940" t="-1.75" zOffset="2" orientation="+" dynamic="no" type="206" subtype="-1" country="OpenDRIVE" value="-1" hOffset="0" height="0.8" width="0.8"/>
</signals>"#;

fn roads() -> Arc<Map> {
    let text = ROAD.replace("SLOPE", "0").replace("</objects>", SIGNALS);
    Arc::new(Map::parse("signals", &text).unwrap())
}

fn worlds() -> [World; 2] {
    worlds_on(roads())
}

fn worlds_on(roads: Arc<Map>) -> [World; 2] {
    let map = Arc::new(Town::new(roads));
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map };
    [World::new(config.clone()).unwrap(), World::with_traffic(config).unwrap()]
}

fn posts_of(roads: &Map) -> [Post; 3] {
    roads.posts().to_vec().try_into().unwrap()
}

/// The light, the limit and the sign on the lane.
fn posts() -> [Post; 3] {
    posts_of(&roads())
}

/// Lets a car roll along +x towards a place; where its front ends up before it, and whether it
/// touched anything.
fn roll_towards(world: &mut World, post: &Post) -> (f32, bool) {
    let at_m: Vec3 = post.foot.translation.vector.cast();
    let pose = level_pose(at_m - Vec3::x() * 12.0, 0.0);
    let car = spawn_at(world, "vehicle.lincoln.mkz", pose, 8.0);
    let hits = run(world, 60);
    let half_m = state(world, car).box_half_extent_m.x;
    assert!(hits.iter().all(|hit| hit.other.is_none()), "{hits:?}");
    let before_m = at_m.x - position_m(world, car).x - half_m;
    world.apply(&Command::DestroyActor { actor: car }).unwrap();
    (before_m, !hits.is_empty())
}

#[test]
fn a_car_does_not_pass_the_post_of_a_light_or_a_sign() {
    let [light, limit, _] = posts();
    assert_eq!([light.carried, limit.carried], [Carried::Lamps, Carried::Board]);
    for post in [&light, &limit] {
        for mut world in worlds() {
            let (before_m, touched) = roll_towards(&mut world, post);
            assert!(touched && before_m > -0.1, "{before_m} m before {:?}", post.carried);
        }
    }
}

#[test]
fn a_post_that_a_map_has_on_a_lane_stops_nobody() {
    let [light, limit, on_lane] = posts();
    assert_eq!([light, limit, on_lane.clone()].map(|post| post.is_on_lane), [false, false, true]);
    for mut world in worlds() {
        let (before_m, touched) = roll_towards(&mut world, &on_lane);
        assert!(!touched && before_m < -3.0, "{before_m} m");
    }
}

#[test]
fn rays_meet_posts_lamps_and_boards_by_their_names() {
    let [light, limit, _] = posts();
    for world in worlds() {
        let tags_at = |post: &Post, above_m: f64| -> Vec<u8> {
            let at_m: Vec3 = post.foot.translation.vector.cast();
            let at_m = at_m + Vec3::z() * above_m as f32;
            let from_m = at_m - Vec3::x() * 5.0;
            let hits = world.cast_rays(&[(from_m, at_m + Vec3::x() * 5.0)]).unwrap();
            assert!(hits.iter().all(|hit| hit.actor.is_none()));
            hits.iter().map(|hit| hit.tag).collect()
        };
        let number = SemanticTag::number;
        let [poles, lamps, boards] =
            [SemanticTag::Poles, SemanticTag::TrafficLight, SemanticTag::TrafficSigns].map(number);
        assert_eq!(tags_at(&light, 1.5), [poles]);
        assert_eq!(tags_at(&light, light.post_from_carried.z), [lamps, poles]);
        assert_eq!(tags_at(&limit, 1.0), [poles]);
        assert_eq!(tags_at(&limit, limit.post_from_carried.z), [boards, poles]);
    }
}

#[test]
fn what_a_post_carries_is_hidden_without_it_and_it_without_that() {
    let map = other_order();
    let [_, light, _] = posts_of(&map);
    let [world, _] = worlds_on(Arc::clone(&map));
    let top_m = light.foot.translation.vector.cast() + Vec3::z() * light.post_from_carried.z as f32;
    for (name, left) in
        [("TrafficLight_1", SemanticTag::Poles), ("Pole_1", SemanticTag::TrafficLight)]
    {
        let object = map.environment_objects().iter().find(|object| object.name == name).unwrap();
        let mut world = world.fork(WorldId::new(2).unwrap());
        let hide = SceneryCommand::Objects { objects: vec![object.id], enabled: false };
        world.apply(&Command::Scenery(hide)).unwrap();
        let hits = world.cast_rays(&[(top_m - Vec3::x() * 5.0, top_m + Vec3::x() * 5.0)]).unwrap();
        let tags: Vec<u8> = hits.iter().map(|hit| hit.tag).collect();
        assert_eq!(tags, [left.number()], "{name}");
        assert_eq!(roll_towards(&mut world, &light).1, left == SemanticTag::Poles, "{name}");
    }
}

/// With the sign on the lane before the others, so that what bodies hit has other numbers.
fn other_order() -> Arc<Map> {
    let signals = SIGNALS.replace(r#"id="3""#, r#"id="0""#);
    let (start, end) = (signals.find("  <signal").unwrap(), signals.find("</signals>").unwrap());
    let mut lines: Vec<&str> = signals[start..end].lines().collect();
    lines.rotate_right(1);
    let signals = format!("</objects><signals>{}</signals>", lines.concat());
    let text = ROAD.replace("SLOPE", "0").replace("</objects>", &signals);
    Arc::new(Map::parse("signals", &text).unwrap())
}

/// Whether a ray meets the pole of a post.
fn is_met(world: &World, post: &Post) -> bool {
    let foot_m: Vec3 = post.foot.translation.vector.cast();
    let at_m = foot_m + Vec3::z() * 1.2;
    !world.cast_rays(&[(at_m - Vec3::x() * 3.0, at_m + Vec3::x() * 3.0)]).unwrap().is_empty()
}

#[test]
fn bodies_and_rays_pass_where_a_light_or_sign_was_hidden_with_its_post_or_destroyed() {
    let map = other_order();
    let [on_lane, light, limit] = posts_of(&map);
    assert_eq!([&on_lane, &light, &limit].map(|post| post.is_on_lane), [true, false, false]);
    let objects = map.environment_objects();
    let named = |name: &str| objects.iter().find(|object| object.name.ends_with(name)).unwrap().id;
    for (post, other, name, pole) in
        [(&light, &limit, "TrafficLight_1", "Pole_1"), (&limit, &light, "TrafficSign_2", "Pole_2")]
    {
        let [bare, mut equipped] = worlds_on(Arc::clone(&map));
        let described = equipped.describe(&[]);
        let is_it = |id: &str| name.ends_with(&format!("_{id}"));
        let actor = described.iter().find(|one| one.signal.as_deref().is_some_and(is_it));
        equipped.apply(&Command::DestroyActor { actor: actor.unwrap().id }).unwrap();
        let objects = |enabled| {
            let objects = vec![named(name), named(pole)];
            Command::Scenery(SceneryCommand::Objects { objects, enabled })
        };
        let mut hidden = bare.fork(WorldId::new(2).unwrap());
        hidden.apply(&objects(false)).unwrap();
        for world in [&mut hidden, &mut equipped] {
            assert!(!is_met(world, post) && is_met(world, other));
            let (before_m, touched) = roll_towards(world, post);
            assert!(!touched && before_m < -3.0, "{before_m} m before {name}");
            let (_, touched) = roll_towards(world, other);
            assert!(touched, "{name} is gone, not the other");
        }
        for (world, comes_back) in [(&mut hidden, true), (&mut equipped, false)] {
            world.apply(&objects(true)).unwrap();
            assert_eq!(is_met(world, post), comes_back, "{name}");
        }
    }
}
