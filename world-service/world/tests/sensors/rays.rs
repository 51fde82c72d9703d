//! Rays that clients cast.

use schemas::{ErrorCode, Vec3};

use crate::common::*;

#[test]
fn a_ray_tells_everything_it_enters_from_near_to_far() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    run(&mut world, 60);
    let top = Vec3::new(0.0, LANE_Y_M, 10.0);
    let beside = Vec3::new(0.0, 1.75, 10.0);
    let down = -Vec3::z() * 20.0;
    let hits = world.cast_rays(&[(top, top + down), (beside, beside + down)]).unwrap();
    let who: Vec<_> = hits.iter().map(|hit| (hit.ray, hit.actor, hit.tag)).collect();
    // The land, 10, goes on below the road.
    let road = [(0, Some(car), 14), (0, None, 1), (0, None, 10), (1, None, 1), (1, None, 10)];
    assert_eq!(who, road);
    assert!((hits[0].position_m.z - 1.48).abs() < 0.02, "the roof: {}", hits[0].position_m);
    assert!(hits[1].position_m.z.abs() < 1.0e-3 && hits[3].position_m.z.abs() < 1.0e-3);
}

#[test]
fn a_ray_that_begins_in_an_actor_meets_it_where_it_begins() {
    let mut world = world();
    let (car, ahead) = (car(&mut world, 0.0, 0.0), car(&mut world, 12.0, 0.0));
    let walker = walker(&mut world, 6.0, 0.0);
    run(&mut world, 60);
    let inside = position_m(&world, car) + Vec3::z() * 0.7;
    let hits = world.cast_rays(&[(inside, position_m(&world, ahead) + Vec3::z() * 0.7)]).unwrap();
    let who: Vec<_> = hits.iter().map(|hit| (hit.actor, hit.tag)).collect();
    assert_eq!(who.first(), Some(&(Some(car), 14)), "{hits:?}");
    assert_eq!(who.last(), Some(&(Some(ahead), 14)), "{hits:?}");
    assert_eq!(hits[0].position_m, inside);
    let middle = position_m(&world, walker);
    let hit = world.project_point(middle, Vec3::z(), 10.0).unwrap().unwrap();
    assert_eq!((hit.actor, hit.tag, hit.position_m), (Some(walker), 12, middle));
    let above = inside + Vec3::z() * 2.0;
    assert_eq!(world.project_point(above, Vec3::z(), 10.0).unwrap(), None);
}

#[test]
fn a_projected_point_is_the_first_thing_in_its_direction() {
    let world = world();
    let from_m = Vec3::new(580.0, 0.0, 1.0);
    let hit = world.project_point(from_m, Vec3::x() * 3.0, 100.0).unwrap().unwrap();
    assert!((hit.position_m - Vec3::new(599.5, 0.0, 1.0)).norm() < 1.0e-3, "{hit:?}");
    assert_eq!((hit.actor, hit.tag), (None, 4));
    assert_eq!(world.project_point(from_m, Vec3::x(), 19.0).unwrap(), None);
    let refused = world.project_point(from_m, Vec3::zeros(), 1.0).unwrap_err();
    assert_eq!(refused.code, ErrorCode::InvalidArgument);
}

#[test]
fn rays_outside_of_the_limits_are_refused() {
    let world = world();
    let nowhere = Vec3::new(f32::NAN, 0.0, 0.0);
    let refused = world.cast_rays(&[(Vec3::zeros(), nowhere)]).unwrap_err();
    assert_eq!(refused.code, ErrorCode::InvalidArgument);
    let many = vec![(Vec3::zeros(), Vec3::x()); 5_000];
    assert_eq!(world.cast_rays(&many).unwrap_err().code, ErrorCode::TooLarge);
}
