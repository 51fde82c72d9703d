//! What older servers, and that of UE5, meant.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use recording::{Add, Biker, Door, Kind, Long, Packet, Position, Reader, WheelPose, Wheels};

use common::{at, everything, header, log_of};

/// A packet as it lies in a log.
fn raw(id: u8, body: &[u8]) -> Vec<u8> {
    let size = (body.len() as u32).to_le_bytes();
    [&[id][..], &size, body].concat()
}

fn body_of(packet: &Packet) -> Vec<u8> {
    let mut bytes = Vec::new();
    packet.put(&mut bytes);
    bytes.split_off(5)
}

/// A log of version 1 with one frame.
fn old_log(packets: &[Vec<u8>]) -> Vec<u8> {
    let head = recording::Writer::begin(Vec::new(), &header("Town01")).unwrap().finish().unwrap();
    let mut log = head;
    log[0] = 1;
    let start = [&1u64.to_le_bytes()[..], &(-1f64).to_le_bytes(), &0f64.to_le_bytes()].concat();
    log.extend(raw(0, &start));
    log.extend(packets.concat());
    log.extend(raw(1, &[]));
    log
}

fn packets_of(log: &[u8]) -> Vec<Packet> {
    let mut reader = Reader::open(log).unwrap();
    let frame = reader.next_frame().unwrap().unwrap();
    frame.packets().map(|packet| packet.decode().unwrap()).collect()
}

#[test]
fn doors_before_positions_shift_the_numbers_of_what_follows() {
    let doors = Packet::Doors(vec![Door { id: 24, door: 2, is_open: true }]);
    let wheel = WheelPose { wheel: 1, steer_deg: 2.0, rotation_deg: 3.0 };
    let wheels = Packet::Wheels(vec![Wheels { id: 24, wheels: Long(vec![wheel]) }]);
    let bikers = Packet::Bikers(vec![Biker { id: 25, speed: 1.0, engine: 0.5 }]);
    let positions = Packet::Positions(vec![at(24, 5.0)]);
    let log = old_log(&[
        raw(21, &body_of(&doors)),
        raw(6, &body_of(&positions)),
        raw(22, &body_of(&wheels)),
        raw(23, &body_of(&bikers)),
    ]);
    assert_eq!(packets_of(&log)[1..5], [doors, positions, wheels, bikers]);
}

#[test]
fn without_doors_before_positions_21_is_wheels() {
    let wheels = Packet::Wheels(vec![Wheels { id: 24, wheels: Long(Vec::new()) }]);
    let bikers = Packet::Bikers(vec![Biker { id: 25, speed: 1.0, engine: 0.5 }]);
    let log = old_log(&[
        raw(6, &body_of(&Packet::Positions(vec![at(24, 5.0)]))),
        raw(21, &body_of(&wheels)),
        raw(22, &body_of(&bikers)),
    ]);
    assert_eq!(packets_of(&log)[2..4], [wheels, bikers]);
}

#[test]
fn vectors_of_double_precision_are_recognised() {
    let wide = |numbers: [f64; 6]| numbers.map(f64::to_le_bytes).concat();
    let mut adds = vec![1, 0, 24, 0, 0, 0, 1];
    adds.extend(wide([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    adds.extend([26, 0, 0, 0, 3, 0]);
    adds.extend(b"car");
    adds.extend([0, 0]);
    let mut positions = vec![1, 0, 24, 0, 0, 0];
    positions.extend(wide([7.0, 8.0, 9.0, 10.0, 11.0, 12.0]));
    let physics = raw(Kind::Physics.id(), &[9; 30]);
    let log = old_log(&[raw(2, &adds), raw(6, &positions), physics]);
    let packets = packets_of(&log);
    let Packet::Adds(adds) = &packets[1] else { panic!("{packets:?}") };
    let Add { id, uid, blueprint, location, .. } = &adds[0];
    assert_eq!((*id, *uid, blueprint.as_str(), location.z), (24, 26, "car", 3.0));
    let Packet::Positions(positions) = &packets[2] else { panic!("{packets:?}") };
    let Position { location, rotation, .. } = positions[0];
    assert_eq!((location.x, rotation.roll, rotation.yaw), (7.0, 10.0, 12.0));
    assert_eq!(packets[3], Packet::Foreign(Kind::Physics.id(), vec![9; 30]));
}

#[test]
fn wheels_without_stiffness_are_recognised() {
    let mut contents = everything();
    let mut additional = contents.remove(0).additional.unwrap();
    let long = body_of(&Packet::Physics(additional.physics.clone()));
    // One wheel, which comes last: the stiffness stands before the three numbers of its place.
    let (front, back) = long.split_at(long.len() - 12);
    let short = [&front[..front.len() - 12], back].concat();
    let packets = packets_of(&old_log(&[raw(15, &short)]));
    additional.physics[0].wheels[0].stiffness = [0.0; 3];
    assert_eq!(packets[1], Packet::Physics(additional.physics));
}

#[test]
fn packets_of_others_are_passed_over() {
    let log = old_log(&[raw(200, b"whatever"), raw(101, &[])]);
    assert_eq!(
        packets_of(&log)[1..3],
        [Packet::Foreign(200, b"whatever".to_vec()), Packet::Foreign(101, Vec::new())]
    );
}

#[test]
fn frames_are_read_as_they_were_written() {
    let log = log_of(everything());
    assert_eq!(log[..2], [2, 0]);
    let mut reader = Reader::open(&log[..]).unwrap();
    let mut order = Vec::new();
    let mut durations = Vec::new();
    while let Some(frame) = reader.next_frame().unwrap() {
        durations.push(frame.start.duration_secs);
        order.push(frame.packets().map(|packet| packet.kind.id()).collect::<Vec<_>>());
    }
    let everywhere = [0, 20, 2, 3, 4, 5, 23, 6, 7, 8, 9, 10];
    let first = [&everywhere[..], &[11, 21, 22, 24, 12, 13, 17, 14, 15, 16, 19, 1]].concat();
    let other = [&everywhere[..], &[21, 22, 13, 14, 19, 1]].concat();
    assert_eq!(order, [first, other.clone(), other]);
    assert_eq!(durations, [0.05, 0.1 - 0.05, -1.0]);
}
