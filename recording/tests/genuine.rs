//! Logs that CARLA itself wrote are read whole, and say what they are known to say.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use std::collections::BTreeMap;

use recording::query::{Letter, actors_blocked, collisions, file_info, last_frame};
use recording::{Class, Packet, RawPacket, Reader};

use common::{date, genuine};

/// Every packet of a log.
fn for_each_packet(log: &[u8], mut visit: impl FnMut(&RawPacket<'_>)) {
    let mut reader = Reader::open(log).unwrap();
    while let Some(frame) = reader.next_frame().unwrap() {
        frame.packets().for_each(|packet| visit(&packet));
    }
    assert_eq!(reader.cut(), None);
}

#[test]
fn every_packet_is_written_as_it_was_read() {
    for (name, log) in genuine() {
        let mut bytes = 0;
        for_each_packet(&log, |packet| {
            let mut decoded = packet.decode().unwrap();
            // Version 2 counts types of attributes from 1.
            if let Packet::Adds(adds) = &mut decoded {
                let attributes = adds.iter_mut().flat_map(|add| &mut add.attributes);
                attributes.for_each(|attribute| attribute.kind -= 1);
            }
            let mut written = Vec::new();
            decoded.put(&mut written);
            assert_eq!(written[0], packet.kind.id(), "{name}");
            assert_eq!(written[5..], *packet.body, "{name}: {:?}", packet.kind);
            bytes += written.len();
        });
        // What is left is the head.
        assert_eq!(log.len() - bytes, 34, "{name}");
    }
}

#[test]
fn frames_and_durations_are_known() {
    let known = BTreeMap::from([
        ("DistanceBetweenVehicles", (847, 24.7237)),
        ("DistanceToLaneCenter", (432, 0.0)),
    ]);
    for (name, log) in genuine() {
        let mut reader = Reader::open(&log[..]).unwrap();
        assert_eq!((reader.header().version, reader.header().map.as_str()), (1, "Town01"));
        let last = last_frame(&mut reader).unwrap().unwrap();
        let (frames, secs) = known[name.as_str()];
        assert_eq!((last.number, last.duration_secs), (frames, -1.0), "{name}");
        assert!(secs == 0.0 || (last.elapsed_secs - secs).abs() < 1e-4, "{name}: {last:?}");
    }
}

#[test]
fn each_frame_begins_where_the_one_before_it_ends() {
    for (name, log) in genuine() {
        let mut reader = Reader::open(&log[..]).unwrap();
        let (mut number, mut end_secs) = (0, 0.0);
        while let Some(frame) = reader.next_frame().unwrap() {
            assert_eq!(frame.start.number, number + 1, "{name}");
            assert!((frame.start.elapsed_secs - end_secs).abs() < 1e-6, "{name}: {number}");
            number = frame.start.number;
            end_secs = frame.start.elapsed_secs + frame.start.duration_secs;
        }
    }
}

#[test]
fn attributes_have_the_types_that_version_2_gives_them() {
    for (_, log) in genuine() {
        let mut kinds = BTreeMap::new();
        for_each_packet(&log, |packet| {
            if let Packet::Adds(adds) = packet.decode().unwrap() {
                for attribute in adds.into_iter().flat_map(|add| add.attributes) {
                    kinds.insert(attribute.name, attribute.kind);
                }
            }
        });
        let of = |name: &str| kinds[name];
        use recording::attribute::{BOOL, COLOUR, INT, STRING};
        let found = ["number_of_wheels", "sticky_control", "role_name", "color"].map(of);
        assert_eq!(found, [INT, BOOL, STRING, COLOUR]);
    }
}

#[test]
fn texts_of_genuine_logs_have_their_form() {
    for (name, log) in genuine() {
        let mut out = Vec::new();
        file_info(&mut Reader::open(&log[..]).unwrap(), true, &date, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let frames = text.lines().filter(|line| line.starts_with("Frame ")).count();
        let head: Vec<&str> = text.lines().take(2).collect();
        assert_eq!(head, ["Version: 1", "Map: Town01"]);
        assert!(text.contains("\n   torque_curve = ("), "{name}");
        assert!(text.contains(&format!("\nFrames: {frames}\nDuration: ")), "{name}");
        let mut tables = Vec::new();
        let any = [Letter('a'), Letter('a')];
        collisions(&mut Reader::open(&log[..]).unwrap(), any, &date, &mut tables).unwrap();
        let mut reader = Reader::open(&log[..]).unwrap();
        actors_blocked(&mut reader, 5.0, 100.0, &date, &mut tables).unwrap();
        let tables = String::from_utf8(tables).unwrap();
        assert!(tables.contains(" spectator "), "{name}: {tables}");
    }
}

#[test]
fn vehicles_are_of_class_1_and_lights_of_class_3() {
    for (name, log) in genuine() {
        for_each_packet(&log, |packet| {
            let Packet::Adds(adds) = packet.decode().unwrap() else { return };
            for add in adds {
                let class = match add.blueprint.split('.').next() {
                    Some("vehicle") => Class::VEHICLE,
                    Some("sensor") => Class::SENSOR,
                    _ if add.blueprint == "traffic.traffic_light" => Class::TRAFFIC_LIGHT,
                    _ => continue,
                };
                assert_eq!(add.class, class, "{name}: {}", add.blueprint);
            }
        });
    }
}
