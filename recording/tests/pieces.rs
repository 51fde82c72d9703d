//! A piece of a log is a log, and shows what the whole log shows at that time.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use std::io::Cursor;

use recording::{
    Additional, Class, Destroy, Door, Event, FrameContent, Index, JournalLink, Packet, Parent,
    Player, Reader, Step, cut,
};

use common::{add, at, genuine, log_of, vector};

fn piece_of(log: &[u8], from_secs: f64, to_secs: f64) -> (Vec<u8>, u64) {
    let mut piece = Vec::new();
    let mut reader = Reader::open(log).unwrap();
    let frames = cut(&mut reader, (from_secs, to_secs), &mut piece, |_| ()).unwrap();
    (piece, frames)
}

fn begin(log: &[u8], start_secs: f64) -> (Player<Cursor<&[u8]>>, Step) {
    let index = Index::build(&mut Reader::open(log).unwrap()).unwrap();
    let reader = Reader::open(Cursor::new(log)).unwrap();
    Player::begin(reader, &index, index.span(start_secs, 0.0)).unwrap().unwrap()
}

fn living(step: &Step) -> Vec<(u32, String)> {
    let adds = step.events.iter().filter_map(|event| match event {
        Event::Add(add) => Some((add.id, add.blueprint.clone())),
        _ => None,
    });
    adds.collect()
}

#[test]
fn pieces_of_genuine_logs_show_what_the_logs_show() {
    for (name, log) in genuine() {
        let mut reader = Reader::open(&log[..]).unwrap();
        let mut times = Vec::new();
        while let Some(frame) = reader.next_frame().unwrap() {
            times.push(frame.start.elapsed_secs);
        }
        let (first, last) = (times.len() / 3, times.len() / 2);
        let (piece, frames) = piece_of(&log, times[first], times[last]);
        assert_eq!(frames as usize, last - first + 1, "{name}");
        let (mut whole, begun) = begin(&log, times[first]);
        let (mut part, begun_in_part) = begin(&piece, 0.0);
        assert_eq!(begun.poses, begun_in_part.poses, "{name}");
        assert_eq!(living(&begun), living(&begun_in_part), "{name}");
        for at in first + 1..=last {
            let secs = times[at] - times[at - 1];
            let (of_whole, of_part) =
                (whole.advance(secs, 1.0).unwrap(), part.advance(secs, 1.0).unwrap());
            for (one, other) in of_whole.poses.iter().zip(&of_part.poses) {
                assert_eq!(one.id, other.id);
                let apart = (one.location.x - other.location.x).abs();
                assert!(apart < 0.01, "{name}: {apart} cm at frame {at}");
            }
        }
    }
}

#[test]
fn a_piece_begins_with_all_that_was_said_before_and_lasts() {
    let link = JournalLink { name: "a.journal".to_owned(), ..JournalLink::default() };
    let mut frames: Vec<FrameContent> = (0..10)
        .map(|number| FrameContent {
            elapsed_secs: f64::from(number),
            positions: vec![at(24, 100.0 * number as f32), at(25, 50.0)],
            additional: Some(Additional::default()),
            ..FrameContent::default()
        })
        .collect();
    let origin = vector(0.0, 0.0, 0.0);
    frames[0].adds = vec![
        add(24, Class::VEHICLE, "vehicle.car", origin),
        add(26, Class::VEHICLE, "vehicle.gone", origin),
    ];
    frames[0].foreign = vec![link.packet()];
    frames[1].adds = vec![add(25, Class::SENSOR, "sensor.camera.rgb", vector(1.0, 0.0, 0.0))];
    frames[1].parents = vec![Parent { child: 25, parent: 24 }];
    frames[2].doors = vec![Door { id: 24, door: 1, is_open: true }];
    frames[3].destroys = vec![Destroy { id: 26 }];
    let (piece, count) = piece_of(&log_of(frames), 5.0, 7.0);
    assert_eq!(count, 3);
    let (_, step) = begin(&piece, 0.0);
    let names: Vec<u32> = living(&step).into_iter().map(|(id, _)| id).collect();
    assert_eq!(names, [24, 25]);
    assert!(step.events.contains(&Event::Parent(Parent { child: 25, parent: 24 })));
    let open = Packet::Doors(vec![Door { id: 24, door: 1, is_open: true }]);
    assert!(step.said.contains(&open));
    let index = Index::build(&mut Reader::open(&piece[..]).unwrap()).unwrap();
    assert_eq!(index.journals(), [link]);
    assert_eq!((index.frame_count(), index.total_secs()), (3, 2.0));
    let mut reader = Reader::open(&piece[..]).unwrap();
    let mut starts = Vec::new();
    while let Some(frame) = reader.next_frame().unwrap() {
        starts.push((frame.start.number, frame.start.duration_secs));
        let ids: Vec<u8> = frame.packets().map(|packet| packet.kind.id()).collect();
        assert_eq!((ids.first(), ids.last()), (Some(&0), Some(&1)));
    }
    assert_eq!(starts, [(1, 1.0), (2, 1.0), (3, -1.0)]);
    let Event::Add(car) = &step.events[0] else { panic!("the car comes first") };
    assert_eq!(car.location.x, 500.0, "it enters where it is");
}

#[test]
fn nothing_comes_of_a_time_that_a_log_has_not() {
    let log = log_of([FrameContent::default()]);
    assert_eq!(piece_of(&log, 5.0, 7.0).1, 0);
}
