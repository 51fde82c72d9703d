//! Goal: whatever breaks, every request gets an answer, others are untouched, and nothing is left.
//! Method: break it: kill processes, send what no program would send, open one session too many.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::time::Instant;

use schemas::{ErrorCode, Reply, Request, ServiceKind};
use serde_json::{Value, json};
use tests::{AT_LAST, SOON, Service, Session, Site, eventually};
use tokio_tungstenite::tungstenite::Message;

/// Sessions of a site unless told otherwise.
const SESSIONS_MAX: usize = 256;

fn trolley() -> Value {
    json!({"scenario_name": "trolley_saves", "seed": 1})
}

fn observe() -> Value {
    json!({"action_type": "observe"})
}

/// A session in mid-episode.
fn driving(site: &Site) -> Session {
    let mut session = site.session();
    session.reset(trolley());
    session.step(observe());
    session
}

fn capture(session: &mut Session) -> Result<String, String> {
    captured(&session.step(json!({"action_type": "capture_image"})))
}

fn capturing() -> Message {
    Message::text(json!({"type": "step", "data": {"action_type": "capture_image"}}).to_string())
}

fn captured(answer: &Value) -> Result<String, String> {
    let observation = &answer["observation"];
    match observation["camera_image"].as_str() {
        Some(image) => Ok(image.to_owned()),
        None => Err(observation["metadata"]["camera_error"].as_str().unwrap().to_owned()),
    }
}

#[test]
fn worlds_go_on_without_the_renderer_and_pictures_come_back_with_it() {
    let site = Site::start(&[]);
    site.probe().wait_for(ServiceKind::Render);
    let mut session = driving(&site);
    session.set_deadline(AT_LAST);
    let before = capture(&mut session).unwrap();
    site.kill(Service::Render);
    // The picture waits for the new renderer, or says why there is none.
    let during = capture(&mut session);
    assert!(during.as_ref().is_ok_and(|image| *image == before) || during.is_err(), "{during:?}");
    site.kill(Service::Render);
    let started = Instant::now();
    for _ in 0..20 {
        session.step(observe());
    }
    // Each would wait for seconds if it waited for a renderer.
    assert!(started.elapsed() < SOON, "{:?}", started.elapsed());
    eventually("picture of the new renderer", AT_LAST, || capture(&mut session));
}

/// All have the same picture to be drawn, so that what comes can be compared with a quiet run's.
#[test]
fn a_renderer_that_dies_with_64_pictures_under_way_loses_none_without_saying_why() {
    let site = Site::start(&[]);
    site.probe().wait_for(ServiceKind::Render);
    let drawing = || {
        let mut session = site.session();
        session.set_deadline(AT_LAST);
        let size = json!({"camera_width": 1280, "camera_height": 720});
        let scenario =
            json!({"scenario_name": "trolley_saves", "seed": 1, "scenario_config": size});
        session.reset(scenario);
        session
    };
    let mut sessions: Vec<Session> = (0..64).map(|_| drawing()).collect();
    let quiet = capture(&mut sessions[0]).unwrap();
    for session in &mut sessions[1..] {
        session.send(capturing());
    }
    // The first one is sent again as well: it had its picture.
    sessions[0].send(capturing());
    let first = captured(&sessions[0].read()["data"]);
    site.kill(Service::Render);
    let mut answers = vec![first];
    answers.extend(sessions[1..].iter_mut().map(|session| captured(&session.read()["data"])));
    let came = answers.iter().filter(|answer| answer.is_ok()).count();
    eprintln!("{came} of 64 pictures came, the others said why");
    for answer in answers {
        match answer {
            Ok(picture) => assert!(picture == quiet, "another picture than in a quiet run"),
            Err(reason) => assert!(reason.contains("render"), "{reason}"),
        }
    }
    for session in &mut sessions {
        eventually("picture of the new renderer", AT_LAST, || capture(session));
    }
}

#[test]
fn a_site_without_a_renderer_answers_a_picture_request_with_the_reason() {
    let site = Site::without_renderer();
    let mut session = driving(&site);
    let answer = session.step(json!({"action_type": "capture_image"}));
    let observation = &answer["observation"];
    assert_eq!(observation["camera_image"], Value::Null);
    let reason = observation["metadata"]["camera_error"].as_str().unwrap();
    assert!(reason.contains("renderer"), "{reason}");
    assert_eq!(observation["step_number"], 1);
    let next = session.step(observe());
    assert_eq!(next["observation"]["step_number"], 2);
}

#[test]
fn sessions_go_on_when_their_world_service_is_lost_and_leave_no_world_behind() {
    let site = Site::without_renderer();
    let mut sessions: Vec<Session> = (0..4).map(|_| driving(&site)).collect();
    site.kill(Service::World);
    for session in &mut sessions {
        let before = session.step(observe())["observation"]["step_number"].as_u64().unwrap();
        let next = session.step(observe());
        assert_eq!(next["observation"]["step_number"], before + 1);
    }
    site.probe().wait_for_worlds(sessions.len());
    for session in &mut sessions {
        let first = session.reset(trolley());
        assert_eq!(first["observation"]["step_number"], 0);
    }
    site.probe().wait_for_worlds(sessions.len());
}

#[test]
fn a_lost_scenario_service_leaves_no_world_behind() {
    let site = Site::without_renderer();
    let probe = site.probe();
    let _session = driving(&site);
    probe.wait_for_worlds(1);
    site.kill(Service::Scenario);
    probe.wait_for_worlds(0);
}

#[test]
fn a_client_that_dies_in_mid_episode_leaves_no_world_and_harms_nobody() {
    let site = Site::without_renderer();
    let probe = site.probe();
    let mut neighbour = driving(&site);
    // The socket closes without a goodbye, as the operating system does it for a killed process.
    drop(driving(&site));
    probe.wait_for_worlds(1);
    let mut waiting = driving(&site);
    waiting.send(Message::text(json!({"type": "step", "data": observe()}).to_string()));
    drop(waiting);
    probe.wait_for_worlds(1);
    neighbour.step(observe());
}

#[test]
fn bytes_that_are_no_message_are_refused_on_every_key_and_change_nothing() {
    let site = Site::without_renderer();
    let probe = site.probe();
    let mut neighbour = driving(&site);
    let world = probe.worlds()[0].world;
    let valid = schemas::wire::encode_request(&Request::ListMaps);
    for key in probe.keys(world) {
        for (index, bytes) in broken(&valid).into_iter().enumerate() {
            let refusal = probe.send_bytes(&key, bytes).unwrap_err();
            assert_eq!(refusal.code, ErrorCode::InvalidMessage, "{key}, {index}: {refusal}");
        }
    }
    assert!(matches!(probe.ask(&Request::ListMaps), Ok(Reply::Maps(_))));
    let next = neighbour.step(observe());
    assert_eq!(next["observation"]["step_number"], 2, "the world has moved on its own");
}

/// Damaged forms of a valid message: cut, with a foreign identifier, pointing outside, and more.
fn broken(valid: &[u8]) -> Vec<Vec<u8>> {
    let mut foreign = valid.to_vec();
    foreign[4..8].copy_from_slice(b"NOPE");
    let mut outside = valid.to_vec();
    outside[0..4].copy_from_slice(&u32::MAX.to_le_bytes());
    let cut = valid[..valid.len() - 5].to_vec();
    vec![Vec::new(), vec![0; 8], cut, foreign, outside, vec![0xff; 10_000_000]]
}

#[test]
fn text_of_the_wrong_shape_is_refused_and_the_session_goes_on() {
    let site = Site::without_renderer();
    let mut session = driving(&site);
    for (text, code) in [
        ("", "INVALID_JSON"),
        ("{", "INVALID_JSON"),
        ("[]", "INVALID_JSON"),
        ("null", "INVALID_JSON"),
        ("{}", "UNKNOWN_TYPE"),
        (r#"{"type":"dance"}"#, "UNKNOWN_TYPE"),
        (r#"{"type":7}"#, "UNKNOWN_TYPE"),
        (r#"{"type":"step"}"#, "VALIDATION_ERROR"),
        (r#"{"type":"step","data":[]}"#, "VALIDATION_ERROR"),
        (r#"{"type":"state","data":{}}"#, "VALIDATION_ERROR"),
        (r#"{"type":"step","data":{"throttle":2}}"#, "VALIDATION_ERROR"),
        (r#"{"type":"step","data":{"throttle":1e999}}"#, "INVALID_JSON"),
        (r#"{"type":"step","data":{"warp":1}}"#, "VALIDATION_ERROR"),
        (r#"{"type":"reset","data":{"scenario_name":"nope"}}"#, "EXECUTION_ERROR"),
    ] {
        let refusal = session.ask_text(text);
        assert_eq!(refusal["type"], "error", "{text}: {refusal}");
        assert_eq!(refusal["data"]["code"], code, "{text}: {refusal}");
    }
    let deep = session.ask_text(&"[".repeat(100_000));
    let binary = session.ask_bytes(vec![0xff, 0xfe, 0x00]);
    for (refusal, words) in [(deep, "recursion limit"), (binary, "not UTF-8")] {
        assert_eq!(refusal["data"]["code"], "INVALID_JSON", "{refusal}");
        assert!(refusal["data"]["message"].as_str().unwrap().contains(words), "{refusal}");
    }
    assert_eq!(session.step(observe())["observation"]["step_number"], 2);
}

#[test]
fn a_message_of_ten_megabytes_is_refused_and_harms_nobody() {
    let site = Site::without_renderer();
    let mut neighbour = driving(&site);
    let mut session = driving(&site);
    let huge = json!({"type": "step", "data": {"lane_direction": "x".repeat(10_000_000)}});
    let refusal = session.ask(&huge);
    assert_eq!(refusal["data"]["code"], "INVALID_JSON", "{refusal}");
    let told = refusal["data"]["message"].as_str().unwrap();
    assert!(told.contains("at most 2097152 bytes, not 10000"), "{told}");
    assert!(refusal.to_string().len() < 10_000, "the text came back");
    assert_eq!(session.step(observe())["observation"]["step_number"], 2);
    assert_eq!(neighbour.step(observe())["observation"]["step_number"], 2);
}

#[test]
fn one_session_too_many_is_refused_with_the_numbers_and_the_others_go_on() {
    let site = Site::without_renderer();
    let mut sessions: Vec<Session> = (0..SESSIONS_MAX).map(|_| site.session()).collect();
    for session in &mut sessions {
        session.reset(trolley());
    }
    let mut excess = site.session();
    let refusal = excess.read();
    let message = "Server at capacity: 256/256 sessions active. Cannot accept new connections.";
    assert_eq!(
        refusal,
        json!({"type": "error", "data": {
            "message": message,
            "code": "CAPACITY_REACHED",
            "active_sessions": 256,
            "max_sessions": 256,
        }})
    );
    assert!(excess.try_read().is_err(), "the refused connection stays open");
    for session in &mut sessions {
        session.step(observe());
    }
    drop(sessions.pop());
    eventually("free place", SOON, || {
        let answer = site.session().ask(&json!({"type": "reset", "data": trolley()}));
        if answer["type"] == "observation" { Ok(()) } else { Err(answer) }
    });
}
