use std::time::Duration;

use schemas::{ActorId, ActorState, ImageEncoding, ImageKind, MapRef, Pose, WorldId};

use super::*;

/// What a file of tenants with these lines allows alice.
fn allowance(lines: &str) -> Allowance {
    let name = format!("causeway-allowance-{}-{}", std::process::id(), lines.len());
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, format!("[tenant.alice]\n{lines}\n")).unwrap();
    let door = Arc::new(Door::with_tokens(&path).unwrap());
    std::fs::remove_file(path).unwrap();
    Allowance::new(door, "alice".parse().unwrap(), QuotaFigures::default())
}

/// A world with two lights of the map, a spectator, a car and a camera.
fn frame() -> Frame {
    let types = ["traffic.traffic_light", "spectator", "vehicle.tesla.model3", "sensor.camera.rgb"];
    let kinds = [ActorKind::TrafficLight, ActorKind::Marker, ActorKind::Vehicle, ActorKind::Sensor];
    let state = |(at, index): (usize, usize)| {
        let id = ActorId::new(at as u32 + 1).unwrap();
        ActorState::at_rest(id, kinds[index], index as u16, Pose::identity())
    };
    let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
    Frame {
        types: types.map(str::to_owned).to_vec(),
        actors: [0, 0, 1, 2, 3].into_iter().enumerate().map(state).collect(),
        ..Frame::empty(WorldId::new(1).unwrap(), map)
    }
}

fn camera() -> Camera {
    Camera {
        id: 0,
        carrier: None,
        carrier_from_camera: Pose::identity(),
        width_px: 100,
        height_px: 10,
        horizontal_fov_rad: 1.0,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        jpeg_quality: 90,
        quality: None,
        ignored: Vec::new(),
        exposure: schemas::Exposure::PLAIN,
    }
}

#[test]
fn actors_of_clients_are_counted_and_not_those_of_the_map() {
    let mut room = allowance("actors_per_world = 4").room(&frame());
    assert!(room.take("vehicle.tesla.model3").is_ok() && room.take("static.prop.box01").is_ok());
    let refusal = room.take("vehicle.tesla.model3").unwrap_err().0;
    for word in ["found 4 actors", "actors_per_world = 4", "alice", "destroy some"] {
        assert!(refusal.contains(word), "{refusal}");
    }
}

#[test]
fn cameras_are_counted_apart() {
    let mut room = allowance("cameras_per_world = 2").room(&frame());
    assert!(room.take("sensor.camera.depth").is_ok());
    let refusal = room.take("sensor.camera.rgb").unwrap_err().0;
    assert!(refusal.contains("found 2 cameras") && refusal.contains("cameras_per_world = 2"));
    assert!(room.take("sensor.lidar.ray_cast").is_ok());
}

#[test]
fn an_open_door_allows_everything() {
    let allowance = Allowance::open("local".parse().unwrap());
    let mut room = allowance.room(&frame());
    assert!((0..100_000).all(|_| room.take("sensor.camera.rgb").is_ok()));
    assert_eq!(allowance.recording_bytes(u64::MAX).unwrap(), u64::MAX);
}

#[tokio::test]
async fn who_waits_for_pictures_gets_them_later_and_who_does_not_goes_without() {
    // Two seconds of it come at once: four pictures.
    let allowance = allowance("pixels_per_second = 2000");
    for _ in 0..4 {
        assert!(allowance.may_draw(&[camera()], false).await);
    }
    assert!(!allowance.may_draw(&[camera()], false).await);
    let begun = Instant::now();
    assert!(allowance.may_draw(&[camera()], true).await);
    let waited = begun.elapsed();
    assert!((Duration::from_millis(300)..Duration::from_secs(5)).contains(&waited), "{waited:?}");
}

#[test]
fn recordings_may_fill_the_folder_and_no_more() {
    let allowance = allowance("recordings_mib = 1");
    assert_eq!(allowance.recording_bytes(0).unwrap(), 1 << 20);
    assert_eq!(allowance.recording_bytes((1 << 20) - 1).unwrap(), 1);
    let refusal = allowance.recording_bytes(1 << 20).unwrap_err().0;
    assert!(refusal.contains("recordings_mib = 1") && refusal.contains("remove some"), "{refusal}");
}
