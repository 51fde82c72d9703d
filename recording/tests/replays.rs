//! What a replay shows, and when.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use std::io::Cursor;

use recording::{
    Class, Destroy, Door, Event, FrameContent, Index, Packet, Parent, Player, Position, Reader,
    Rotation, SceneLight, Step, Weather,
};

use common::{add, at, genuine, log_of, vector};

const STEP_SECS: f64 = 0.05;

fn index_of(log: &[u8]) -> Index {
    Index::build(&mut Reader::open(log).unwrap()).unwrap()
}

fn play(log: &[u8], start_secs: f64, duration_secs: f64) -> (Player<Cursor<&[u8]>>, Step) {
    let index = index_of(log);
    let reader = Reader::open(Cursor::new(log)).unwrap();
    let span = index.span(start_secs, duration_secs);
    Player::begin(reader, &index, span).unwrap().unwrap()
}

fn x_of(step: &Step, id: u32) -> f32 {
    step.poses.iter().find(|pose| pose.id == id).unwrap().location.x
}

/// A car that goes 100 cm from frame to frame, from a place of 0.
fn drive(frames: u32) -> Vec<FrameContent> {
    let mut log: Vec<FrameContent> = (0..frames)
        .map(|number| FrameContent {
            elapsed_secs: f64::from(number) * STEP_SECS,
            positions: vec![at(24, 100.0 * number as f32)],
            ..FrameContent::default()
        })
        .collect();
    log[0].adds = vec![add(24, Class::VEHICLE, "vehicle.car", vector(0.0, 0.0, 0.0))];
    log
}

#[test]
fn equal_steps_give_the_recorded_poses_exactly() {
    let log = log_of(drive(5_000));
    let (mut player, first) = play(&log, 0.0, 0.0);
    assert_eq!(x_of(&first, 24), 0.0);
    for number in 1..5_000 {
        let step = player.advance(STEP_SECS, 1.0).unwrap();
        assert_eq!(x_of(&step, 24), 100.0 * number as f32);
        assert_eq!(step.has_ended, number == 4_999, "{number}");
    }
}

#[test]
fn genuine_logs_are_replayed_to_their_end() {
    for (name, log) in genuine() {
        let mut reader = Reader::open(&log[..]).unwrap();
        let (mut player, _) = play(&log, 0.0, 0.0);
        let mut before_secs = 0.0;
        reader.next_frame().unwrap();
        while let Some(frame) = reader.next_frame().unwrap() {
            let mut recorded = frame.packets().find_map(|packet| match packet.decode().unwrap() {
                Packet::Positions(poses) => Some(poses),
                _ => None,
            });
            recorded.iter_mut().for_each(|poses| poses.sort_by_key(|pose| pose.id));
            let now_secs = frame.start.elapsed_secs;
            let step = player.advance(now_secs - before_secs, 1.0).unwrap();
            before_secs = now_secs;
            assert_eq!(Some(step.poses), recorded, "{name}: frame {}", frame.start.number);
            assert_eq!(step.has_ended, frame.start.duration_secs < 0.0, "{name}");
        }
    }
}

#[test]
fn between_two_frames_poses_are_between_theirs_up_to_a_factor_of_two() {
    let log = log_of(drive(100));
    let shown = |factor: f64| {
        let (mut player, _) = play(&log, 0.0, 0.0);
        (1..8).map(|_| x_of(&player.advance(STEP_SECS, factor).unwrap(), 24)).collect::<Vec<_>>()
    };
    let near = |found: Vec<f32>, wanted: [f32; 7]| {
        assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 0.01), "{found:?}");
    };
    near(shown(0.5), [50.0, 100.0, 150.0, 200.0, 250.0, 300.0, 350.0]);
    near(shown(1.5), [150.0, 300.0, 450.0, 600.0, 750.0, 900.0, 1050.0]);
    near(shown(2.5), [200.0, 500.0, 700.0, 1000.0, 1200.0, 1500.0, 1700.0]);
    near(shown(0.0), [0.0; 7]);
    near(shown(-1.0), [0.0; 7]);
    near(shown(f64::NAN), [0.0; 7]);
}

#[test]
fn the_factor_may_change_at_any_moment_without_a_jump() {
    let log = log_of(drive(100));
    let (mut player, _) = play(&log, 0.0, 0.0);
    let mut wanted = 0.0;
    for factor in [1.0, 1.0, 4.0, 4.0, 0.5, 0.5, 0.0, 1.0] {
        wanted += 100.0 * factor;
        let step = player.advance(STEP_SECS, factor).unwrap();
        assert!((x_of(&step, 24) - wanted as f32).abs() < 0.1, "{factor}");
    }
}

#[test]
fn angles_take_the_shorter_way() {
    let mut frames = drive(3);
    for (frame, yaw) in frames.iter_mut().zip([170.0, -170.0, -150.0]) {
        let rotation = Rotation { yaw, ..Rotation::default() };
        frame.positions = vec![Position { rotation, ..at(24, 0.0) }];
    }
    let log = log_of(frames);
    let (mut player, _) = play(&log, 0.0, 0.0);
    let step = player.advance(STEP_SECS, 0.5).unwrap();
    assert_eq!(step.poses[0].rotation.yaw.rem_euclid(360.0), 180.0);
    assert!((step.velocities[0].angular_velocity.z - 20.0 / 0.05).abs() < 0.1);
}

#[test]
fn a_replay_begins_and_ends_where_it_is_told_to() {
    let log = log_of(drive(401));
    let cases = [
        ((0.0, 0.0), (0.0, 20.0)),
        ((5.0, 0.0), (5.0, 20.0)),
        ((-5.0, 0.0), (15.0, 20.0)),
        ((-50.0, 2.0), (0.0, 2.0)),
        ((3.0, 4.0), (3.0, 7.0)),
        ((18.0, 4.0), (18.0, 22.0)),
        ((0.0, -1.0), (0.0, 20.0)),
    ];
    for ((start, duration), (from, to)) in cases {
        let (mut player, first) = play(&log, start, duration);
        let span = player.span();
        assert!((span.from_secs - from).abs() < 1e-9 && (span.to_secs - to).abs() < 1e-9);
        assert!((x_of(&first, 24) - 2000.0 * from as f32).abs() < 0.1, "{start}");
        let mut steps = 0;
        while !player.advance(STEP_SECS, 1.0).unwrap().has_ended {
            steps += 1;
        }
        assert_eq!(steps + 1, ((to - from) / STEP_SECS).round() as u32, "{start} {duration}");
    }
}

/// A log of 3000 frames in which much happens before frame 2500.
fn eventful() -> Vec<u8> {
    let mut frames = drive(3_000);
    let actor = |id| add(id, Class::OTHER, "static.prop.bench", vector(0.0, 0.0, 0.0));
    frames[10].adds = vec![actor(30), actor(31), actor(32)];
    frames[20].parents = vec![Parent { child: 31, parent: 24 }, Parent { child: 32, parent: 30 }];
    frames[30].destroys = vec![Destroy { id: 30 }];
    frames[40].scene_lights = vec![SceneLight { id: 7, intensity: 1.0, ..SceneLight::default() }];
    frames[1_500].scene_lights =
        vec![SceneLight { id: 7, intensity: 2.0, ..SceneLight::default() }];
    frames[50].doors = vec![Door { id: 24, door: 1, is_open: true }];
    frames[60].weather = Some(Weather([80.0; 14]));
    frames[2_990].destroys = vec![Destroy { id: 31 }];
    log_of(frames)
}

fn added(event: &Event) -> Option<u32> {
    match event {
        Event::Add(add) => Some(add.id),
        _ => None,
    }
}

#[test]
fn whoever_begins_late_finds_what_happened_before() {
    let log = eventful();
    let (_, step) = play(&log, 2_500.0 * STEP_SECS, 0.0);
    let adds: Vec<u32> = step.events.iter().filter_map(added).collect();
    assert_eq!(adds, [24, 31, 32]);
    assert!(step.events.contains(&Event::Parent(Parent { child: 31, parent: 24 })));
    let orphan = |event: &Event| matches!(event, Event::Parent(parent) if parent.child == 32);
    assert!(!step.events.iter().any(orphan), "its parent is gone");
    let lamp = SceneLight { id: 7, intensity: 2.0, ..SceneLight::default() };
    assert!(step.said.contains(&Packet::SceneLights(vec![lamp])));
    assert!(step.said.contains(&Packet::Doors(vec![Door { id: 24, door: 1, is_open: true }])));
    assert!(step.said.iter().any(|packet| matches!(packet, Packet::Weather(_))));
}

#[test]
fn what_frames_say_that_are_passed_over_is_not_lost() {
    let log = eventful();
    let (mut player, _) = play(&log, 0.0, 0.0);
    let step = player.advance(STEP_SECS, 100.0).unwrap();
    assert!(step.events.contains(&Event::Destroy(30)));
    assert!(step.said.contains(&Packet::Doors(vec![Door { id: 24, door: 1, is_open: true }])));
    let lamp = SceneLight { id: 7, intensity: 1.0, ..SceneLight::default() };
    assert!(step.said.contains(&Packet::SceneLights(vec![lamp])));
    let states = step.said.iter().filter(|packet| matches!(packet, Packet::LightStates(_)));
    assert_eq!(states.count(), 1, "of the frame that is shown");
}

#[test]
fn a_replay_that_is_stopped_tells_what_was_still_to_come() {
    let log = eventful();
    let (mut player, _) = play(&log, 2_500.0 * STEP_SECS, 0.0);
    player.advance(STEP_SECS, 1.0).unwrap();
    assert_eq!(player.remaining(&index_of(&log)), [Event::Destroy(31)]);
    let (player, _) = play(&log, 0.0, 0.0);
    let late = player.remaining(&index_of(&log));
    let ids: Vec<u32> = late.iter().filter_map(added).collect();
    assert_eq!((late.len(), ids), (1, vec![32]), "30 and 31 are gone at the end: {late:?}");
}

#[test]
fn a_log_without_frames_has_no_replay() {
    let log = log_of([]);
    let index = index_of(&log);
    let reader = Reader::open(Cursor::new(&log[..])).unwrap();
    assert!(Player::begin(reader, &index, index.span(0.0, 0.0)).unwrap().is_none());
}
