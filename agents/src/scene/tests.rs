//! A vehicle on a straight way, and bodies about it.

use super::*;
use crate::network::LanePoint;

const OWN: u32 = 1;

fn id(id: u32) -> ActorId {
    ActorId::new(id).unwrap()
}

/// Straight along x for 78 m.
fn way() -> Vec<PathPoint> {
    let point = |index: u8| {
        let at_m = 2.0 * f32::from(index);
        let point = LanePoint {
            at_m,
            point_m: Vec3::new(at_m, 0.0, 0.0),
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            limit_mps: 0.0,
        };
        PathPoint { point, ahead_m: at_m }
    };
    (0..40).map(point).collect()
}

/// A car at 3 m/s.
fn car(number: u32, centre_m: Vec3, forward: Vec3) -> Body {
    let half_m = Vec3::new(2.4, 0.9, 0.8);
    let velocity_mps = forward * 3.0;
    Body { id: id(number), is_walker: false, centre_m, forward, half_m, velocity_mps }
}

fn walker(centre_m: Vec3) -> Body {
    let half_m = Vec3::new(0.25, 0.25, 0.9);
    Body { is_walker: true, half_m, ..car(2, centre_m, Vec3::x()) }
}

fn queue(bodies: Vec<Body>) -> Vec<Ahead> {
    let room = Room {
        id: id(OWN),
        front_m: 2.0,
        half_width_m: 0.9,
        beside_m: 0.35,
        beside_walkers_m: 0.6,
    };
    Scene::new(bodies, Vec::new()).queue(&way(), &room)
}

fn ahead(body: Body) -> Option<Ahead> {
    queue(vec![body]).first().copied()
}

#[test]
fn the_gap_to_whoever_drives_ahead_is_from_bumper_to_bumper() {
    for step in 0..40u8 {
        let at_m = 10.0 + 0.1 * f32::from(step);
        let found = ahead(car(2, Vec3::new(at_m, 0.3, 0.0), Vec3::x())).unwrap();
        assert!((found.gap_m - (at_m - 4.4)).abs() < 1.0e-3, "{at_m}: {found:?}");
        assert!((found.along_mps - 3.0).abs() < 1.0e-3, "{found:?}");
    }
}

#[test]
fn whoever_crosses_is_as_near_as_his_side_and_beside_the_way_is_not_in_it() {
    let found = ahead(car(2, Vec3::new(20.0, 1.0, 0.0), Vec3::y())).unwrap();
    assert!((found.gap_m - (20.0 - 0.9 - 2.0)).abs() < 1.0e-3, "{found:?}");
    assert!(found.along_mps.abs() < 1.0e-3 && (found.speed_mps - 3.0).abs() < 1.0e-3);
    assert_eq!(ahead(car(2, Vec3::new(20.0, 2.3, 0.0), Vec3::x())), None);
}

#[test]
fn nobody_behind_on_another_storey_or_oneself_is_in_the_way() {
    assert_eq!(ahead(car(2, Vec3::new(-3.2, 0.0, 0.0), Vec3::x())), None);
    assert_eq!(ahead(car(2, Vec3::new(20.0, 0.0, 4.0), Vec3::x())), None);
    assert_eq!(ahead(car(OWN, Vec3::new(0.5, 0.0, 0.0), Vec3::x())), None);
}

#[test]
fn a_queue_is_in_order_of_the_way() {
    let places_m = [25.0, 60.0, 18.0];
    let bodies = (2..).zip(places_m).map(|(id, x_m)| car(id, Vec3::new(x_m, 0.0, 0.0), Vec3::x()));
    let found: Vec<u32> = queue(bodies.collect()).iter().map(|ahead| ahead.id.get()).collect();
    assert_eq!(found, [4, 2, 3]);
}

#[test]
fn people_get_more_room_beside_and_ahead() {
    let found = ahead(walker(Vec3::new(20.0, 1.6, 0.0))).unwrap();
    assert!((found.gap_m - (20.0 - 0.25 - 2.0)).abs() < 1.0e-3, "{found:?}");
    assert_eq!(found.leader(), (found.gap_m - MORE_TO_WALKERS_M, found.along_mps));
    let as_car = Body { is_walker: false, ..walker(Vec3::new(20.0, 1.6, 0.0)) };
    assert_eq!(ahead(as_car), None);
    let car = ahead(car(2, Vec3::new(20.0, 0.0, 0.0), Vec3::x())).unwrap();
    assert_eq!(car.leader(), (car.gap_m, car.along_mps));
}
