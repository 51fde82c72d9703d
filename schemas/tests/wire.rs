//! Every message survives the wire, and no bytes from outside can do harm.

mod sample;

use proptest::prelude::*;
use schemas::limits::{
    ATTRIBUTE_CHARS_MAX, FORKS_PER_REQUEST_MAX, REQUEST_BYTES_MAX, TICKS_PER_REQUEST_MAX,
    V2X_TEXT_BYTES_MAX,
};
use schemas::{
    ActorId, Attribute, Command, ErrorCode, Load, Pose, Request, SensorCommand, TickItem, Vec3,
    WalkerPose, WorldId, wire,
};

#[test]
fn a_frame_comes_back_bit_for_bit() {
    let frame = sample::frame();
    assert_eq!(wire::decode_frame(&wire::encode_frame(&frame).0).unwrap(), frame);
}

#[test]
fn a_frame_tells_what_is_hidden_and_grows_by_no_more() {
    let whole = sample::frame();
    let mut frame = sample::frame();
    frame.hidden.layers = 0x101;
    for place in [0, 77, 2_000] {
        frame.hidden.set(place, true);
    }
    let bytes = wire::encode_frame(&frame);
    assert_eq!(wire::decode_frame(&bytes.0).unwrap(), frame);
    let grown = bytes.0.len() - wire::encode_frame(&whole).0.len();
    assert!((251..=272).contains(&grown), "{grown}");
}

#[test]
fn a_coat_of_a_texture_that_the_frame_does_not_name_is_refused() {
    let mut frame = sample::frame();
    frame.paint.textures.pop();
    let refused = wire::decode_frame(&wire::encode_frame(&frame).0).unwrap_err();
    assert_eq!(refused.code, ErrorCode::InvalidMessage);
}

#[test]
fn every_request_comes_back() {
    for request in sample::requests() {
        assert_eq!(wire::decode_request(&wire::encode_request(&request)).unwrap(), request);
    }
}

#[test]
fn every_reply_comes_back() {
    for reply in sample::replies() {
        assert_eq!(wire::decode_reply(&wire::encode_reply(&reply)).unwrap(), reply);
    }
}

#[test]
fn a_render_job_and_a_liveliness_message_come_back() {
    let job = sample::render_job();
    assert_eq!(wire::decode_render_job(&wire::encode_render_job(&job)).unwrap(), job);
    let alive = sample::alive();
    assert_eq!(wire::decode_alive(&wire::encode_alive(&alive)).unwrap(), alive);
}

#[test]
fn a_load_comes_back_and_one_that_is_no_share_is_refused() {
    let load = Load { worlds: 3, worlds_max: 4_096, busy: 0.25 };
    assert_eq!(wire::decode_load(&wire::encode_load(&load)).unwrap(), load);
    for busy in [f32::NAN, -0.1, 1.1] {
        let refusal = wire::decode_load(&wire::encode_load(&Load { busy, ..load })).unwrap_err();
        assert_eq!(refusal.code, ErrorCode::InvalidMessage);
    }
}

/// Python decodes the same file: see `agents/python/tests`. After a deliberate change of the schema
/// write it anew with `UPDATE_GOLDEN=1 cargo nextest run --release -p schemas golden`.
#[test]
fn the_golden_frame_still_means_the_same() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../agents/python/tests/golden/frame.bin");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(path, wire::encode_frame(&sample::frame()).0).unwrap();
    }
    assert_eq!(wire::decode_frame(&std::fs::read(path).unwrap()).unwrap(), sample::frame());
}

#[test]
fn one_kind_of_message_is_not_taken_for_another() {
    let frame = wire::encode_frame(&sample::frame());
    let refusal = wire::decode_request(&frame.0).unwrap_err();
    assert_eq!(refusal.code, ErrorCode::InvalidMessage);
    assert!(refusal.to_string().contains("CWRQ"), "{refusal}");
    assert!(refusal.to_string().contains("CWFR"), "{refusal}");
}

#[test]
fn a_message_over_its_limit_is_refused_before_it_is_read() {
    let refusal = wire::decode_request(&vec![0; REQUEST_BYTES_MAX + 1]).unwrap_err();
    assert_eq!(refusal.code, ErrorCode::TooLarge);
}

#[test]
fn a_command_with_too_much_of_something_is_known_before_it_is_sent() {
    let sensor = ActorId::FIRST;
    for (length, fits) in [(V2X_TEXT_BYTES_MAX, true), (V2X_TEXT_BYTES_MAX + 1, false)] {
        let text = "x".repeat(length);
        let command = Command::Sensor(SensorCommand::SendV2x { sensor, text });
        assert_eq!(wire::check_command(&command).is_ok(), fits, "{length} bytes");
    }
    for (length, fits) in [(ATTRIBUTE_CHARS_MAX, true), (ATTRIBUTE_CHARS_MAX + 1, false)] {
        let value = "ä".repeat(length);
        let mut command = Command::spawn("vehicle.mini.cooper", Pose::identity(), Vec3::zeros());
        let Command::SpawnActor { attributes, .. } = &mut command else { unreachable!() };
        attributes.push(Attribute { id: "role_name".to_owned(), value });
        assert_eq!(wire::check_command(&command).is_ok(), fits, "{length} characters");
    }
}

#[test]
fn numbers_that_are_none_are_refused() {
    let mut frame = sample::frame();
    frame.actors[0].linear_velocity_mps.x = f32::NAN;
    let refusal = wire::decode_frame(&wire::encode_frame(&frame).0).unwrap_err();
    assert!(refusal.message.contains("linear velocity"), "{refusal}");
}

#[test]
fn a_pose_that_no_walker_can_have_is_refused() {
    let refusal = |spoil: fn(&mut WalkerPose)| {
        let mut frame = sample::frame();
        spoil(&mut frame.walker_poses[0]);
        wire::decode_frame(&wire::encode_frame(&frame).0).unwrap_err().to_string()
    };
    assert!(refusal(|pose| pose.bones[0].bone = 66).contains("0 to 65"));
    let place = |pose: &mut WalkerPose| pose.bones[0].parent_from_bone.translation.x = f32::NAN;
    assert!(refusal(place).contains("parent_from_bone"));
    assert!(refusal(|pose| pose.share = f32::NAN).contains("0 to 1"));
    assert!(refusal(|pose| pose.bones = vec![pose.bones[0]; 67]).contains("at most 66"));
}

proptest! {
    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..512)) {
        let _ = wire::decode_frame(&bytes);
        let _ = wire::decode_request(&bytes);
        let _ = wire::decode_reply(&bytes);
        let _ = wire::decode_render_job(&bytes);
        let _ = wire::decode_alive(&bytes);
        let _ = wire::decode_load(&bytes);
    }

    #[test]
    fn no_damaged_message_panics(at in 0usize..4096, value in any::<u8>(), cut in 0usize..4096) {
        let messages = sample::requests().iter().map(wire::encode_request)
            .chain(sample::replies().iter().map(wire::encode_reply))
            .chain([wire::encode_render_job(&sample::render_job())])
            .collect::<Vec<_>>();
        for mut bytes in messages {
            let at = at % bytes.len();
            bytes[at] = value;
            bytes.truncate(bytes.len() - cut % bytes.len());
            let _ = wire::decode_request(&bytes);
            let _ = wire::decode_reply(&bytes);
            let _ = wire::decode_render_job(&bytes);
        }
    }
}

#[test]
fn what_would_keep_a_service_busy_without_end_is_refused_with_the_limit() {
    let world = WorldId::new(7).unwrap();
    let ticks = |count| Request::TickWorlds(vec![TickItem::new(world, count)]);
    let copies = |count| Request::ForkWorld { world, count, lease: None };
    let most = (TICKS_PER_REQUEST_MAX, FORKS_PER_REQUEST_MAX);
    for request in [ticks(most.0), copies(most.1)] {
        assert_eq!(wire::decode_request(&wire::encode_request(&request)).unwrap(), request);
    }
    for (request, most) in [(ticks(most.0 + 1), "10000"), (copies(u32::MAX), "1024")] {
        let refusal = wire::decode_request(&wire::encode_request(&request)).unwrap_err();
        assert_eq!(refusal.code, ErrorCode::TooLarge);
        assert!(refusal.to_string().contains(&format!("at most {most}")), "{refusal}");
    }
}
