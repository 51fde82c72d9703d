//! Draws a street of a town into `picture.jpg`: `cargo run --release --example picture -- Town10HD_Opt`.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use render_service::{AdapterChoice, Renderer, TownScene};
use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, ImageEncoding, ImageKind, MapRef, Pose,
    RenderJob, Tick, Vec3, VehicleControl, Weather, WorldId, level_pose,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "Town10HD_Opt".to_owned());
    let out = args.next().unwrap_or_else(|| "picture.jpg".to_owned());
    let spawn: usize = args.next().map_or(Ok(0), |text| text.parse())?;
    let weather = args.next().unwrap_or_default();
    let mode = args.next().unwrap_or_default();
    let begin = Instant::now();
    let text = roads::town::build(&name).ok_or("no such town")?;
    let map = roads::Map::parse(&name, &text)?;
    eprintln!("map {:?}", begin.elapsed());
    let begin = Instant::now();
    let town = Arc::new(TownScene::of_map(&map));
    eprintln!("scene {:?}, {} triangles", begin.elapsed(), town.triangle_count());
    let begin = Instant::now();
    let mut renderer = Renderer::new(AdapterChoice::Best)?;
    eprintln!("{} after {:?}", renderer.adapter_name(), begin.elapsed());

    let start = map.spawn_points().get(spawn).ok_or("no such spawn point")?.cast::<f32>();
    let place = |ahead: f32, left: f32, turn: f32| {
        let z = if left.abs() > 5.0 { 0.15 } else { 0.0 };
        start * level_pose(Vec3::new(ahead, left, z), turn)
    };
    let mut frame = empty_frame(&name, town.digest());
    let cars = [
        (14.0, 0.0, 0.0, "vehicle.tesla.model3", [2.4, 1.0, 0.74], 0xb01818),
        (26.0, 3.5, 0.0, "vehicle.nissan.patrol", [2.3, 0.96, 0.92], 0x2a4d80),
        (9.0, 7.0, std::f32::consts::PI, "vehicle.mini.cooper_s", [1.9, 0.98, 0.74], 0xe0b020),
        (34.0, 7.0, std::f32::consts::PI, "vehicle.mercedes.sprinter", [2.96, 1.0, 1.28], 0xe8e8e8),
        (50.0, 0.0, 0.0, "vehicle.mitsubishi.fusorosa", [5.1, 1.97 / 1.5, 1.6], 0xd0d4d8),
        (20.0, -0.2, 0.0, "vehicle.kawasaki.ninja", [1.02, 0.4, 0.75], 0x1c8a3a),
        (60.0, 3.5, 0.0, "vehicle.carlamotors.carlacola", [2.6, 1.3, 1.23], 0xc02020),
    ];
    for (at, (ahead, left, turn, type_id, half, colour)) in cars.into_iter().enumerate() {
        push(
            &mut frame,
            at as u32 + 1,
            ActorKind::Vehicle,
            type_id,
            place(ahead, left, turn),
            half,
            colour,
        );
    }
    for at in 0..9u32 {
        let pose = place(6.0 + 4.5 * at as f32, -2.8 - 0.3 * (at % 3) as f32, 0.4 * at as f32);
        let pose = Pose::from_parts(
            (pose.translation.vector + Vec3::new(0.0, 0.0, 0.93)).into(),
            pose.rotation,
        );
        push(
            &mut frame,
            100 + at,
            ActorKind::Walker,
            "walker.pedestrian.0001",
            pose,
            [0.19, 0.19, 0.93],
            0,
        );
        if let Some(actor) = frame.actors.last_mut() {
            actor.linear_velocity_mps =
                pose.rotation * Vec3::new(if at % 3 == 0 { 0.0 } else { 1.3 }, 0.0, 0.0);
        }
    }
    let ego = 50;
    push(
        &mut frame,
        ego,
        ActorKind::Vehicle,
        "vehicle.tesla.model3",
        place(0.0, 0.0, 0.0),
        [2.4, 1.0, 0.74],
        0x303030,
    );
    frame.actors.sort_by_key(|actor| actor.id);
    frame.weather = match weather.as_str() {
        "rain" => Weather {
            cloudiness_percent: 90.0,
            precipitation_percent: 60.0,
            wetness_percent: 80.0,
            ..Weather::CLEAR_NOON
        },
        "sunset" => Weather {
            sun_altitude_rad: 0.12,
            cloudiness_percent: 20.0,
            sun_azimuth_rad: 0.7,
            ..Weather::CLEAR_NOON
        },
        "night" => Weather { sun_altitude_rad: -0.8, ..Weather::CLEAR_NOON },
        "fog" => {
            Weather { fog_density_percent: 60.0, cloudiness_percent: 60.0, ..Weather::CLEAR_NOON }
        }
        _ => Weather { sun_azimuth_rad: 0.9, ..Weather::CLEAR_NOON },
    };
    let carrier_from_camera = match mode.as_str() {
        "side" => level_pose(Vec3::new(9.0, -3.2, 1.3), 0.75),
        "above" => Pose::from_parts(
            Vec3::new(-8.0, 2.0, 9.0).into(),
            schemas::UnitQuaternion::from_euler_angles(0.0, 0.35, 0.0),
        ),
        "high" => Pose::from_parts(
            Vec3::new(-80.0, 0.0, 90.0).into(),
            schemas::UnitQuaternion::from_euler_angles(0.0, 0.6, 0.0),
        ),
        _ => level_pose(Vec3::new(2.5, 0.0, 1.0), 0.0),
    };
    let (width_px, height_px) = if mode == "large" { (1920, 1080) } else { (640, 360) };
    let camera = Camera {
        id: 1,
        carrier: ActorId::new(ego),
        carrier_from_camera,
        width_px,
        height_px,
        horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Jpeg,
        jpeg_quality: 92,
    };
    let job = RenderJob { tenant: "local".parse()?, frame, cameras: vec![camera] };
    for _ in 0..6 {
        let begin = Instant::now();
        let images = renderer.render(&[(Arc::clone(&town), &job)]).remove(0)?;
        eprintln!("picture {:?}", begin.elapsed());
        let image = &images.images[0];
        std::fs::write(&out, &image.data)?;
    }
    Ok(())
}

fn push(
    frame: &mut Frame,
    id: u32,
    kind: ActorKind,
    type_id: &str,
    pose: Pose,
    half: [f32; 3],
    colour_rgb: u32,
) {
    frame.types.push(type_id.to_owned());
    let half = Vec3::from(half);
    let Some(id) = ActorId::new(id) else { return };
    frame.actors.push(ActorState {
        id,
        kind,
        gear: 1,
        type_index: frame.types.len() as u16 - 1,
        world_from_actor: pose,
        linear_velocity_mps: Vec3::zeros(),
        angular_velocity_radps: Vec3::zeros(),
        linear_acceleration_mps2: Vec3::zeros(),
        box_centre_m: if kind == ActorKind::Vehicle {
            Vec3::new(0.0, 0.0, half.z)
        } else {
            Vec3::zeros()
        },
        box_half_extent_m: half,
        control: VehicleControl::default(),
        road_wheel_rad: 0.2,
        colour_rgb,
    });
}

fn empty_frame(name: &str, digest: &str) -> Frame {
    Frame {
        world: WorldId::new(1).expect("not zero"),
        tick: Tick(33),
        epoch: 1,
        dt_secs: 0.05,
        state_hash: 7,
        seed: 0,
        map: MapRef { name: name.to_owned(), digest: digest.to_owned() },
        weather: Weather::CLEAR_NOON,
        types: Vec::new(),
        actors: Vec::new(),
        collisions: Vec::new(),
    }
}
