//! Messages by radio.

use schemas::{
    ActorId, AwarenessMessage, BodyCommand, Command, CustomMessage, ErrorCode, Measurement, Pose,
    Received, SensorCommand, StationKind, Vec3, VehicleCommand, level_pose, limits,
};
use world::World;

use crate::common::*;
use crate::support::*;

/// Without random fading, so that powers can be worked out.
const STEADY: (&str, &str) = ("use_etsi_fading", "false");

fn radio(world: &mut World, on: ActorId, attributes: &[(&str, &str)]) -> ActorId {
    let attributes = [attributes, &[STEADY]].concat();
    sensor(world, "sensor.other.v2x", Some(on), Pose::identity(), &attributes)
}

fn texter(world: &mut World, on: ActorId, channel: &str) -> ActorId {
    let attributes = [("channel_id", channel), STEADY];
    let roof = level_pose(Vec3::new(0.0, 0.0, 2.0), 0.0);
    sensor(world, "sensor.other.v2x_custom", Some(on), roof, &attributes)
}

fn heard(world: &World, sensor: ActorId) -> Vec<Received<AwarenessMessage>> {
    let data = data_of(world, sensor).into_iter();
    data.flat_map(|datum| match datum.measurement {
        Measurement::V2x(received) => received,
        other => panic!("no radio: {other:?}"),
    })
    .collect()
}

fn texts(world: &World, sensor: ActorId) -> Vec<CustomMessage> {
    let data = data_of(world, sensor).into_iter();
    data.flat_map(|datum| match datum.measurement {
        Measurement::V2xCustom(received) => received,
        other => panic!("no radio: {other:?}"),
    })
    .map(|received| received.message)
    .collect()
}

fn spawn(world: &mut World, blueprint: &str, x_m: f32, y_m: f32) -> ActorId {
    spawn_at(world, blueprint, level_pose(Vec3::new(x_m, y_m, 0.0), 0.0), 0.0)
}

/// How many messages a car sends in ten seconds that is held at a speed.
fn messages_in_ten_seconds(speed_mps: f32, attributes: &[(&str, &str)]) -> usize {
    let mut world = world();
    let (sender, receiver) = (car(&mut world, -200.0, speed_mps), car(&mut world, 250.0, 0.0));
    let velocity_mps = Some(Vec3::new(speed_mps, 0.0, 0.0));
    world
        .apply(&Command::Body(BodyCommand::SetConstantVelocity { actor: sender, velocity_mps }))
        .unwrap();
    radio(&mut world, sender, attributes);
    let ear = radio(&mut world, receiver, &[]);
    let mut count = 0;
    for _ in 0..200 {
        world.tick().unwrap();
        count += heard(&world, ear).len();
    }
    count
}

#[test]
fn a_car_hears_who_is_where_and_how_fast() {
    let mut world = world();
    let (sender, receiver) = (car(&mut world, 100.0, 20.0), car(&mut world, 200.0, 0.0));
    let ears = [sender, receiver].map(|car| radio(&mut world, car, &[]));
    let gnss = sensor(&mut world, "sensor.other.gnss", Some(sender), Pose::identity(), &[]);
    world.tick().unwrap();
    let received = heard(&world, ears[1]);
    let [Received { power_dbm, message }] = received.as_slice() else { panic!("{received:?}") };
    assert_eq!((message.station, message.kind), (sender, StationKind::PassengerCar));
    let motion = message.motion.unwrap();
    assert!((motion.speed_mps - 20.0).abs() < 0.2 && motion.forward, "{motion:?}");
    assert!((motion.heading_deg - 90.0).abs() < 0.1, "+x is east: {motion:?}");
    assert!((motion.acceleration_mps2.z - 9.81).abs() < 1.0, "{motion:?}");
    let Measurement::Gnss { latitude_deg, longitude_deg, .. } = only(&world, gnss).measurement
    else {
        panic!("no place")
    };
    assert_eq!((message.latitude_deg, message.longitude_deg), (latitude_deg, longitude_deg));
    // 21.5 dBm and 10 dB of antennas less what WINNER+ loses on a highway over 99 m.
    let loss_db = 32.4 + 20.0 * 99.0f32.log10() + 20.0 * 5.9f32.log10();
    assert!((power_dbm - (31.5 - loss_db)).abs() < 0.2, "{power_dbm}");
    assert_eq!(heard(&world, ears[0])[0].message.station, receiver, "nobody hears himself");
}

#[test]
fn messages_come_as_often_as_motion_asks_for() {
    let seldom = messages_in_ten_seconds(0.0, &[]);
    assert!((10..=11).contains(&seldom), "once a second at rest: {seldom}");
    // More than 4 m at 9 m/s: every 0.45 s.
    let moving = messages_in_ten_seconds(9.0, &[]);
    assert!((22..=23).contains(&moving), "{moving}");
    let fixed = messages_in_ten_seconds(0.0, &[("fixed_rate", "true")]);
    assert!((99..=101).contains(&fixed), "every 0.1 s: {fixed}");
}

/// The ticks of 50 ms in which a car sends that is at rest but for what is done to it.
fn sent(ticks: u16, mut act: impl FnMut(&mut World, ActorId, u16)) -> Vec<u16> {
    let mut world = world();
    let [sender, receiver] = [0.0, 50.0].map(|x_m| car(&mut world, x_m, 0.0));
    radio(&mut world, sender, &[]);
    let ear = radio(&mut world, receiver, &[]);
    let mut sent = Vec::new();
    for tick in 1..=ticks {
        act(&mut world, sender, tick);
        world.tick().unwrap();
        sent.extend(heard(&world, ear).iter().map(|_| tick));
    }
    sent
}

fn turn_to(world: &mut World, car: ActorId, heading_rad: f32) {
    let place_m = position_m(world, car);
    let world_from_actor = level_pose(place_m, heading_rad);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor: car,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
}

#[test]
fn a_turn_or_another_speed_asks_for_a_message() {
    assert_eq!(sent(60, |_, _, _| ()), [1, 21, 41]);
    for (turn_deg, wanted) in [(3.0f32, &[1, 21, 41][..]), (6.0, &[1, 10, 19, 28, 37, 57])] {
        let turned = sent(60, |world, car, tick| {
            if tick == 10 {
                turn_to(world, car, turn_deg.to_radians());
            }
        });
        assert_eq!(turned, wanted, "{turn_deg}°; as soon again three times, then every second");
    }
    for (speed_mps, count) in [(0.4, 3), (0.8, 6)] {
        let faster = sent(60, |world, car, tick| {
            let speed_mps = if tick < 10 { 0.0 } else { speed_mps };
            let velocity_mps = Some(Vec3::new(speed_mps, 0.0, 0.0));
            world
                .apply(&Command::Body(BodyCommand::SetConstantVelocity {
                    actor: car,
                    velocity_mps,
                }))
                .unwrap();
        });
        assert_eq!(faster.len(), count, "{speed_mps} m/s: {faster:?}");
    }
}

#[test]
fn vehicles_and_houses_between_weaken_and_distance_ends() {
    let power_dbm =
        |between: Option<(&str, f32)>, receiver_m: Vec3, attributes: &[(&str, &str)]| {
            let mut world = world();
            let sender = car(&mut world, 0.0, 0.0);
            let receiver = spawn(&mut world, "vehicle.lincoln.mkz", receiver_m.x, receiver_m.y);
            if let Some((blueprint, x_m)) = between {
                spawn(&mut world, blueprint, x_m, LANE_Y_M);
            }
            radio(&mut world, sender, &[]);
            let ear = radio(&mut world, receiver, attributes);
            world.tick().unwrap();
            heard(&world, ear).first().map(|received| received.power_dbm)
        };
    let ahead = Vec3::new(40.0, LANE_Y_M, 0.0);
    let free = power_dbm(None, ahead, &[]).unwrap();
    let behind_a_car = power_dbm(Some(("vehicle.mini.cooper_s", 20.0)), ahead, &[]).unwrap();
    let behind_a_truck = power_dbm(Some(("vehicle.carlamotors.firetruck", 20.0)), ahead, &[]);
    assert!((behind_a_car - free).abs() < 0.1, "below the line: {behind_a_car} {free}");
    assert!(behind_a_truck.unwrap() < free - 10.0, "{behind_a_truck:?} {free}");
    // The house stands from (15, -25) to (25, -15).
    let behind_the_house = power_dbm(None, Vec3::new(40.0, -35.0, 0.0), &[]).unwrap();
    assert!(behind_the_house < free - 15.0, "{behind_the_house} {free}");
    assert_eq!(power_dbm(None, ahead, &[("filter_distance", "39")]), None);
    assert_eq!(power_dbm(None, ahead, &[("receiver_sensitivity", "-10")]), None);
}

/// Without a word about fading it is that of ETSI: 3.3 dB on a highway in sight of each other.
#[test]
fn powers_scatter_unless_somebody_turns_fading_off() {
    let scatter_db = |attributes: &[(&str, &str)]| {
        let mut world = world();
        let (sender, receiver) = (car(&mut world, 100.0, 0.0), car(&mut world, 130.0, 0.0));
        let fixed = [attributes, &[("fixed_rate", "true")]].concat();
        let [_, ear] = [sender, receiver]
            .map(|on| sensor(&mut world, "sensor.other.v2x", Some(on), Pose::identity(), &fixed));
        let mut powers_dbm = Vec::new();
        for _ in 0..400 {
            world.tick().unwrap();
            powers_dbm.extend(heard(&world, ear).iter().map(|received| received.power_dbm));
        }
        assert!((199..=201).contains(&powers_dbm.len()), "{}", powers_dbm.len());
        let count = powers_dbm.len() as f32;
        let mean_dbm = powers_dbm.iter().sum::<f32>() / count;
        let square = |dbm: &f32| (dbm - mean_dbm) * (dbm - mean_dbm);
        (powers_dbm.iter().map(square).sum::<f32>() / count).sqrt()
    };
    let etsi_db = scatter_db(&[]);
    assert!((2.8..3.8).contains(&etsi_db), "{etsi_db}");
    let off_db = scatter_db(&[STEADY]);
    assert!(off_db < 0.01, "{off_db}");
}

#[test]
fn a_road_side_unit_sends_twice_a_second_whatever_its_settings() {
    let mut world = world();
    let sign = spawn(&mut world, "static.prop.streetsign", 20.0, -9.0);
    let receiver = car(&mut world, 40.0, 0.0);
    radio(&mut world, sign, &[("fixed_rate", "true")]);
    let ear = radio(&mut world, receiver, &[]);
    let mut told = Vec::new();
    for tick in 1..=30 {
        world.tick().unwrap();
        for Received { message, .. } in heard(&world, ear) {
            assert_eq!((message.station, message.kind), (sign, StationKind::RoadSideUnit));
            assert_eq!((message.motion, message.lights), (None, None));
            told.push(tick);
        }
    }
    assert_eq!(told, [1, 11, 21]);
}

#[test]
fn an_ambulance_tells_its_lights_twice_a_second() {
    let mut world = world();
    let sender = spawn(&mut world, "vehicle.ford.ambulance", 10.0, LANE_Y_M);
    let receiver = car(&mut world, 40.0, 0.0);
    world.apply(&Command::Vehicle(VehicleCommand::Lights { actor: sender, lights: 3 })).unwrap();
    radio(&mut world, sender, &[("fixed_rate", "true")]);
    let ear = radio(&mut world, receiver, &[]);
    let mut told = Vec::new();
    for _ in 0..20 {
        world.tick().unwrap();
        for received in heard(&world, ear) {
            assert_eq!(received.message.kind, StationKind::SpecialVehicle);
            told.push(received.message.lights);
        }
    }
    let lights: Vec<usize> = (0..told.len()).filter(|at| told[*at].is_some()).collect();
    assert_eq!(lights, [0, 5], "{told:?}");
    assert_eq!(told[0], Some(3));
}

#[test]
fn texts_reach_others_of_the_channel_once() {
    let mut world = world();
    let cars = [0.0, 20.0, 40.0].map(|x_m| car(&mut world, x_m, 0.0));
    let [sender, same] = [cars[0], cars[1]].map(|car| texter(&mut world, car, "a"));
    let other = texter(&mut world, cars[2], "b");
    for text in ["hello", "again"] {
        let text = text.to_owned();
        world.apply(&Command::Sensor(SensorCommand::SendV2x { sensor: sender, text })).unwrap();
    }
    let waiting = world.state_hash();
    let mut fork = world.fork(world.id());
    for world in [&mut world, &mut fork] {
        world.tick().unwrap();
        let message = |text: &str| CustomMessage { station: cars[0], text: text.to_owned() };
        assert_eq!(texts(world, same), [message("hello"), message("again")]);
        assert!(texts(world, sender).is_empty() && texts(world, other).is_empty());
        assert_ne!(world.state_hash(), waiting);
        world.tick().unwrap();
        assert!(texts(world, same).is_empty());
    }
}

#[test]
fn what_cannot_be_sent_is_refused_and_changes_nothing() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let texter = texter(&mut world, car, "");
    let radio = radio(&mut world, car, &[]);
    let mut send = |sensor: ActorId, text: &str| {
        let before = world.state_hash();
        let sent =
            world.apply(&Command::Sensor(SensorCommand::SendV2x { sensor, text: text.to_owned() }));
        sent.map_err(|error| {
            assert_eq!(world.state_hash(), before);
            error.code
        })
    };
    let long = "x".repeat(limits::V2X_TEXT_BYTES_MAX + 1);
    assert_eq!(send(texter, &long), Err(ErrorCode::TooLarge));
    assert_eq!(send(radio, "no"), Err(ErrorCode::InvalidArgument));
    assert_eq!(send(car, "no"), Err(ErrorCode::InvalidArgument));
    for _ in 0..limits::V2X_TEXTS_PER_TICK_MAX {
        send(texter, &long[1..]).unwrap();
    }
    assert_eq!(send(texter, "one more"), Err(ErrorCode::Capacity));
}

#[test]
fn a_sensor_that_hangs_on_nothing_hears_and_says_nothing_of_itself() {
    let mut world = world();
    let car = car(&mut world, 0.0, 0.0);
    let free = sensor(&mut world, "sensor.other.v2x", None, Pose::identity(), &[]);
    let ear = radio(&mut world, car, &[]);
    for _ in 0..20 {
        world.tick().unwrap();
        assert!(heard(&world, free).is_empty() && heard(&world, ear).is_empty());
    }
}
