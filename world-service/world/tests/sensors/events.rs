//! Collision, obstacle and lane invasion.

use std::f32::consts::FRAC_PI_6;
use std::sync::Arc;

use roads::Map;
use schemas::{ActorId, BodyCommand, Command, Measurement, Pose, UnitQuaternion, Vec3, level_pose};
use world::{Town, World};

use crate::common::*;
use crate::support::*;

// Tags of CARLA.
const ROAD: u8 = 1;
const WALL: u8 = 4;
const WALKER: u8 = 12;
const CAR: u8 = 14;

fn obstacle(world: &World, sensor: ActorId) -> Option<(Option<ActorId>, u8, f32)> {
    data_of(world, sensor).into_iter().next().map(|datum| match datum.measurement {
        Measurement::Obstacle { other, tag, distance_m } => (other, tag, distance_m),
        other => panic!("no obstacle: {other:?}"),
    })
}

#[test]
fn an_obstacle_sensor_tells_how_far_its_ball_can_move() {
    let mut world = world();
    let at = level_pose(Vec3::new(580.0, LANE_Y_M, 0.6), 0.0);
    let far = sensor(&mut world, "sensor.other.obstacle", None, at, &[("distance", "50")]);
    let near = sensor(&mut world, "sensor.other.obstacle", None, at, &[("distance", "10")]);
    let dynamic = [("distance", "50"), ("only_dynamics", "true")];
    let dynamic = sensor(&mut world, "sensor.other.obstacle", None, at, &dynamic);
    run(&mut world, 1);
    let (other, tag, distance_m) = obstacle(&world, far).expect("the wall is there");
    assert_eq!((other, tag), (None, WALL));
    assert!((distance_m - 19.0).abs() < 1.0e-3, "19.5 m less the radius: {distance_m}");
    assert_eq!(obstacle(&world, near), None);
    assert_eq!(obstacle(&world, dynamic), None);

    let car = car(&mut world, 590.0, 0.0);
    run(&mut world, 60);
    for sensor in [far, near, dynamic] {
        let (other, _, distance_m) = obstacle(&world, sensor).expect("the car is there");
        assert_eq!(other, Some(car));
        assert!((distance_m - 7.0).abs() < 0.01, "plate at 587.50 m: {distance_m}");
    }
}

#[test]
fn an_obstacle_sensor_meets_the_road_and_not_its_own_carrier() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let kind = "sensor.other.obstacle";
    // Its ball is in the road from the beginning.
    let low = sensor(&mut world, kind, Some(car), Pose::identity(), &[]);
    let dynamic = [("only_dynamics", "true")];
    let dynamic = sensor(&mut world, kind, Some(car), Pose::identity(), &dynamic);
    let at_m = Vec3::new(100.0, LANE_Y_M, 3.0);
    let down = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), FRAC_PI_6);
    let down = Pose::from_parts(at_m.into(), down);
    let down = sensor(&mut world, kind, None, down, &[("distance", "10")]);
    run(&mut world, 10);
    assert_eq!(obstacle(&world, low), Some((None, ROAD, 0.0)));
    assert_eq!(obstacle(&world, dynamic), None);
    let (other, tag, distance_m) = obstacle(&world, down).expect("it looks down on the road");
    assert_eq!((other, tag), (None, ROAD));
    assert!((distance_m - 5.0).abs() < 1.0e-3, "(3 m - 0.5 m) / sin 30°: {distance_m}");
}

/// Other, tag and impulse of every event of the last tick.
fn contacts(world: &World, sensor: ActorId) -> Vec<(Option<ActorId>, u8, Vec3)> {
    let contact = |datum: schemas::SensorDatum| match datum.measurement {
        Measurement::Collision { other, tag, impulse_ns } => (other, tag, impulse_ns),
        other => panic!("no collision: {other:?}"),
    };
    data_of(world, sensor).into_iter().map(contact).collect()
}

#[test]
fn both_sides_of_a_collision_are_told_in_every_tick_of_contact() {
    let mut world = world();
    let car = car(&mut world, 0.0, 15.0);
    let walker = walker(&mut world, 8.0, 0.0);
    let mine = sensor(&mut world, "sensor.other.collision", Some(car), Pose::identity(), &[]);
    let theirs = sensor(&mut world, "sensor.other.collision", Some(walker), Pose::identity(), &[]);
    let mut ticks = 0;
    for _ in 0..40 {
        let collisions = run(&mut world, 1);
        let expected: Vec<_> = collisions
            .iter()
            .filter(|collision| collision.actor == car)
            .map(|collision| (Some(walker), WALKER, collision.impulse_ns))
            .collect();
        assert_eq!(contacts(&world, mine), expected);
        let opposite: Vec<_> =
            expected.iter().map(|(.., impulse_ns)| (Some(car), CAR, -impulse_ns)).collect();
        assert_eq!(contacts(&world, theirs), opposite);
        ticks += expected.len();
    }
    assert!(ticks > 1, "{ticks}");
}

#[test]
fn a_collision_with_the_scenery_has_no_other_but_its_tag() {
    let mut world = world();
    let car = car(&mut world, 590.0, 15.0);
    let bumper = sensor(&mut world, "sensor.other.collision", Some(car), Pose::identity(), &[]);
    let mut events = Vec::new();
    for _ in 0..20 {
        run(&mut world, 1);
        events.extend(contacts(&world, bumper));
    }
    assert!(!events.is_empty());
    for (other, tag, impulse_ns) in events {
        assert_eq!((other, tag), (None, WALL));
        assert!(impulse_ns.x < 0.0, "{impulse_ns}");
    }
}

/// Two lanes in each direction along x with lines, traffic towards +x at y < 0.
fn lined_road() -> Arc<Town> {
    let lane = |id: i32, mark: &str| {
        format!(
            r#"<lane id="{id}" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="{mark}" weight="standard" color="white" width="0.15"/></lane>"#
        )
    };
    let text = format!(
        r#"<?xml version="1.0"?><OpenDRIVE>
  <header revMajor="1" revMinor="4" name="lined" version="1" north="0" south="0" east="0" west="0"/>
  <road name="main" length="400" id="1" junction="-1">
    <planView><geometry s="0" x="-200" y="0" hdg="0" length="400"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <left>{}{}</left>
      <center><lane id="0" type="none" level="false"><roadMark sOffset="0" type="solid solid" weight="standard" color="yellow" width="0.3"/></lane></center>
      <right>{}{}</right>
    </laneSection></lanes>
  </road></OpenDRIVE>"#,
        lane(2, "solid"),
        lane(1, "broken"),
        lane(-1, "broken"),
        lane(-2, "solid"),
    );
    Arc::new(Town::new(Arc::new(Map::parse("lined", &text).unwrap())))
}

#[test]
fn a_lane_invasion_names_the_lines_between_the_lanes_of_the_corners() {
    let mut world = world_on(lined_road(), 0.05);
    let pose = |y_m: f32| level_pose(Vec3::new(0.0, y_m, 0.1), 0.0);
    let car = spawn_at(&mut world, "vehicle.lincoln.mkz", pose(-5.25), 0.0);
    let lines = sensor(&mut world, "sensor.other.lane_invasion", Some(car), Pose::identity(), &[]);
    run(&mut world, 2);
    assert_eq!(data_of(&world, lines), []);
    for (y_m, expected) in [
        (-1.75, vec!["broken"]),
        (-1.7, vec![]),
        (1.75, vec!["solid solid"]),
        (-5.25, vec!["solid solid", "broken"]),
        (-6.5, vec!["solid"]),
    ] {
        world
            .apply(&Command::Body(BodyCommand::SetPose {
                actor: car,
                reference_from_actor: pose(y_m),
            }))
            .unwrap();
        run(&mut world, 1);
        let marks = data_of(&world, lines).into_iter().next().map(|datum| datum.measurement);
        let expected: Vec<String> = expected.into_iter().map(str::to_owned).collect();
        let wanted = Some(Measurement::LaneInvasion { marks: expected.clone() });
        assert_eq!(marks, wanted.filter(|_| !expected.is_empty()), "to {y_m}");
    }
}
