//! Services of two versions understand each other: later fields are left out or not known.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod sample;

use schemas::{ErrorCode, Frame, wire};

/// What `Frame` had when its first field that may be absent came.
const FIRST_FIELDS: usize = 13;

/// The message as if its root table had so many fields: those beyond are not written, or are some
/// that this version does not know. By FlatBuffers' own layout.
fn with_fields(message: &[u8], count: usize) -> Vec<u8> {
    let short = |at: usize| u16::from_le_bytes([message[at], message[at + 1]]);
    let long = |at: usize| i32::from_le_bytes(message[at..at + 4].try_into().unwrap());
    let table = usize::try_from(long(0)).unwrap();
    let fields = table.checked_add_signed(-long(table) as isize).unwrap();
    let known = usize::from(short(fields)) / 2 - 2;
    let mut bytes = message.to_vec();
    bytes.resize(message.len().next_multiple_of(4), 0);
    let begin = i32::try_from(bytes.len()).unwrap();
    let place = |field: usize| if field < known { short(fields + 4 + 2 * field) } else { 4 };
    let size = u16::try_from(4 + 2 * count).unwrap();
    for entry in [size, short(fields + 2)].into_iter().chain((0..count).map(place)) {
        bytes.extend(entry.to_le_bytes());
    }
    let back = i32::try_from(table).unwrap() - begin;
    bytes[table..table + 4].copy_from_slice(&back.to_le_bytes());
    bytes
}

#[test]
fn what_a_newer_service_adds_is_not_looked_at() {
    let frame = sample::frame();
    let newer = with_fields(&wire::encode_frame(&frame).0, 40);
    assert_eq!(wire::decode_frame(&newer).unwrap(), frame);
    for request in sample::requests() {
        let newer = with_fields(&wire::encode_request(&request), 40);
        assert_eq!(wire::decode_request(&newer).unwrap(), request);
    }
    for reply in sample::replies() {
        let newer = with_fields(&wire::encode_reply(&reply), 40);
        assert_eq!(wire::decode_reply(&newer).unwrap(), reply);
    }
    let job = sample::render_job();
    let newer = with_fields(&wire::encode_render_job(&job), 40);
    assert_eq!(wire::decode_render_job(&newer).unwrap(), job);
    let alive = sample::alive();
    let newer = with_fields(&wire::encode_alive(&alive), 40);
    assert_eq!(wire::decode_alive(&newer).unwrap(), alive);
}

#[test]
fn what_an_older_service_does_not_write_is_absent() {
    let frame = sample::frame();
    let older = with_fields(&wire::encode_frame(&frame).0, FIRST_FIELDS);
    let wanted = Frame {
        agents: Vec::new(),
        hidden: schemas::HiddenScenery::default(),
        halted: Vec::new(),
        rules_broken: Vec::new(),
        walker_poses: Vec::new(),
        paint: schemas::Paint::default(),
        ..frame.clone()
    };
    assert_ne!(wanted, frame);
    assert_eq!(wire::decode_frame(&older).unwrap(), wanted);
}

#[test]
fn a_frame_without_what_every_frame_has_is_refused() {
    let older = with_fields(&wire::encode_frame(&sample::frame()).0, FIRST_FIELDS - 2);
    assert_eq!(wire::decode_frame(&older).unwrap_err().code, ErrorCode::InvalidMessage);
}
