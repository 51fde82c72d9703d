//! Texts of queries, byte by byte.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use recording::query::{Letter, actors_blocked, collisions, file_info};
use recording::{Add, Class, Collision, Destroy, FrameContent, Reader};

use common::{add, at, date, everything, log_of, vector};

fn info(log: &[u8], is_all: bool) -> String {
    let mut out = Vec::new();
    file_info(&mut Reader::open(log).unwrap(), is_all, &date, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn table(log: &[u8], wanted: &str) -> String {
    let mut letters = wanted.chars().map(Letter);
    let wanted = [letters.next().unwrap(), letters.next().unwrap()];
    let mut out = Vec::new();
    collisions(&mut Reader::open(log).unwrap(), wanted, &date, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn blocked(log: &[u8], min_secs: f64, min_cm: f64) -> String {
    let mut out = Vec::new();
    actors_blocked(&mut Reader::open(log).unwrap(), min_secs, min_cm, &date, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

const HEAD: &str = "Version: 2\nMap: Town01\nDate: <1700000000>\n\n";

#[test]
fn without_details_only_frames_with_events_are_told() {
    let text = info(&log_of(everything()), false);
    let expected = "\
Frame 1 at 0 seconds
 Create 1: spectator (0) at (-260, -200, 382.001)
 Create 24: vehicle.lincoln.mkz_2017 (1) at (100.5, -20, 30)
  number_of_wheels = 4
  object_type = \n  role_name = hero
 Create 30: walker.pedestrian.0001 (2) at (0, 5, 100)
 Parenting 30 with 24 (parent)
Frame 2 at 0.05 seconds
 Collision id 0 between 24 (hero)  with 30
 Collision id 1 between 24 with 4294967295
Frame 3 at 0.1 seconds
 Destroy 24

Frames: 3
Duration: 0.1 seconds
";
    assert_eq!(text, format!("{HEAD}{expected}"));
}

#[test]
fn with_details_everything_is_told_and_doors_come_last() {
    let text = info(&log_of(everything()), true);
    let expected = "\
 Parenting 30 with 24 (parent)
 Positions: 3
  Id: 1 Location: (-260, 0, 0) Rotation: (0, 0, 0)
  Id: 24 Location: (100.5, 0, 0) Rotation: (0, 0, 0)
  Id: 30 Location: (0, 0, 0) Rotation: (0, 0, 0)
 State traffic lights: 1
  Id: 7 state: 2 frozen: 1 elapsedTime: 2.5
 Vehicle animations: 1
  Id: 24 Steering: -0.25 Throttle: 0.75 Brake: 0 Handbrake: 0 Gear: -1
 Walker animations: 1
  Id: 30 speed: 140
 Vehicle light animations: 2
  Id: 24 Position LowBeam Interior Fog
  Id: 25 None
 Scene light changes: 1
  Id: 3 enabled: True intensity: 5000 RGB_color: (1, 0.5, 0.25)
 Dynamic actors: 1
  Id: 24 linear_velocity: (1, -2, 0) angular_velocity: (0, 0, 12.5)
 Actor bounding boxes: 1
  Id: 1 origin: (-nan, inf, 0) extension: (0, 0, 0)
 Actor trigger volumes: 1
  Id: 7 origin: (0, 0, 0) extension: (1, 2, 3)
 Current platform time: 0.0125
 Physics Control events: 1
  Id: 24
   max_rpm = 6500
   MOI = 1
   damping_rate_full_throttle = 0.05
   damping_rate_zero_throttle_clutch_engaged = 2
   damping_rate_zero_throttle_clutch_disengaged = 0.35
   use_gear_auto_box = true
   gear_switch_time = 0.5
   clutch_strength = 10
   final_ratio = 3.21
   mass = 1696
   drag_coefficient = 0.3
   center_of_mass = (0.6, 0, -0.3)
   torque_curve = (1000, 347) (1500, 523)
   steering_curve = (0, 1) (20, 0.9)
   forward_gears:
    gear 0: ratio 4.584 down_ratio 0.23 up_ratio 0.54
   wheels:
    wheel 0: tire_friction 3.5 damping_rate 0.25 max_steer_angle 70 radius 35.5 \
max_brake_torque 800 max_handbrake_torque 0 position (39328.5, 19647.8, 86.4026)
 Traffic Light time events: 1
  Id: 7 green_time: 10 yellow_time: 3 red_time: 2
 Walkers Bones: 1
  Id: 30
     Bone: \"crl_root\" relative: Loc(1, 2, 3) Rot(4, 5, 6)

 Vehicle door animations: 1
  Id: 24
  Doors opened:  Front Right \nFrame 2 at 0.05 seconds
";
    assert!(text.contains(expected), "{text}");
    assert!(
        text.ends_with("\n Walkers Bones: 0\n\n\nFrames: 3\nDuration: 0.1 seconds\n"),
        "{text}"
    );
}

/// A hero that touches things of every class; the walker at 1 s and 2 s, and again at 4 s.
fn contacts() -> Vec<u8> {
    let names = [
        (24, Class::VEHICLE, "vehicle.hero"),
        (25, Class::VEHICLE, "vehicle.other.with_a_name_longer_than_the_column"),
        (26, Class::WALKER, "walker"),
        (27, Class::TRAFFIC_LIGHT, "traffic.traffic_light"),
        (28, Class::TRAFFIC_SIGN, "traffic.stop"),
        (29, Class::SENSOR, "sensor.other.collision"),
    ];
    let adds: Vec<Add> = names
        .iter()
        .map(|(id, class, name)| add(*id, *class, name, vector(0.0, 0.0, 0.0)))
        .collect();
    let touch = |id1, id2| Collision { id1, id2, is_hero1: id1 == 24, ..Collision::default() };
    let frame = |elapsed_secs, collisions| FrameContent {
        elapsed_secs,
        collisions,
        ..FrameContent::default()
    };
    let start = FrameContent { adds, ..FrameContent::default() };
    let all = [25, 26, 27, 28, 29, Collision::NO_ACTOR].map(|id| touch(24, id));
    let gone = FrameContent {
        elapsed_secs: 5.0,
        destroys: vec![Destroy { id: 25 }],
        collisions: vec![touch(25, 26)],
        ..FrameContent::default()
    };
    log_of([
        start,
        frame(1.4, all.to_vec()),
        frame(2.0, vec![touch(24, 26)]),
        frame(3.0, Vec::new()),
        frame(4.5, vec![touch(24, 26), touch(26, 24)]),
        gone,
    ])
}

#[test]
fn collisions_are_listed_when_they_begin() {
    let expected = "    Time  Types     Id Actor 1                                 Id Actor 2                            
       1   v v      24 vehicle.hero                            25 vehicle.other.with_a_name_longer_than_the_column
       1   v w      24 vehicle.hero                            26 walker                             
       1   v t      24 vehicle.hero                            27 traffic.traffic_light              
       1   v o      24 vehicle.hero                            28 traffic.stop                       
       1   v o      24 vehicle.hero                            29 sensor.other.collision             
       1   v o      24 vehicle.hero                        4294967295                                    
       4   v w      24 vehicle.hero                            26 walker                             
       4   w v      26 walker                                  24 vehicle.hero                       
       5   v w      25 vehicle.other.with_a_name_longer_than_the_column     26 walker                             

Frames: 6
Duration: 5 seconds
";
    assert_eq!(table(&contacts(), "aa"), format!("{HEAD}{expected}"));
}

#[test]
fn each_letter_selects_its_own() {
    let rows = |wanted| {
        let text = table(&contacts(), wanted);
        let rows = text.lines().skip(5).take_while(|line| !line.is_empty());
        rows.map(|row| row[11..14].to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(rows("vv"), ["v v"]);
    assert_eq!(rows("vw"), ["v w"; 3]);
    assert_eq!(rows("hw"), ["v w"; 2]);
    assert_eq!(rows("vt"), ["v t"]);
    assert_eq!(rows("vo"), ["v o"; 3]);
    assert_eq!(rows("wa"), ["w v"]);
    assert_eq!(rows("ah"), [""; 0]);
    assert_eq!(rows("\0\0"), [""; 0]);
    let nothing = table(&contacts(), "tt");
    assert!(nothing.ends_with("\n\nFrames: 6\nDuration: 5 seconds\n"), "{nothing}");
}

#[test]
fn the_duration_has_decimals_unless_there_are_rows() {
    let log = log_of(everything());
    assert!(table(&log, "aa").ends_with("Duration: 0 seconds\n"));
    assert!(table(&log, "tt").ends_with("Duration: 0.1 seconds\n"));
}

/// One frame a second: who stands at `x` cm in which frame.
fn standing(places: &[(u32, &dyn Fn(u32) -> f32)], secs: u32) -> Vec<u8> {
    let adds = places.iter().map(|(id, _)| {
        add(*id, Class::VEHICLE, &format!("vehicle.number{id}"), vector(0.0, 0.0, 0.0))
    });
    let adds: Vec<Add> = adds.collect();
    log_of((0..=secs).map(|second| FrameContent {
        elapsed_secs: f64::from(second),
        adds: if second == 0 { adds.clone() } else { Vec::new() },
        positions: places.iter().map(|(id, place)| at(*id, place(second))).collect(),
        ..FrameContent::default()
    }))
}

#[test]
fn blocked_actors_are_sorted_by_how_long_they_stood() {
    // The first stands from second 10 to 40, the second from the start to the end.
    let moves = |second: u32| match second {
        0..10 => 1000.0 + 300.0 * second as f32,
        10..40 => 4000.0,
        _ => 4500.0,
    };
    let log = standing(&[(24, &moves), (25, &|_| 900.0)], 60);
    let expected = "    Time     Id Actor                                 Duration
       1     25 vehicle.number25                            59
      11     24 vehicle.number24                            29

Frames: 61
Duration: 60 seconds
";
    let text = blocked(&log, 25.0, 100.0);
    assert_eq!(text, format!("{HEAD}{expected}"));
}

#[test]
fn who_stands_for_less_than_the_time_is_not_blocked() {
    let log = standing(&[(24, &|second| 500.0 + 1000.0 * (second / 32) as f32)], 40);
    assert!(blocked(&log, 31.0, 10.0).contains("vehicle.number24"));
    assert!(!blocked(&log, 31.5, 10.0).contains("vehicle.number24"));
}

#[test]
fn who_creeps_by_less_than_the_distance_is_blocked_and_place_is_kept_until_left() {
    // 8 cm from where it was: blocked at 10 cm, but not at 5.
    let log = standing(&[(24, &|second| 500.0 + 8.0 * (second % 2) as f32)], 40);
    assert!(blocked(&log, 30.0, 10.0).contains("vehicle.number24"));
    assert!(!blocked(&log, 30.0, 5.0).contains("vehicle.number24"));
    // Two cm a second leave the 10 cm every five seconds.
    let log = standing(&[(24, &|second| 500.0 + 2.0 * second as f32)], 40);
    assert!(!blocked(&log, 6.0, 10.0).contains("vehicle.number24"));
    assert!(blocked(&log, 4.0, 10.0).contains("vehicle.number24"));
}
