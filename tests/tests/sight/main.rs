//! Goal: rays meet what pictures show, on everything that can be put into a world.
//! Method: look at each thing from two sides with a depth picture, a picture of ids, and a ray
//! through the middle of every sixteenth pixel each way; compare where, what and whose.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod posed;

use std::sync::{Arc, LazyLock};

use blueprints::Class;
use nalgebra::Point3;
use render_service::{AdapterChoice, Renderer, TownScene};
use schemas::{
    ActorId, ActorState, Attribute, Camera, Command, Exposure, Frame, ImageKind, Measurement, Pose,
    PosedLimb, RenderJob, SemanticLidarPoint, SensorCommand, Staging, TagId, UnitQuaternion, Vec3,
    VehicleCommand, VehicleControl, WalkerCommand, WalkerControl, WorldId, level_pose,
};
use world::{Town, World, WorldConfig};

const ROAD: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="straight" version="1" north="0" south="0" east="0" west="0"/>
  <road name="main" length="400" id="1" junction="-1">
    <planView><geometry s="0" x="-200" y="0" hdg="0" length="400"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right>
        <lane id="-1" type="driving" level="false"><width sOffset="0" a="6" b="0" c="0" d="0"/></lane>
      </right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;

const SIDE_PX: u32 = 1_024;
/// Pixels from one ray to the next.
const STEP_PX: u32 = 16;
const FOV_RAD: f32 = 0.7;
/// How far a ray and its pixel may be apart along the view.
const NEAR_M: f32 = 0.02;
/// Of the rays at a thing.
const SHARE_MIN: f32 = 0.98;

struct Place {
    map: Arc<Town>,
    scene: Arc<TownScene>,
}

fn place() -> &'static Place {
    static PLACE: LazyLock<Place> = LazyLock::new(|| {
        let map = roads::Map::parse("straight", ROAD).unwrap();
        let scene = Arc::new(TownScene::of_map(&map));
        Place { map: Arc::new(Town::new(Arc::new(map))), scene }
    });
    &PLACE
}

fn world() -> World {
    let (id, map) = (WorldId::new(1).unwrap(), Arc::clone(&place().map));
    World::new(WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map }).unwrap()
}

/// Something in the middle of the lane, turned by a tenth of a turn; it moves as its kind does.
fn moving(blueprint: &str, class: Class) -> (World, ActorId) {
    let mut world = world();
    let up_m = if matches!(class, Class::Walker(_)) { 0.95 } else { 0.05 };
    let pose = level_pose(Vec3::new(0.0, -3.0, up_m), 0.6);
    let spawn = Command::spawn(blueprint, pose, Vec3::zeros());
    let actor = world.apply(&spawn).unwrap().unwrap();
    match class {
        Class::Vehicle(_) => {
            let control = VehicleControl { steer: 0.7, brake: 0.4, ..VehicleControl::default() };
            world.apply(&Command::Vehicle(VehicleCommand::Control { actor, control })).unwrap();
        }
        Class::Walker(_) => {
            let direction = Vec3::new(0.8, 0.6, 0.0);
            let control = WalkerControl { direction, speed_mps: 1.4, jump: false };
            world.apply(&Command::Walker(WalkerCommand::Control { actor, control })).unwrap();
        }
        _ => {}
    }
    for _ in 0..28 {
        world.tick().unwrap();
    }
    (world, actor)
}

/// A camera that looks at an actor so that it fills much of the picture.
fn camera_at(actor: &ActorState, yaw_rad: f32, down_rad: f32) -> Camera {
    let middle = actor.world_from_actor * Point3::from(actor.box_centre_m);
    let away_m = 1.2 * actor.box_half_extent_m.norm() / (FOV_RAD / 2.0).sin() + 0.3;
    let turn = UnitQuaternion::from_euler_angles(0.0, down_rad, yaw_rad);
    let eye_m = middle.coords - turn * Vec3::x() * away_m;
    camera_in(Pose::from_parts(eye_m.into(), turn))
}

fn camera_in(world_from_camera: Pose) -> Camera {
    Camera {
        id: 1,
        carrier: None,
        carrier_from_camera: world_from_camera,
        width_px: SIDE_PX,
        height_px: SIDE_PX,
        horizontal_fov_rad: FOV_RAD,
        kind: ImageKind::Depth,
        encoding: ImageKind::Depth.encodings()[0],
        jpeg_quality: 75,
        quality: None,
        ignored: Vec::new(),
        exposure: Exposure::PLAIN,
    }
}

/// Metres and labels of every pixel.
fn draw(renderer: &mut Renderer, frame: Frame, camera: &Camera) -> (Vec<f32>, Vec<TagId>) {
    let of_kind =
        |kind: ImageKind| Camera { kind, encoding: kind.encodings()[0], ..camera.clone() };
    let job = RenderJob {
        tenant: "local".parse().unwrap(),
        frame,
        cameras: vec![of_kind(ImageKind::Depth), of_kind(ImageKind::Instance)],
        staging: Staging::default(),
    };
    let drawn = renderer.render(&[(Arc::clone(&place().scene), &job)]).remove(0).unwrap();
    let [depth, labels] = drawn.images.try_into().unwrap();
    let (depth, _) = depth.data.as_chunks::<4>();
    let (labels, _) = labels.data.as_chunks::<4>();
    (
        depth.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(),
        labels.iter().map(|bytes| TagId::unpack(*bytes)).collect(),
    )
}

#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Rays of which the picture or the ray itself says that they meet the thing.
    at_it: f32,
    /// Those that agree how far it is.
    near: f32,
    /// Those that agree what it is.
    same: f32,
}

fn compare(renderer: &mut Renderer, world: &World, actor: ActorId, camera: &Camera) -> Tally {
    let (depth_m, labels) = draw(renderer, world.frame(), camera);
    let pose = camera.carrier_from_camera;
    let half = (FOV_RAD / 2.0).tan();
    let place_of = |pixel: u32| half * (1.0 - 2.0 * (pixel as f32 + 0.5) / SIDE_PX as f32);
    let steps = || (STEP_PX / 2..SIDE_PX).step_by(STEP_PX as usize);
    let mut tally = Tally::default();
    for (row, column) in steps().flat_map(|row| steps().map(move |column| (row, column))) {
        let along = Vec3::new(1.0, place_of(column), place_of(row));
        let eye_m = pose.translation.vector;
        let hit = world.project_point(eye_m, pose.rotation * along, 200.0).unwrap();
        let at = (row * SIDE_PX + column) as usize;
        let (pixel_m, label) = (depth_m[at], labels[at]);
        let is_drawn = label.id == actor.get();
        let is_met = hit.is_some_and(|hit| hit.actor == Some(actor));
        if !is_drawn && !is_met {
            continue;
        }
        tally.at_it += 1.0;
        let Some(hit) = hit else { continue };
        let ray_m = pose.inverse_transform_point(&Point3::from(hit.position_m)).x;
        tally.near += f32::from(u8::from((ray_m - pixel_m).abs() <= NEAR_M));
        let tag = label.tag.map(schemas::SemanticTag::number);
        tally.same += f32::from(u8::from(is_drawn && is_met && tag == Some(hit.tag)));
    }
    tally
}

/// Compares from before and from behind.
fn check(renderer: &mut Renderer, blueprint: &str, world: &World, actor: ActorId) -> Tally {
    let state = world.frame().actor(actor).cloned().unwrap();
    let mut sum = Tally::default();
    for (yaw_rad, down_rad) in [(3.6, 0.35), (0.3, 0.12)] {
        let tally = compare(renderer, world, actor, &camera_at(&state, yaw_rad, down_rad));
        let Tally { at_it, near, same } = tally;
        assert!(at_it >= 30.0, "{blueprint}: only {at_it} rays at it");
        assert!(near >= SHARE_MIN * at_it, "{blueprint}: {near} of {at_it} within {NEAR_M} m");
        assert!(same >= SHARE_MIN * at_it, "{blueprint}: {same} of {at_it} of the same thing");
        sum.at_it += at_it;
        sum.near += near;
        sum.same += same;
    }
    sum
}

fn renderer() -> Renderer {
    Renderer::new(AdapterChoice::Software).unwrap()
}

fn check_all(is_wanted: impl Fn(&Class) -> bool) -> usize {
    let mut renderer = renderer();
    let (mut sum, mut count) = (Tally::default(), 0);
    for blueprint in blueprints::all().iter().filter(|blueprint| is_wanted(&blueprint.class)) {
        let (world, actor) = moving(&blueprint.id, blueprint.class);
        let Tally { at_it, near, same } = check(&mut renderer, &blueprint.id, &world, actor);
        sum = Tally { at_it: sum.at_it + at_it, near: sum.near + near, same: sum.same + same };
        count += 1;
    }
    println!("{count} blueprints: {sum:?}, {}", sum.near / sum.at_it);
    count
}

#[test]
fn rays_meet_vehicles_and_their_riders_where_and_as_pictures_show_them() {
    assert!(check_all(|class| matches!(class, Class::Vehicle(_))) > 30);
}

#[test]
fn rays_meet_people_in_their_stride_where_pictures_show_them() {
    assert!(check_all(|class| matches!(class, Class::Walker(_))) > 20);
}

#[test]
fn rays_meet_props_where_pictures_show_them() {
    assert!(check_all(|class| matches!(class, Class::Prop(_))) > 50);
}

#[test]
fn rays_go_through_open_doors_where_pictures_do() {
    let mut renderer = renderer();
    for blueprint in ["vehicle.lincoln.mkz", "vehicle.mercedes.sprinter"] {
        let class = blueprints::find(blueprint).unwrap().class;
        let (mut world, actor) = moving(blueprint, class);
        let closed = world.fork(world.id());
        for command in [
            VehicleCommand::Doors { actor, doors: 0x3f, open: true },
            VehicleCommand::Lights { actor, lights: 0xff },
        ] {
            world.apply(&Command::Vehicle(command)).unwrap();
        }
        world.tick().unwrap();
        check(&mut renderer, blueprint, &world, actor);
        check(&mut renderer, blueprint, &closed, actor);
    }
}

/// Doors and lamps all closed and dark or all open and lit, wheels and limbs at their ends: nothing
/// is outside of the box that rays try first.
#[test]
fn nothing_of_an_actor_is_outside_of_its_bounds() {
    for blueprint in blueprints::all() {
        if !matches!(blueprint.class, Class::Vehicle(_) | Class::Walker(_) | Class::Prop(_)) {
            continue;
        }
        let mut world = world();
        let pose = level_pose(Vec3::new(0.0, -3.0, 1.0), 0.0);
        let spawn = Command::spawn(&blueprint.id, pose, Vec3::zeros());
        let actor = world.apply(&spawn).unwrap().unwrap();
        for (doors, lights, turn) in [(0, 0, 1.2_f32), (0x3f, 0xfff, -1.2)] {
            let state = ActorState {
                world_from_actor: Pose::identity(),
                doors,
                lights,
                road_wheel_rad: turn,
                gait_rad: std::f32::consts::FRAC_PI_2 * turn.signum(),
                linear_velocity_mps: Vec3::x() * 10.0,
                ..world.actor(actor).unwrap()
            };
            assert_within_bounds(&state, &blueprint.id, &[]);
        }
    }
}

/// Of somebody at the origin of the world.
fn assert_within_bounds(state: &ActorState, type_id: &str, limbs: &[PosedLimb]) {
    let [low_m, high_m] = bodies::bounds(state, limbs);
    let parts = bodies::place(state, type_id, 0.0, limbs).parts;
    assert!(!parts.is_empty(), "{type_id}");
    for part in parts {
        for vertex in part.shape.mesh().vertices {
            let [x, y, z] = vertex.position;
            let row = |[a, b, c, d]: [f32; 4]| a * x + b * y + c * z + d;
            let at_m = Vec3::from(part.instance.world_from_shape.map(row));
            let is_within = at_m >= low_m && at_m <= high_m;
            assert!(is_within, "{type_id}: {:?} at {at_m}", part.shape);
        }
    }
}

/// A dense semantic lidar that somebody listens to.
fn spawn_lidar(world: &mut World, pose: Pose) {
    let attributes = [
        ("channels", "64"),
        ("points_per_second", "1200000"),
        ("range", "30"),
        ("rotation_frequency", "20"),
    ];
    let lidar = world.apply(&Command::SpawnActor {
        blueprint: "sensor.lidar.ray_cast_semantic".to_owned(),
        reference_from_actor: pose,
        linear_velocity_mps: Vec3::zeros(),
        attributes: attributes
            .map(|(id, value)| Attribute { id: id.to_owned(), value: value.to_owned() })
            .to_vec(),
        attachment: None,
        id: None,
    });
    let sensor = lidar.unwrap().unwrap();
    world.apply(&Command::Sensor(SensorCommand::Listen { sensor, on: true })).unwrap();
}

/// What the lidar measured of an actor in the last tick.
fn points_at(world: &World, actor: ActorId) -> impl Iterator<Item = &SemanticLidarPoint> {
    let Measurement::SemanticLidar(scan) = &world.sensors()[0].measurement else {
        panic!("{:?}", world.sensors())
    };
    scan.points.iter().filter(move |point| point.actor == actor.get())
}

#[test]
fn points_of_lidars_are_where_single_rays_meet() {
    let blueprint = blueprints::find("vehicle.yamaha.yzf").unwrap();
    let (mut world, actor) = moving(&blueprint.id, blueprint.class);
    let pose = level_pose(Vec3::new(-6.0, -3.0, 1.2), 0.0);
    spawn_lidar(&mut world, pose);
    let mut tags = std::collections::BTreeMap::new();
    for _ in 0..2 {
        world.tick().unwrap();
        for point in points_at(&world, actor) {
            let along = Vec3::from(point.position_m);
            let direction = pose.rotation * along;
            let hit = world.project_point(pose.translation.vector, direction, 30.0);
            let hit = hit.unwrap().unwrap();
            let at_m = pose * Point3::from(along);
            assert!((hit.position_m - at_m.coords).norm() < 0.002, "{point:?} {hit:?}");
            assert_eq!((hit.actor, u32::from(hit.tag)), (Some(actor), point.tag));
            *tags.entry(point.tag).or_insert(0) += 1;
        }
    }
    // The rider, and the motorcycle.
    assert_eq!(tags.keys().copied().collect::<Vec<u32>>(), [13, 18], "{tags:?}");
}
