//! A street of a town with cars and people, and who looks at it.

#![allow(dead_code, reason = "each example uses a part of it")]

use std::f32::consts::{FRAC_PI_2, PI};

use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, ImageEncoding, ImageKind, MapRef, Pose, Tick,
    UnitQuaternion, Vec3, Weather, WorldId, level_pose,
};

/// Id of the car that carries the camera.
const EGO: u32 = 50;

/// Metres ahead and left of the ego car, heading, blueprint, half size of the box, paint.
type Car = (f32, f32, f32, &'static str, [f32; 3], u32);

const CARS: [Car; 7] = [
    (14.0, 0.0, 0.0, "vehicle.tesla.model3", [2.4, 1.0, 0.74], 0xb01818),
    (26.0, 3.5, 0.0, "vehicle.nissan.patrol", [2.3, 0.96, 0.92], 0x2a4d80),
    (9.0, 7.0, PI, "vehicle.mini.cooper_s", [1.9, 0.98, 0.74], 0xe0b020),
    (34.0, 7.0, PI, "vehicle.mercedes.sprinter", [2.96, 1.0, 1.28], 0xe8e8e8),
    (50.0, 0.0, 0.0, "vehicle.mitsubishi.fusorosa", [5.1, 1.31, 1.6], 0xd0d4d8),
    (20.0, -0.2, 0.0, "vehicle.kawasaki.ninja", [1.02, 0.4, 0.75], 0x1c8a3a),
    (60.0, 3.5, 0.0, "vehicle.carlamotors.carlacola", [2.6, 1.3, 1.23], 0xc02020),
];

/// One of every class: blueprint, half size of the box, paint.
const PARADE: [(&str, [f32; 3], u32); 24] = [
    ("vehicle.lincoln.mkz_2020", [2.46, 0.93, 0.74], 0x7a1f2b),
    ("vehicle.audi.tt", [2.09, 0.99, 0.69], 0xc8c8cc),
    ("vehicle.mini.cooper_s_2021", [2.28, 1.05, 0.88], 0x1f5c3a),
    ("vehicle.micro.microlino", [1.1, 0.74, 0.69], 0xe0d040),
    ("vehicle.jeep.wrangler_rubicon", [1.93, 0.95, 0.94], 0x3a4a2a),
    ("vehicle.tesla.cybertruck", [3.13, 1.2, 1.04], 0xa8acb0),
    ("vehicle.dodge.charger_police", [2.49, 1.02, 0.77], 0xe8e8e8),
    ("vehicle.ford.crown", [2.68, 0.9, 0.79], 0xd8b020),
    ("vehicle.ford.ambulance", [3.18, 1.18, 1.22], 0xf0f0f0),
    ("vehicle.volkswagen.t2", [2.24, 1.03, 1.02], 0x3a70a0),
    ("vehicle.carlamotors.firetruck", [4.23, 1.45, 1.91], 0xb01010),
    ("vehicle.carlamotors.european_hgv", [3.97, 1.45, 1.73], 0x2a4d80),
    ("vehicle.mitsubishi.fusorosa", [5.14, 1.97, 2.13], 0xd0d4d8),
    ("vehicle.harley-davidson.low_rider", [1.18, 0.38, 0.65], 0x101018),
    ("vehicle.bh.crossbike", [0.74, 0.43, 0.75], 0xc02020),
    ("vehicle.vespa.zx125", [0.91, 0.43, 0.75], 0x60a0a0),
    ("static.prop.trafficcone01", [0.2, 0.2, 0.4], 0),
    ("static.prop.streetbarrier", [0.2, 0.8, 0.5], 0),
    ("static.prop.barrel", [0.3, 0.3, 0.45], 0),
    ("static.prop.bench01", [0.3, 0.9, 0.45], 0),
    ("static.prop.busstop", [1.0, 2.0, 1.3], 0),
    ("static.prop.trafficwarning", [0.3, 0.8, 0.9], 0),
    ("static.prop.box01", [0.3, 0.3, 0.3], 0),
    ("static.prop.trashcan01", [0.3, 0.3, 0.5], 0),
];

pub(crate) fn weather_of(name: &str) -> Weather {
    let noon = Weather { sun_azimuth_rad: 0.9, ..Weather::CLEAR_NOON };
    match name {
        "rain" => Weather {
            cloudiness_percent: 90.0,
            precipitation_percent: 60.0,
            wetness_percent: 80.0,
            ..noon
        },
        "sunset" => Weather { sun_altitude_rad: 0.12, cloudiness_percent: 20.0, ..noon },
        "night" => Weather { sun_altitude_rad: -0.8, ..noon },
        "rainy night" => Weather {
            sun_altitude_rad: -0.8,
            cloudiness_percent: 90.0,
            precipitation_percent: 40.0,
            wetness_percent: 90.0,
            ..noon
        },
        "fog" => Weather { fog_density_percent: 60.0, cloudiness_percent: 60.0, ..noon },
        "dust" => Weather { dust_storm_percent: 80.0, ..noon },
        _ => noon,
    }
}

pub(crate) fn camera(view: &str, kind: ImageKind) -> Camera {
    let down = |angle_rad: f32| UnitQuaternion::from_euler_angles(0.0, angle_rad, 0.0);
    let carrier_from_camera = match view {
        "side" => level_pose(Vec3::new(9.0, -3.2, 1.3), 0.75),
        "parade" => Pose::from_parts(Vec3::new(2.0, 0.0, 7.0).into(), down(0.42)),
        "above" => Pose::from_parts(Vec3::new(-8.0, 2.0, 9.0).into(), down(0.35)),
        "high" => Pose::from_parts(Vec3::new(-80.0, 0.0, 90.0).into(), down(0.6)),
        _ => level_pose(Vec3::new(2.5, 0.0, 1.5), 0.0),
    };
    let (width_px, height_px) = if view == "large" { (1920, 1080) } else { (640, 360) };
    Camera {
        id: 1,
        carrier: ActorId::new(EGO),
        carrier_from_camera,
        width_px,
        height_px,
        horizontal_fov_rad: FRAC_PI_2,
        kind,
        encoding: kind.encodings().first().copied().unwrap_or(ImageEncoding::Jpeg),
        jpeg_quality: 92,
        ignored: Vec::new(),
        quality: None,
        exposure: schemas::Exposure::PLAIN,
    }
}

/// How far a spawn point is above its road, in metres.
const DROP_M: f32 = 0.5;

/// Cars and people around an ego car on the road below the spawn point `start`; the cars have their
/// lights on by night.
pub(crate) fn street(map: &roads::Map, start: Pose, weather: Weather, parade: bool) -> Frame {
    let start = start * level_pose(Vec3::new(0.0, 0.0, -DROP_M), 0.0);
    let map = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
    let mut frame = Frame {
        tick: Tick(33),
        sim_secs: 1.0,
        weather,
        ..Frame::empty(WorldId::new(1).expect("not zero"), map)
    };
    let ego = (start, [2.4, 1.0, 0.74], 0x303030);
    let place = |ahead_m: f32, left_m: f32, z_m: f32, turn_rad: f32| {
        start * level_pose(Vec3::new(ahead_m, left_m, z_m), turn_rad)
    };
    if parade {
        for (at, (type_id, half_m, colour)) in PARADE.into_iter().enumerate() {
            let (row, column) = (at / 8, at % 8);
            let pose = place(9.0 + 8.0 * row as f32, 14.0 - 4.0 * column as f32, 0.0, 2.4);
            let kind =
                if type_id.starts_with("static") { ActorKind::Prop } else { ActorKind::Vehicle };
            push(&mut frame, at as u32 + 1, kind, type_id, (pose, half_m, colour));
        }
        push(&mut frame, EGO, ActorKind::Vehicle, "vehicle.tesla.model3", ego);
        switch_lights(&mut frame);
        return frame;
    }
    for (at, (ahead_m, left_m, turn_rad, type_id, half_m, colour)) in CARS.into_iter().enumerate() {
        let pose = place(ahead_m, left_m, 0.0, turn_rad);
        push(&mut frame, at as u32 + 1, ActorKind::Vehicle, type_id, (pose, half_m, colour));
    }
    push(&mut frame, EGO, ActorKind::Vehicle, "vehicle.tesla.model3", ego);
    for at in 0..9u32 {
        let pose =
            place(6.0 + 4.5 * at as f32, -2.8 - 0.3 * (at % 3) as f32, 1.08, 0.4 * at as f32);
        let person = (pose, [0.19, 0.19, 0.93], 0);
        push(&mut frame, 100 + at, ActorKind::Walker, "walker.pedestrian.0001", person);
        if let Some(actor) = frame.actors.last_mut() {
            let speed_mps = if at % 3 == 0 { 0.0 } else { 1.3 };
            actor.linear_velocity_mps = pose.rotation * Vec3::new(speed_mps, 0.0, 0.0);
        }
    }
    switch_lights(&mut frame);
    frame
}

/// Low beams while the sun is low or down; one car brakes, another one blinks.
fn switch_lights(frame: &mut Frame) {
    const LOW_BEAM: u32 = 1 | 1 << 1;
    const BRAKE: u32 = 1 << 3;
    const LEFT_BLINKER: u32 = 1 << 5;
    if frame.weather.sun_altitude_rad > 0.15 {
        return;
    }
    let vehicles = frame.actors.iter_mut().filter(|actor| actor.kind == ActorKind::Vehicle);
    for (at, vehicle) in vehicles.enumerate() {
        vehicle.lights = LOW_BEAM
            | match at {
                0 => BRAKE,
                1 => LEFT_BLINKER,
                _ => 0,
            };
    }
}

fn push(
    frame: &mut Frame,
    id: u32,
    kind: ActorKind,
    type_id: &str,
    (world_from_actor, half_m, colour_rgb): (Pose, [f32; 3], u32),
) {
    frame.types.push(type_id.to_owned());
    let half = Vec3::from(half_m);
    let lift_m = if kind == ActorKind::Walker { 0.0 } else { half.z };
    frame.actors.push(ActorState {
        gear: 1,
        box_centre_m: Vec3::new(0.0, 0.0, lift_m),
        box_half_extent_m: half,
        road_wheel_rad: 0.2,
        colour_rgb,
        ..ActorState::at_rest(
            ActorId::new(id).expect("not zero"),
            kind,
            frame.types.len() as u16 - 1,
            world_from_actor,
        )
    });
}
