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
fn an_open_door_allows_everything_that_a_server_can_draw() {
    let allowance = Allowance::open("local".parse().unwrap());
    let mut room = allowance.room(&frame());
    assert!((0..100_000).all(|_| room.take("vehicle.tesla.model3").is_ok()));
    // One is there.
    assert!((1..1_024).all(|_| room.take("sensor.camera.rgb").is_ok()));
    let refusal = room.take("sensor.camera.rgb").unwrap_err().0;
    assert!(
        refusal.contains("found 1024 cameras") && refusal.contains("destroy some"),
        "{refusal}"
    );
    assert!(room.take("sensor.lidar.ray_cast").is_ok());
}

#[tokio::test]
async fn who_waits_for_pictures_gets_them_later_and_who_does_not_goes_without() {
    // Two seconds of it come at once: four pictures.
    let allowance = allowance("pixels_per_second = 2000");
    for _ in 0..4 {
        assert!(allowance.may_draw([&camera()].into_iter(), false).await);
    }
    assert!(!allowance.may_draw([&camera()].into_iter(), false).await);
    let begun = Instant::now();
    assert!(allowance.may_draw([&camera()].into_iter(), true).await);
    let waited = begun.elapsed();
    assert!((Duration::from_millis(300)..Duration::from_secs(5)).contains(&waited), "{waited:?}");
}

#[tokio::test]
async fn a_large_picture_is_not_held_up_by_small_ones_that_come_later() {
    let allowance = allowance("pixels_per_second = 2000");
    let (large, small) = (camera(), Camera { height_px: 1, ..camera() });
    for _ in 0..4 {
        assert!(allowance.may_draw([&large].into_iter(), false).await);
    }
    let waiting = tokio::spawn({
        let allowance = allowance.clone();
        async move { allowance.may_draw([&large].into_iter(), true).await }
    });
    let begun = Instant::now();
    while !waiting.is_finished() {
        assert!(begun.elapsed() < Duration::from_secs(10), "it waits for ever");
        allowance.may_draw([&small].into_iter(), false).await;
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
}

/// A folder that goes away with the test.
struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("causeway-allowance-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(folder.join("runs/7")).unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, bytes: usize) {
        std::fs::write(self.0.join(name), vec![0; bytes]).unwrap();
    }

    async fn begin(&self, allowance: &Allowance, name: &str) -> Result<Growing, String> {
        let begun = allowance.recording(&self.0, &self.0.join(name)).await;
        begun.map_err(|refusal| refusal.0)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const MIB: usize = 1 << 20;

#[tokio::test]
async fn recordings_may_fill_the_folder_and_no_more() {
    let (allowance, folder) = (allowance("recordings_mib = 1"), Folder::new("fill"));
    folder.write("runs/7/old.log", MIB - 100);
    let growing = folder.begin(&allowance, "new.log").await.unwrap();
    assert!(growing.take(90) && !growing.take(11) && growing.take(10));
    growing.give_back(10);
    assert!(growing.take(10));
    let refusal = folder.begin(&allowance, "other.log").await.err().unwrap();
    assert!(refusal.contains("recordings_mib = 1") && refusal.contains("remove some"), "{refusal}");
    std::fs::remove_file(folder.0.join("runs/7/old.log")).unwrap();
    assert!(folder.begin(&allowance, "other.log").await.is_ok());
}

#[tokio::test]
async fn recordings_at_the_same_time_share_what_is_left() {
    let (allowance, folder) = (allowance("recordings_mib = 1"), Folder::new("share"));
    let first = folder.begin(&allowance, "first.log").await.unwrap();
    // Bytes of files that are being written are known, and not looked up.
    folder.write("first.log", 600);
    assert!(first.take(600));
    let second = folder.begin(&allowance, "second.log").await.unwrap();
    assert!(second.take(MIB as u64 - 700) && first.take(100) && !second.take(1));
    drop(first);
    assert!(!second.take(1), "what has ended is there still");
}

#[tokio::test]
async fn a_recording_has_the_room_of_the_one_that_it_replaces() {
    let (allowance, folder) = (allowance("recordings_mib = 1"), Folder::new("replace"));
    folder.write("a.log", MIB);
    let mut again = folder.begin(&allowance, "a.log").await.unwrap();
    assert!(!again.take(1), "it is there still");
    again.replace();
    assert!(again.take(MIB as u64));
}
