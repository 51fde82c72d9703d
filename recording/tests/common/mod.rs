//! Logs to be read: genuine ones, and one that has everything.
#![allow(dead_code, reason = "not every test reads all of them")]
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::path::{Path, PathBuf};

use recording::{
    Add, Additional, Attribute, Biker, Bone, Bones, Box3, Class, Collision, Destroy, Door,
    FrameContent, Gear, Header, Kinematics, LightState, LightTimes, Long, Parent, PhysicsControl,
    PhysicsWheel, Position, Rotation, SceneLight, Vector, VehicleControl, VehicleLights,
    WalkerSpeed, Weather, WheelPose, Wheels, Writer, attribute,
};

/// Logs that CARLA 0.9.13 wrote, by name; none, with a message, without the folder.
pub(crate) fn genuine() -> Vec<(String, Vec<u8>)> {
    let folder = std::env::var_os("CAUSEWAY_RECORDINGS_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings"),
        PathBuf::from,
    );
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: no recordings in {folder:?}; set CAUSEWAY_RECORDINGS_DIR");
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut logs: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|end| end == "log")).collect();
    logs.sort();
    let name = |path: &Path| path.file_stem().unwrap().to_string_lossy().into_owned();
    logs.iter().map(|path| (name(path), std::fs::read(path).unwrap())).collect()
}

pub(crate) fn header(map: &str) -> Header {
    Header { version: Header::VERSION, date: 1_700_000_000, map: map.to_owned() }
}

/// A log of these frames.
pub(crate) fn log_of(frames: impl IntoIterator<Item = FrameContent>) -> Vec<u8> {
    let mut writer = Writer::begin(Vec::new(), &header("Town01")).unwrap();
    for frame in frames {
        writer.frame(frame).unwrap();
    }
    writer.finish().unwrap()
}

/// Date as a text that does not depend on where the test runs.
pub(crate) fn date(secs: i64) -> String {
    format!("<{secs}>")
}

pub(crate) fn vector(x: f32, y: f32, z: f32) -> Vector {
    Vector { x, y, z }
}

pub(crate) fn add(id: u32, class: Class, blueprint: &str, at: Vector) -> Add {
    Add { id, class, blueprint: blueprint.to_owned(), location: at, ..Add::default() }
}

pub(crate) fn at(id: u32, x: f32) -> Position {
    Position { id, location: vector(x, 0.0, 0.0), rotation: Rotation::default() }
}

/// A car that is created with everything that can be said of it, and destroyed again.
pub(crate) fn everything() -> Vec<FrameContent> {
    let text = |kind, name: &str, value: &str| Attribute {
        kind,
        name: name.to_owned(),
        value: value.to_owned(),
    };
    let mut car = add(24, Class::VEHICLE, "vehicle.lincoln.mkz_2017", vector(100.5, -20.0, 30.0));
    car.uid = 26;
    car.attributes = vec![
        text(attribute::INT, "number_of_wheels", "4"),
        text(attribute::STRING, "object_type", ""),
        text(attribute::STRING, "role_name", "hero"),
    ];
    let spectator = add(1, Class::OTHER, "spectator", vector(-260.0, -200.0, 382.001));
    let walker = add(30, Class::WALKER, "walker.pedestrian.0001", vector(0.0, 5.0, 100.0));
    let first = first_frame(vec![spectator, car, walker]);
    let second = FrameContent {
        elapsed_secs: 0.05,
        collisions: vec![
            Collision { id1: 24, id2: 30, is_hero1: true, ..Collision::default() },
            Collision { serial: 1, id1: 24, id2: Collision::NO_ACTOR, ..Collision::default() },
        ],
        positions: vec![at(1, -260.0), at(24, 101.5), at(30, 0.0)],
        additional: Some(Additional { platform_secs: 0.06, ..Additional::default() }),
        ..FrameContent::default()
    };
    let third = FrameContent {
        elapsed_secs: 0.1,
        destroys: vec![Destroy { id: 24 }],
        additional: Some(Additional { platform_secs: 0.1, ..Additional::default() }),
        ..FrameContent::default()
    };
    vec![first, second, third]
}

fn first_frame(adds: Vec<Add>) -> FrameContent {
    FrameContent {
        adds,
        parents: vec![Parent { child: 30, parent: 24 }],
        doors: vec![Door { id: 24, door: 1, is_open: true }],
        positions: vec![at(1, -260.0), at(24, 100.5), at(30, 0.0)],
        light_states: vec![LightState { id: 7, is_frozen: true, elapsed_secs: 2.5, state: 2 }],
        vehicle_controls: vec![VehicleControl {
            id: 24,
            steer: -0.25,
            throttle: 0.75,
            gear: -1,
            ..VehicleControl::default()
        }],
        walker_speeds: vec![WalkerSpeed { id: 30, speed: 140.0 }],
        vehicle_lights: vec![
            VehicleLights { id: 24, flags: 1 | 2 | 128 | 256 },
            VehicleLights { id: 25, flags: 0 },
        ],
        scene_lights: vec![SceneLight {
            id: 3,
            intensity: 5000.0,
            colour: [1.0, 0.5, 0.25, 1.0],
            is_on: true,
            group: 2,
        }],
        wheels: vec![Wheels {
            id: 24,
            wheels: Long(vec![WheelPose { wheel: 0, steer_deg: 5.0, rotation_deg: 90.0 }]),
        }],
        bikers: vec![Biker { id: 25, speed: 500.0, engine: 0.5 }],
        weather: Some(Weather([15.0; 14])),
        additional: Some(additional()),
        ..FrameContent::default()
    }
}

fn additional() -> Additional {
    let wheel = PhysicsWheel {
        tire_friction: 3.5,
        damping_rate: 0.25,
        max_steer_angle: 70.0,
        radius: 35.5,
        max_brake_torque: 800.0,
        stiffness: [2.0, 17.0, 1000.0],
        position: [39_328.5, 19_647.8, 86.402_6],
        ..PhysicsWheel::default()
    };
    let physics = PhysicsControl {
        id: 24,
        max_rpm: 6500.0,
        moi: 1.0,
        damping_rate_full_throttle: 0.05,
        damping_rate_zero_throttle_clutch_engaged: 2.0,
        damping_rate_zero_throttle_clutch_disengaged: 0.35,
        use_gear_autobox: true,
        clutch_strength: 10.0,
        final_ratio: 3.21,
        mass: 1696.0,
        drag_coefficient: 0.3,
        center_of_mass: vector(0.6, 0.0, -0.3),
        torque_curve: Long(vec![[1000.0, 347.0], [1500.0, 523.0]]),
        forward_gears: Long(vec![Gear { ratio: 4.584, down_ratio: 0.23, up_ratio: 0.54 }]),
        steering_curve: Long(vec![[0.0, 1.0], [20.0, 0.9]]),
        wheels: Long(vec![wheel]),
    };
    Additional {
        kinematics: vec![Kinematics {
            id: 24,
            linear_velocity: vector(1.0, -2.0, 0.0),
            angular_velocity: vector(0.0, 0.0, 12.5),
        }],
        bounding_boxes: vec![Box3 {
            id: 1,
            origin: vector(-f32::NAN, f32::INFINITY, 0.0),
            ..Box3::default()
        }],
        trigger_volumes: vec![Box3 { id: 7, extent: vector(1.0, 2.0, 3.0), ..Box3::default() }],
        platform_secs: 0.0125,
        physics: vec![physics],
        light_times: vec![LightTimes { id: 7, green_secs: 10.0, yellow_secs: 3.0, red_secs: 2.0 }],
        bones: vec![Bones {
            id: 30,
            bones: vec![Bone {
                name: "crl_root".to_owned(),
                location: vector(1.0, 2.0, 3.0),
                rotation: Rotation { roll: 4.0, pitch: 5.0, yaw: 6.0 },
            }],
        }],
    }
}
