use super::*;
use crate::physics::PhysicsWorld;
use crate::spec::Spec;

fn course() -> Course {
    let spec = Spec { town: "Town01".to_owned(), agents: 2, ..Spec::default() };
    let text = roads::town::build("Town01").unwrap();
    Course::new(&spec, Arc::new(roads::Map::parse("Town01", &text).unwrap())).unwrap()
}

fn both(course: &Course, start: usize) -> (KinematicWorld, PhysicsWorld) {
    let (kinematic, physics) =
        (KinematicWorld::kit(course).unwrap(), PhysicsWorld::kit(course).unwrap());
    (
        KinematicWorld::begin(course, &kinematic, start).unwrap(),
        PhysicsWorld::begin(course, &physics, start).unwrap(),
    )
}

#[test]
fn gentle_driving_leads_to_the_same_place_as_with_rigid_bodies() {
    let course = course();
    let mut worst_m = 0.0_f32;
    for start in 0..12 {
        let (mut kinematic, mut physics) = both(&course, start);
        let weave = [0.0, 0.04, -0.04][start % 3];
        let pedal = [0.15, 0.3, -0.05][start % 3];
        let begin = kinematic.motion(0);
        for tick in 0..60u8 {
            let steer = weave * if tick % 40 < 20 { 1.0 } else { -1.0 };
            for agent in 0..2 {
                kinematic.drive(agent, Action { steer, pedal });
                physics.drive(agent, Action { steer, pedal });
            }
            kinematic.tick().unwrap();
            physics.tick().unwrap();
        }
        let (ours, theirs) = (kinematic.motion(0), physics.motion(0));
        let apart_m = (ours.x_m - theirs.x_m).hypot(ours.y_m - theirs.y_m);
        let way_m = (theirs.x_m - begin.x_m).hypot(theirs.y_m - begin.y_m);
        println!(
            "start {start}: {way_m:.1} m, {apart_m:.2} m apart, {:.2} and {:.2} m/s",
            ours.speed_mps, theirs.speed_mps
        );
        worst_m = worst_m.max(apart_m);
    }
    assert!(worst_m < 1.5, "{worst_m} m apart after 3 s");
}

#[test]
fn cars_that_meet_stop_and_count_it_once() {
    let course = course();
    let (mut world, _) = both(&course, 0);
    // The second behind the first, as fast as it can.
    let ahead = world.cars[0];
    world.cars[1] = Car {
        x_m: ahead.x_m - 12.0 * ahead.cos,
        y_m: ahead.y_m - 12.0 * ahead.sin,
        cos: ahead.cos,
        sin: ahead.sin,
        speed_mps: 10.0,
        ..Car::default()
    };
    world.drive(0, Action { steer: 0.0, pedal: -1.0 });
    world.drive(1, Action { steer: 0.0, pedal: 1.0 });
    world.cars[0].speed_mps = 0.0;
    for _ in 0..60 {
        world.tick().unwrap();
    }
    let once = Contacts { vehicles: 1, ..Contacts::default() };
    assert_eq!([world.take_contacts(0), world.take_contacts(1)], [once, once]);
    assert_eq!(world.motion(1).speed_mps, 0.0);
    world.tick().unwrap();
    assert_eq!(world.take_contacts(1), Contacts::default());
    let before = world.hash();
    world.remove(1);
    assert_ne!(world.hash(), before);
}

#[test]
fn the_same_actions_give_the_same_bits() {
    let course = course();
    let drive = || {
        let (mut world, _) = both(&course, 5);
        for tick in 0..200u8 {
            let steer = 0.02 * (f32::from(tick % 50) - 25.0) / 25.0;
            world.drive(0, Action { steer, pedal: 0.4 });
            world.drive(1, Action { steer: -steer, pedal: 0.2 });
            world.tick().unwrap();
        }
        world.hash()
    };
    assert_eq!(drive(), drive());
}

#[test]
fn who_touches_a_person_stops_and_counts_it_once() {
    let task = "corl17-traffic".to_owned();
    let spec = Spec { task, town: "Town02".to_owned(), ..Spec::default() };
    let text = roads::town::build("Town02").unwrap();
    let map = Arc::new(roads::Map::parse("Town02", &text).unwrap());
    let course = Course::new(&spec, map).unwrap();
    let kit = KinematicWorld::kit(&course).unwrap();
    let mut world = KinematicWorld::begin(&course, &kit, 0).unwrap();
    let crowd = world.crowd.as_ref().unwrap();
    let person = *crowd.bodies().find(|body| body.is_walker).unwrap();
    // The front bumper is almost 4 m before the rear axle.
    let (x_m, y_m) = (person.centre_m.x - 3.0, person.centre_m.y);
    world.cars[0] = Car { x_m, y_m, cos: 1.0, ..Car::default() };
    for _ in 0..3 {
        world.tick().unwrap();
    }
    let once = Contacts { walkers: 1, ..Contacts::default() };
    assert_eq!(world.take_contacts(0), once);
}
