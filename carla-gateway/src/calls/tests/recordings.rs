//! Recordings through the calls, against a world service that does whatever it is told.

use std::path::PathBuf;

use recording::{
    Add, Attribute, Bone, Bones, Class, Door, FrameContent, Header, LightState, Parent, Position,
    Rotation, SceneLight, Vector, VehicleControl, VehicleLights, WalkerSpeed, Weather, Writer,
    attribute,
};
use schemas::{BodyCommand, Command, SplitMix64};

use super::toy::{Toy, runtime};
use super::*;

/// `[0, 1, method, [[false], arguments]]`.
fn call<T: serde::Serialize>(method: &str, arguments: T) -> Request {
    let params = rmp_serde::to_vec(&arguments).unwrap();
    request(method, &params).unwrap()
}

/// What a call is answered that may come again when a recording is opened.
async fn answer_in_the_end(endpoint: &mut Endpoint, request: &Request) -> Answer {
    loop {
        let answer = answer(endpoint, request).await;
        let Some(ready) = endpoint.take_again() else { return answer };
        endpoint.bring(Some(ready.await.unwrap()));
    }
}

/// Replays all of a recording from 0.1 s on, seen by the actor 50.
fn replay_of(name: &str) -> Request {
    let offset = ((0.0f32, 0.0f32, 1.0f32), (0.0f32, 0.0f32, 0.0f32));
    call("replay_file", ((false,), name, 0.1, 0.0, 50, true, offset))
}

#[test]
fn a_recording_that_is_opened_does_not_hold_the_endpoint() {
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        let gate = endpoint.recorder.hold_answers().await;
        let replay = replay_of("none.log");
        let mut openings = Vec::new();
        for _ in 0..4 {
            answer(&mut endpoint, &replay).await.unwrap();
            openings.push(endpoint.take_again().unwrap());
        }
        let refusal = answer(&mut endpoint, &replay).await.unwrap_err();
        assert!(refusal.0.contains("at most 4 recordings"), "{refusal}");
        let weather = call("get_weather_parameters", ((false,),));
        assert!(matches!(answer(&mut endpoint, &weather).await, Ok(Payload::Value(_))));
        assert!(!openings[0].is_finished());
        drop(gate);
        for opening in openings {
            endpoint.bring(Some(opening.await.unwrap()));
            let told = answer(&mut endpoint, &replay).await;
            let Ok(Payload::Value(bytes)) = told else { panic!("no text") };
            let text: String = rmp_serde::from_slice(&bytes).unwrap();
            assert!(text.ends_with("none.log not found on server\n"), "{text}");
        }
    });
}

#[test]
fn a_question_does_not_hold_the_endpoint() {
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        let gate = endpoint.recorder.hold_answers().await;
        let question = call("show_recorder_collisions", ((false,), "none.log", b'a', b'a'));
        let mut questions = Vec::new();
        for _ in 0..64 {
            let answer = answer(&mut endpoint, &question).await;
            questions.push(endpoint.report(answer).later.unwrap());
        }
        let refusal = answer(&mut endpoint, &question).await.unwrap_err();
        assert!(refusal.0.contains("at most 64 questions"), "{refusal}");
        let weather = call("get_weather_parameters", ((false,),));
        assert!(matches!(answer(&mut endpoint, &weather).await, Ok(Payload::Value(_))));
        assert!(!questions[0].is_finished());
        drop(gate);
        for question in questions {
            let Ok(Payload::Value(bytes)) = question.await.unwrap() else { panic!("no text") };
            let text: String = rmp_serde::from_slice(&bytes).unwrap();
            assert!(text.ends_with("none.log not found on server\n"), "{text}");
        }
    });
}

#[test]
fn no_two_journals_beside_a_recording_have_one_name() {
    runtime().block_on(async {
        let (mut endpoint, toy) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        let name = format!("journals-{}.log", std::process::id());
        answer(&mut endpoint, &call("start_recorder", ((false,), &name, false))).await.unwrap();
        endpoint.tick().await.unwrap();
        toy.crash();
        // The first new world is lost on its way to where the old one was.
        toy.busy.store(1, Ordering::Relaxed);
        endpoint.tick().await.unwrap();
        let ends = ["journal", "2.journal", "3.journal"];
        assert_eq!(*toy.journals.lock().unwrap(), ends.map(|end| format!("{name}.{end}")));
        answer(&mut endpoint, &call("stop_recorder", ((false,),))).await.unwrap();
        let path = endpoint.recorder.recordings().path_of(&name).unwrap();
        endpoint.recorder.settle(&path).await;
        std::fs::remove_file(path).unwrap();
    });
}

/// Actors of every class, told everything, in the map of the toy.
fn eventful() -> Vec<u8> {
    let header = Header { version: Header::VERSION, date: 0, map: "Town10HD".to_owned() };
    let mut writer = Writer::begin(Vec::new(), &header).unwrap();
    let add = |id, class, blueprint: &str| Add {
        id,
        class,
        blueprint: blueprint.to_owned(),
        attributes: vec![Attribute {
            kind: attribute::STRING,
            name: "role_name".to_owned(),
            value: "hero".to_owned(),
        }],
        ..Add::default()
    };
    for number in 0..8u32 {
        let location = Vector { x: 100.0 * number as f32, y: 0.0, z: 50.0 };
        let rotation = Rotation::default();
        let bone = Bone { name: "crl_root".to_owned(), location, rotation };
        let mut content = FrameContent {
            elapsed_secs: 0.05 * f64::from(number),
            positions: (1..60).map(|id| Position { id, location, rotation }).collect(),
            light_states: vec![LightState { id: 1, state: 2, ..LightState::default() }],
            vehicle_controls: vec![VehicleControl { id: 50, gear: -1, ..Default::default() }],
            walker_speeds: vec![WalkerSpeed { id: 51, speed: 120.0 }],
            vehicle_lights: vec![VehicleLights { id: 50, flags: number }],
            scene_lights: vec![SceneLight { id: 3, intensity: 7.0, ..SceneLight::default() }],
            doors: vec![Door { id: 50, door: 6, is_open: true }],
            weather: Some(Weather([50.0; 14])),
            additional: Some(recording::Additional {
                bones: vec![Bones { id: 51, bones: vec![bone] }],
                ..Default::default()
            }),
            ..FrameContent::default()
        };
        if number == 0 {
            content.adds = vec![
                add(1, Class::TRAFFIC_LIGHT, "traffic.traffic_light"),
                add(2, Class::OTHER, "spectator"),
                add(50, Class::VEHICLE, "vehicle.lincoln.mkz_2020"),
                add(51, Class::WALKER, "walker.pedestrian.0001"),
                add(52, Class::SENSOR, "sensor.other.imu"),
                add(53, Class::OTHER, "static.prop.constructioncone"),
            ];
            content.parents = vec![Parent { child: 52, parent: 50 }];
        }
        writer.frame(content).unwrap();
    }
    writer.finish().unwrap()
}

/// Whether a replay puts somebody somewhere when it goes on by a frame.
fn is_put(endpoint: &Endpoint, id: u32) -> bool {
    endpoint.pending.iter().any(|command| match command {
        Command::Body(BodyCommand::SetPose { actor, .. }) => actor.get() == id,
        _ => false,
    })
}

#[test]
fn what_stands_where_the_recording_has_it_is_not_put_there_again() {
    let folder = std::env::temp_dir().join("causeway-toy");
    std::fs::create_dir_all(&folder).unwrap();
    let name = format!("standing-{}.log", std::process::id());
    let path: PathBuf = folder.join(&name);
    let header = Header { version: Header::VERSION, date: 0, map: "Town10HD".to_owned() };
    let mut writer = Writer::begin(Vec::new(), &header).unwrap();
    let spectator = || Add { id: 2, blueprint: "spectator".to_owned(), ..Add::default() };
    // The toy's spectator is at the origin, where this one stays for three frames.
    for number in 0..6 {
        let x = if number < 4 { 0.0 } else { 100.0 };
        let location = Vector { x, ..Vector::default() };
        let rotation = Rotation::default();
        let content = FrameContent {
            elapsed_secs: 0.05 * f64::from(number),
            adds: if number == 0 { vec![spectator()] } else { Vec::new() },
            positions: vec![Position { id: 2, location, rotation }],
            ..FrameContent::default()
        };
        writer.frame(content).unwrap();
    }
    std::fs::write(&path, writer.finish().unwrap()).unwrap();
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        let ignore = call("set_replayer_ignore_spectator", ((false,), false));
        answer(&mut endpoint, &ignore).await.unwrap();
        answer_in_the_end(&mut endpoint, &replay_of(&name)).await.unwrap();
        let mut put = Vec::new();
        for _ in 0..3 {
            endpoint.play(0.05).await.unwrap();
            put.push(is_put(&endpoint, 2));
            endpoint.pending.clear();
        }
        assert_eq!(put, [false, true, true]);
    });
    std::fs::remove_file(path).unwrap();
}

/// Changes some bytes behind the head. Seeded, so that a failure can be repeated.
fn damage(log: &mut [u8], seed: u64) {
    let mut dice = SplitMix64::new(seed);
    let mut below = |limit: usize| (dice.next_u64() % limit as u64) as usize;
    for _ in 0..=below(6) {
        let at = 40 + below(log.len() - 40);
        log[at] = [0, 1, 50, 51, 127, 128, 255][below(7)];
    }
}

#[test]
fn no_damaged_recording_breaks_a_replay() {
    let folder = std::env::temp_dir().join("causeway-toy");
    std::fs::create_dir_all(&folder).unwrap();
    let name = format!("damaged-{}.log", std::process::id());
    let path: PathBuf = folder.join(&name);
    let whole = eventful();
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        let replay = replay_of(&name);
        let mut begun = 0;
        for seed in 0..2_000 {
            let mut log = whole.clone();
            if seed > 0 {
                damage(&mut log, seed);
            }
            std::fs::write(&path, &log).unwrap();
            begun += usize::from(answer_in_the_end(&mut endpoint, &replay).await.is_ok());
            for _ in 0..4 {
                let _ = endpoint.play(0.05).await;
                let _ = endpoint.flush().await;
            }
            let stop = call("stop_replayer", ((false,), seed % 2 == 0));
            let _ = answer(&mut endpoint, &stop).await;
            assert!(seed > 0 || begun == 1, "the whole one is replayed");
        }
        assert!(begun > 1_000, "{begun}");
    });
    std::fs::remove_file(path).unwrap();
}
