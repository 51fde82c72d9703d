//! How many bytes a frame takes: what CARLA 0.9.16 writes, and what docs/recorder.md reckons with.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use recording::{
    Additional, Box3, FrameContent, Kinematics, LightState, Long, Position, VehicleControl,
    VehicleLights, WheelPose, Wheels,
};

use common::log_of;

fn cars(count: u32) -> FrameContent {
    let wheels = |id| {
        let wheel = |wheel| WheelPose { wheel, ..WheelPose::default() };
        Wheels { id, wheels: Long((0..4).map(wheel).collect()) }
    };
    FrameContent {
        positions: (0..count).map(|id| Position { id, ..Position::default() }).collect(),
        vehicle_controls: (0..count)
            .map(|id| VehicleControl { id, ..VehicleControl::default() })
            .collect(),
        vehicle_lights: (0..count).map(|id| VehicleLights { id, flags: 0 }).collect(),
        wheels: (0..count).map(wheels).collect(),
        ..FrameContent::default()
    }
}

/// Bytes of a frame, without the head of the log.
fn bytes(frame: FrameContent) -> usize {
    log_of([frame]).len() - log_of([]).len()
}

#[test]
fn a_frame_has_131_bytes_a_car_101_and_a_light_10() {
    let light_states = (0..50).map(|id| LightState { id, ..LightState::default() }).collect();
    assert_eq!(bytes(FrameContent::default()), 131);
    assert_eq!(bytes(cars(100)), 131 + 100 * 101);
    assert_eq!(bytes(FrameContent { light_states, ..cars(100) }), 131 + 100 * 101 + 50 * 10);
}

#[test]
fn additional_data_take_34_bytes_and_28_for_each_car() {
    let kinematics = |count| (0..count).map(|id| Kinematics { id, ..Kinematics::default() });
    let with = |count| FrameContent {
        additional: Some(Additional {
            kinematics: kinematics(count).collect(),
            ..Additional::default()
        }),
        ..cars(count)
    };
    assert_eq!(bytes(with(100)), bytes(cars(100)) + 34 + 100 * 28);
    let new = Additional { bounding_boxes: vec![Box3::default(); 100], ..Additional::default() };
    let first = FrameContent { additional: Some(new), ..cars(100) };
    assert_eq!(bytes(first), bytes(cars(100)) + 34 - 7 + 100 * 28);
}
