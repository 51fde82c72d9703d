//! Traffic lights and signs of a world: their turns, what vehicles know of them, what is refused.
#![allow(clippy::unwrap_used, reason = "a test fails loudly")]

use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};

use nalgebra::{UnitQuaternion, Vector3};
use roads::{LaneTypes, Map, SignKind};
use schemas::{
    ActorId, ActorKind, AgentCommand, AgentOptions, BodyCommand, Command, ErrorCode, Frame, Pose,
    TrafficLightColour as Colour, TrafficLightCommand, TrafficLightState, Vec3, VehicleCommand,
    WorldId,
};
use world::{Town, World, WorldConfig};

const DT_SECS: f64 = 0.05;

fn roads() -> &'static Arc<Map> {
    static MAP: LazyLock<Arc<Map>> = LazyLock::new(|| {
        let text = roads::town::build("Town02_Opt").unwrap();
        Arc::new(Map::parse("Town02_Opt", &text).unwrap())
    });
    &MAP
}

fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| Arc::new(Town::new(Arc::clone(roads()))));
    Arc::clone(&TOWN)
}

fn config() -> WorldConfig {
    let id = WorldId::new(1).unwrap();
    WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map: town() }
}

fn world() -> World {
    World::with_traffic(config()).unwrap()
}

fn run(world: &mut World, ticks: usize) {
    for _ in 0..ticks {
        world.tick().unwrap();
    }
}

fn light(world: &World, actor: ActorId) -> TrafficLightState {
    let frame = world.frame();
    *frame.traffic_lights.iter().find(|light| light.actor == actor).unwrap()
}

fn colour(world: &World, actor: ActorId) -> Colour {
    light(world, actor).colour
}

/// Lights of the first group: those that begin, and those whose turn is next.
fn first_group(world: &World) -> [Vec<ActorId>; 2] {
    let frame = world.frame();
    let of = |colour| {
        let lights = frame.traffic_lights.iter().filter(|l| l.group == 0 && l.colour == colour);
        lights.map(|light| light.actor).collect::<Vec<_>>()
    };
    let lights = [of(Colour::Green), of(Colour::Red)];
    assert!(lights.iter().all(|lights| !lights.is_empty()), "{lights:?}");
    lights
}

fn set_colour(actor: ActorId, colour: Colour) -> Command {
    let colour = Some(colour);
    Command::TrafficLight(TrafficLightCommand::Set {
        actor,
        colour,
        green_secs: None,
        yellow_secs: None,
        red_secs: None,
    })
}

#[test]
fn lights_and_signs_are_the_first_actors_of_a_world_that_asks_for_them() {
    let world = world();
    let frame = world.frame();
    let map = roads();
    let (lights, signs) = (map.traffic_lights().lights, map.traffic_signs());
    let count = lights.len() + signs.len();
    assert!(lights.len() > 8 && signs.len() > 8);
    assert_eq!((frame.actors.len(), world.actor_count()), (count, count));
    assert_eq!(frame.traffic_lights.len(), lights.len());
    let descriptions = world.describe(&[]);
    for (index, signal) in
        lights.iter().map(|l| &l.id).chain(signs.iter().map(|s| &s.id)).enumerate()
    {
        let actor = &frame.actors[index];
        assert_eq!(actor.id.get() as usize, index + 1);
        let is_light = index < lights.len();
        let kind = if is_light { ActorKind::TrafficLight } else { ActorKind::TrafficSign };
        assert_eq!(actor.kind, kind);
        assert_eq!(descriptions[index].signal.as_ref(), Some(signal));
        assert_eq!(frame.type_of(actor), descriptions[index].blueprint);
        assert!(actor.box_half_extent_m.min() > 0.3, "{actor:?}");
        assert_eq!(frame.type_of(actor) == "traffic.traffic_light", is_light);
    }
    assert!(frame.types.iter().any(|id| id.starts_with("traffic.speed_limit.")));
    let empty = World::new(config()).unwrap().frame();
    assert!(empty.actors.is_empty() && empty.traffic_lights.is_empty() && empty.types.is_empty());
}

#[test]
fn what_hangs_on_a_light_or_sign_stands_where_it_was_put_on_it() {
    let mut world = world();
    let frame = world.frame();
    let (light, sign) = (&frame.actors[0], frame.actors.last().unwrap());
    let mount = Pose::translation(0.5, 0.0, 4.0);
    for parent in [light, sign] {
        let camera = Command::SpawnActor {
            blueprint: "sensor.camera.rgb".to_owned(),
            reference_from_actor: mount,
            linear_velocity_mps: Vec3::zeros(),
            attributes: Vec::new(),
            attachment: Some(schemas::Attachment {
                parent: parent.id,
                kind: schemas::AttachmentKind::Rigid,
            }),
            id: None,
        };
        let camera = world.apply(&camera).unwrap().unwrap();
        let seen = |world: &World| world.frame().actor(camera).unwrap().clone();
        assert_eq!(seen(&world).parent, Some(parent.id));
        assert_eq!(seen(&world).world_from_actor, parent.world_from_actor * mount);
        let lower = Pose::translation(0.5, 0.0, 2.0);
        let set = BodyCommand::SetPose { actor: camera, reference_from_actor: lower };
        world.apply(&Command::Body(set)).unwrap();
        run(&mut world, 2);
        assert_eq!(seen(&world).world_from_actor, parent.world_from_actor * lower);
        let mut forked =
            World::restore(&world.snapshot(), world.id(), 1, |_| Some(town())).unwrap();
        run(&mut forked, 1);
        assert_eq!(seen(&forked).world_from_actor, parent.world_from_actor * lower);
    }
}

#[test]
fn what_hangs_on_a_light_is_not_put_out_of_the_world_and_stays_where_it_was_when_refused() {
    let mut world = world();
    let light = world.frame().actors[0].clone();
    let mount = Pose::translation(0.5, 0.0, 4.0);
    let camera = Command::SpawnActor {
        blueprint: "sensor.camera.rgb".to_owned(),
        reference_from_actor: mount,
        linear_velocity_mps: Vec3::zeros(),
        attributes: Vec::new(),
        attachment: Some(schemas::Attachment {
            parent: light.id,
            kind: schemas::AttachmentKind::Rigid,
        }),
        id: None,
    };
    let camera = world.apply(&camera).unwrap().unwrap();
    // As far from the light as anything may be from the origin, and away from the origin.
    let at_m = light.world_from_actor.translation.vector;
    let away = light.world_from_actor.rotation.inverse() * at_m.normalize();
    let far = Pose::from_parts((away * 99_999.0).into(), UnitQuaternion::identity());
    assert!(at_m.norm() > 10.0);
    let set =
        |to: Pose| Command::Body(BodyCommand::SetPose { actor: camera, reference_from_actor: to });
    let refusal = world.apply(&set(far)).unwrap_err();
    assert_eq!(refusal.code, ErrorCode::InvalidArgument);
    let wanted = light.world_from_actor * mount;
    for _ in 0..2 {
        assert_eq!(world.frame().actor(camera).unwrap().world_from_actor, wanted);
        run(&mut world, 1);
    }
    world.apply(&set(Pose::identity())).unwrap();
    let now = world.frame().actor(camera).unwrap().world_from_actor;
    assert_eq!(now, light.world_from_actor * Pose::identity());
}

#[test]
fn the_volume_of_a_light_reaches_across_its_lanes_along_its_own_forward_axis() {
    let frame = world().frame();
    let map = roads();
    for (light, actor) in map.traffic_lights().lights.iter().zip(&frame.actors) {
        for trigger in &light.boxes {
            let middle: Vec3 = nalgebra::convert(trigger.pose.translation.vector);
            let local = actor.world_from_actor.inverse_transform_point(&middle.into()).coords;
            let off = (local - actor.box_centre_m).abs() - actor.box_half_extent_m;
            assert!(off.max() < 1.0e-3, "{actor:?}");
            let across: Vector3<f64> = trigger.pose.rotation * Vector3::y();
            let forward = actor.world_from_actor.rotation * Vec3::x();
            assert!(nalgebra::convert::<_, Vec3>(across).dot(&forward) < -0.95, "{actor:?}");
        }
    }
}

#[test]
fn a_turn_is_10_s_green_3_s_yellow_and_2_s_red_to_the_tick() {
    let mut world = world();
    let [first, next] = first_group(&world);
    let mut changes = Vec::new();
    let mut before = [colour(&world, first[0]), colour(&world, next[0])];
    for tick in 1..=310 {
        world.tick().unwrap();
        let now = [colour(&world, first[0]), colour(&world, next[0])];
        if now != before {
            changes.push((tick, now));
        }
        before = now;
        assert!(now.contains(&Colour::Red), "two turns at once at {tick}");
    }
    use Colour::{Green, Red, Yellow};
    assert_eq!(changes, [(200, [Yellow, Red]), (260, [Red, Red]), (300, [Red, Green])]);
}

#[test]
fn lights_of_one_controller_show_the_same_and_every_controller_gets_its_turn() {
    let mut world = world();
    let lights = roads().traffic_lights();
    let mut green: BTreeSet<usize> = BTreeSet::new();
    for _ in 0..60 {
        run(&mut world, 20);
        let frame = world.frame();
        for (index, controller) in lights.controllers.iter().enumerate() {
            let shown: Vec<Colour> =
                controller.lights.iter().map(|l| frame.traffic_lights[*l].colour).collect();
            assert!(shown.windows(2).all(|pair| pair[0] == pair[1]), "{shown:?}");
            if shown[0] == Colour::Green {
                green.insert(index);
            }
        }
    }
    assert_eq!(green.len(), lights.controllers.len());
}

#[test]
fn frozen_lights_stay_and_go_on_where_they_were() {
    let mut world = world();
    let [first, _] = first_group(&world);
    run(&mut world, 150);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    run(&mut world, 400);
    let frozen = light(&world, first[0]);
    assert!(frozen.frozen && frozen.colour == Colour::Green, "{frozen:?}");
    assert!((frozen.elapsed_secs - 7.5).abs() < 1.0e-3, "{frozen:?}");
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: false })).unwrap();
    run(&mut world, 49);
    assert_eq!(colour(&world, first[0]), Colour::Green);
    run(&mut world, 1);
    assert_eq!(colour(&world, first[0]), Colour::Yellow);
}

#[test]
fn a_reset_group_begins_anew_and_others_go_on() {
    let mut world = world();
    let [first, next] = first_group(&world);
    let other = world.frame().traffic_lights.iter().find(|l| l.group == 1).unwrap().actor;
    run(&mut world, 310);
    assert_eq!(colour(&world, next[0]), Colour::Green);
    let elsewhere = light(&world, other);
    world
        .apply(&Command::TrafficLight(TrafficLightCommand::Reset { actor: Some(next[0]) }))
        .unwrap();
    assert_eq!(colour(&world, first[0]), Colour::Green);
    assert_eq!((colour(&world, next[0]), light(&world, first[0]).elapsed_secs), (Colour::Red, 0.0));
    assert_eq!(light(&world, other), elsewhere);
    run(&mut world, 199);
    assert_eq!(colour(&world, first[0]), Colour::Green);
    run(&mut world, 1);
    assert_eq!(colour(&world, first[0]), Colour::Yellow);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Reset { actor: None })).unwrap();
    assert!(world.frame().traffic_lights.iter().all(|light| light.elapsed_secs == 0.0));
}

#[test]
fn a_light_shows_what_it_is_told_until_its_turn_and_its_times_are_its_controllers() {
    let mut world = world();
    let [first, next] = first_group(&world);
    world.apply(&set_colour(next[0], Colour::Off)).unwrap();
    let times = Command::TrafficLight(TrafficLightCommand::Set {
        actor: first[0],
        colour: None,
        green_secs: Some(1.0),
        yellow_secs: Some(0.5),
        red_secs: Some(0.25),
    });
    world.apply(&times).unwrap();
    for actor in &first {
        let light = light(&world, *actor);
        assert_eq!((light.green_secs, light.yellow_secs, light.red_secs), (1.0, 0.5, 0.25));
    }
    assert_eq!(light(&world, next[0]).green_secs, 10.0);
    run(&mut world, 34);
    assert_eq!((colour(&world, first[0]), colour(&world, next[0])), (Colour::Red, Colour::Off));
    run(&mut world, 1);
    assert_eq!(colour(&world, next[0]), Colour::Green);
}

/// A place on a lane that leads to a light, this far before the place to stop at.
fn before_light(ahead_m: f64) -> (ActorId, Pose) {
    let lights = roads().traffic_lights();
    let (index, start) = lights
        .lights
        .iter()
        .enumerate()
        .find_map(|(index, light)| {
            let place = *roads().previous(&light.boxes.first()?.front, ahead_m).first()?;
            Some((index, place))
        })
        .unwrap();
    let mut pose: Pose = nalgebra::convert(roads().pose(&start));
    pose.translation.vector.z += 0.3;
    (ActorId::new(index as u32 + 1).unwrap(), pose)
}

#[test]
fn a_vehicle_knows_its_light_from_when_its_front_enters_the_box_until_it_has_left() {
    let mut world = world();
    let (light, start) = before_light(25.0);
    world.apply(&set_colour(light, Colour::Red)).unwrap();
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    let mut at_light_m = Vec::new();
    for _ in 0..120 {
        world.tick().unwrap();
        let frame = world.frame();
        let state = frame.actor(car).unwrap();
        assert!(state.speed_limit_mps > 5.0, "{state:?}");
        let travelled_m = state.world_from_actor.translation.vector - start.translation.vector;
        if let Some(seen) = state.traffic_light {
            assert_eq!(seen, light);
            at_light_m.push(travelled_m.norm());
        }
        // A coasting car must come through to show when it forgets the light.
        if state.linear_velocity_mps.norm() < 7.0 {
            let linear_mps = Some(state.world_from_actor.rotation * Vec3::new(8.0, 0.0, 0.0));
            let push = Command::Body(BodyCommand::SetVelocity {
                actor: car,
                linear_mps,
                angular_radps: None,
            });
            world.apply(&push).unwrap();
        }
    }
    let (first, last) = (at_light_m[0], at_light_m[at_light_m.len() - 1]);
    // The box is 3 m long and its front 25 m ahead; the car is 4.9 m long.
    assert!((19.0..20.0).contains(&first), "{at_light_m:?}");
    assert!((26.8..27.9).contains(&last), "{at_light_m:?}");
}

#[test]
fn a_stop_sign_holds_a_vehicle_for_two_seconds_even_when_it_sleeps() {
    let text = roads::town::build("Town04_Opt").unwrap();
    let map = Arc::new(Map::parse("Town04_Opt", &text).unwrap());
    let signs = map.traffic_signs();
    let (index, place) = signs
        .iter()
        .enumerate()
        .find_map(|(index, sign)| {
            (sign.kind == SignKind::Stop).then(|| (index, sign.boxes.first().unwrap().middle))
        })
        .unwrap();
    let sign = ActorId::new((map.traffic_lights().lights.len() + index) as u32 + 1).unwrap();
    let mut pose: Pose = nalgebra::convert(map.pose(&place));
    pose.translation.vector.z += 0.3;
    let mut world =
        World::with_traffic(WorldConfig { map: Arc::new(Town::new(map)), ..config() }).unwrap();
    let car = Command::spawn("vehicle.lincoln.mkz", pose, Vec3::zeros());
    let car = world.apply(&car).unwrap().unwrap();
    let control = schemas::VehicleControl { brake: 1.0, ..Default::default() };
    world.apply(&Command::Vehicle(VehicleCommand::Control { actor: car, control })).unwrap();
    let mut held = Vec::new();
    for _ in 0..80 {
        world.tick().unwrap();
        held.push(world.frame().actor(car).unwrap().traffic_light);
    }
    let ticks = held.iter().filter(|holder| **holder == Some(sign)).count();
    assert!((39..=41).contains(&ticks), "{ticks}");
    assert!(held[ticks..].iter().all(Option::is_none));
}

#[test]
fn the_limit_a_vehicle_knows_is_that_of_its_lane() {
    let mut world = world();
    let (_, start) = before_light(30.0);
    let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, Vec3::zeros()));
    let car = car.unwrap().unwrap();
    run(&mut world, 1);
    let at: Vector3<f64> = nalgebra::convert(start.translation.vector);
    let place = roads().nearest(at.into(), LaneTypes::DRIVING).unwrap();
    let limit_mps = roads().speed_limit_mps(&place).unwrap() as f32;
    assert_eq!(world.frame().actor(car).unwrap().speed_limit_mps, limit_mps);
}

#[test]
fn a_restored_and_a_forked_world_show_the_same_ever_after() {
    let mut world = world();
    let (light, start) = before_light(25.0);
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap();
    world.apply(&set_colour(light, Colour::Yellow)).unwrap();
    run(&mut world, 57);
    let id = WorldId::new(1).unwrap();
    let mut restored = World::restore(&world.snapshot(), id, 1, |_| Some(town())).unwrap();
    let mut forked = world.fork(id);
    for _ in 0..300 {
        let frames: Vec<Frame> = [&mut world, &mut restored, &mut forked]
            .into_iter()
            .map(|world| {
                world.tick().unwrap();
                world.frame()
            })
            .collect();
        assert_eq!(frames[0], frames[1]);
        assert_eq!(frames[0], frames[2]);
    }
}

#[test]
fn what_lights_show_is_part_of_the_state_hash() {
    let [mut one, mut other] = [world(), world()];
    let [first, _] = first_group(&one);
    assert_eq!(one.state_hash(), other.state_hash());
    one.apply(&set_colour(first[0], Colour::Red)).unwrap();
    assert_ne!(one.state_hash(), other.state_hash());
    other.apply(&set_colour(first[0], Colour::Red)).unwrap();
    assert_eq!(one.state_hash(), other.state_hash());
    one.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    assert_ne!(one.state_hash(), other.state_hash());
}

#[test]
fn signs_cannot_be_set_and_neither_signs_nor_lights_destroyed_and_nothing_changes() {
    let mut world = world();
    let before = world.state_hash();
    let lights = world.frame().traffic_lights.len() as u32;
    let (light, sign) = (ActorId::new(1).unwrap(), ActorId::new(lights + 1).unwrap());
    let unknown = ActorId::new(99_999).unwrap();
    let code = |world: &mut World, command: Command| world.apply(&command).unwrap_err().code;
    let reset = |actor| Command::TrafficLight(TrafficLightCommand::Reset { actor: Some(actor) });
    for (command, expected) in [
        (set_colour(sign, Colour::Red), ErrorCode::InvalidArgument),
        (set_colour(unknown, Colour::Red), ErrorCode::UnknownActor),
        (reset(sign), ErrorCode::InvalidArgument),
        (Command::DestroyActor { actor: light }, ErrorCode::InvalidArgument),
        (Command::DestroyActor { actor: sign }, ErrorCode::InvalidArgument),
    ] {
        assert_eq!(code(&mut world, command), expected);
    }
    for secs in [-1.0, f32::NAN, f32::INFINITY] {
        let command = Command::TrafficLight(TrafficLightCommand::Set {
            actor: light,
            colour: Some(Colour::Off),
            green_secs: Some(secs),
            yellow_secs: None,
            red_secs: None,
        });
        assert_eq!(code(&mut world, command), ErrorCode::InvalidArgument);
    }
    assert_eq!(world.state_hash(), before);
    let mut without = World::new(config()).unwrap();
    assert_eq!(code(&mut without, set_colour(light, Colour::Red)), ErrorCode::UnknownActor);
}

/// What a frame tells with other ids: as if they began at 1.
fn numbered_from_one(frame: &Frame, first: ActorId) -> Frame {
    let back = |id: ActorId| ActorId::new(id.get() - first.get() + 1).unwrap();
    let mut told = frame.clone();
    told.state_hash = 0;
    for actor in &mut told.actors {
        actor.id = back(actor.id);
        actor.traffic_light = actor.traffic_light.map(back);
        actor.parent = actor.parent.map(back);
    }
    for light in &mut told.traffic_lights {
        light.actor = back(light.actor);
    }
    told
}

#[test]
fn a_world_whose_ids_begin_later_goes_on_as_any_other() {
    let first = ActorId::new(70_000).unwrap();
    let mut worlds = [world(), world().numbered_from(first).unwrap()];
    let ids = worlds.each_mut().map(|world| {
        let (waiting, pose) = before_light(1.0);
        let waiting = waiting.get() - 1 + world.frame().actors[0].id.get();
        let car = Command::spawn("vehicle.lincoln.mkz_2020", pose, Vec3::zeros());
        let car = world.apply(&car).unwrap().unwrap();
        let imu = Command::SpawnActor {
            blueprint: "sensor.other.imu".to_owned(),
            reference_from_actor: Pose::identity(),
            linear_velocity_mps: Vec3::zeros(),
            attributes: vec![schemas::Attribute {
                id: "noise_accel_stddev_x".to_owned(),
                value: "1.0".to_owned(),
            }],
            attachment: Some(schemas::Attachment {
                parent: car,
                kind: schemas::AttachmentKind::Rigid,
            }),
            id: None,
        };
        let sensor = world.apply(&imu).unwrap().unwrap();
        let listen = schemas::SensorCommand::Listen { sensor, on: true };
        world.apply(&Command::Sensor(listen)).unwrap();
        (ActorId::new(waiting).unwrap(), car)
    });
    for _ in 0..40 {
        run(&mut worlds[0], 1);
        run(&mut worlds[1], 1);
        let [told, shifted] = worlds.each_ref().map(World::frame);
        assert_eq!(Frame { state_hash: 0, ..told }, numbered_from_one(&shifted, first));
        let [measured, same] = worlds.each_ref().map(|world| {
            let data = world.sensors().iter().map(|datum| datum.measurement.clone());
            data.collect::<Vec<_>>()
        });
        assert!(!measured.is_empty() && measured == same);
    }
    let [_, (waiting, car)] = ids;
    let [_, mut later] = worlds;
    assert_eq!(later.frame().actor(car).unwrap().traffic_light, Some(waiting));
    later.apply(&set_colour(waiting, Colour::Green)).unwrap();
    assert_eq!(colour(&later, waiting), Colour::Green);
    let old = ActorId::new(waiting.get() - first.get() + 1).unwrap();
    let refusal = later.apply(&set_colour(old, Colour::Red)).unwrap_err();
    assert_eq!(refusal.code, ErrorCode::UnknownActor);
    let mut restored = World::restore(&later.snapshot(), later.id(), 1, |_| Some(town())).unwrap();
    run(&mut restored, 3);
    run(&mut later, 3);
    assert_eq!(restored.frame(), later.frame());
}

#[test]
fn a_world_for_which_ids_do_not_suffice_is_refused() {
    let refusal = world().numbered_from(ActorId::new(u32::MAX).unwrap()).err().unwrap();
    assert_eq!(refusal.code, ErrorCode::Capacity);
}

/// A car that is kept at 8 m/s past a light of this colour.
fn past_a_light(colour: Colour) -> World {
    let mut world = world();
    let (light, start) = before_light(25.0);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    world.apply(&set_colour(light, colour)).unwrap();
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    let car = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    let velocity_mps = Some(Vec3::new(8.0, 0.0, 0.0));
    let push = BodyCommand::SetConstantVelocity { actor: car, velocity_mps };
    world.apply(&Command::Body(push)).unwrap();
    run(&mut world, 100);
    world
}

#[test]
fn a_light_that_is_run_is_counted_once_and_a_green_one_is_not() {
    for (colour, wanted) in [(Colour::Red, 1), (Colour::Yellow, 0), (Colour::Green, 0)] {
        let world = past_a_light(colour);
        let broken: Vec<u32> = world.rules_broken().map(|(_, broken)| broken.red_lights).collect();
        assert_eq!(broken, [wanted], "{colour:?}");
    }
}

#[test]
fn a_stop_sign_is_run_by_whoever_does_not_stand_at_it() {
    let text = roads::town::build("Town04_Opt").unwrap();
    let map = Arc::new(Map::parse("Town04_Opt", &text).unwrap());
    let sign = map.traffic_signs().into_iter().find(|sign| sign.kind == SignKind::Stop).unwrap();
    let start = *map.previous(&sign.boxes[0].front, 25.0).first().unwrap();
    let mut pose: Pose = nalgebra::convert(map.pose(&start));
    pose.translation.vector.z += 0.3;
    let town = Arc::new(Town::new(map));
    for stops in [false, true] {
        let mut world =
            World::with_traffic(WorldConfig { map: Arc::clone(&town), ..config() }).unwrap();
        let car = Command::spawn("vehicle.lincoln.mkz", pose, Vec3::zeros());
        let actor = world.apply(&car).unwrap().unwrap();
        if stops {
            let behaviour = schemas::AgentBehaviour::Normal;
            let join = schemas::TrafficCommand::Join { actor, behaviour };
            world.apply(&Command::Traffic(join)).unwrap();
        } else {
            let velocity_mps = Some(Vec3::new(6.0, 0.0, 0.0));
            let push = BodyCommand::SetConstantVelocity { actor, velocity_mps };
            world.apply(&Command::Body(push)).unwrap();
        }
        run(&mut world, 600);
        let broken: Vec<u32> = world.rules_broken().map(|(_, broken)| broken.stop_signs).collect();
        assert_eq!(broken, [u32::from(!stops)], "stops {stops}");
    }
}

#[test]
fn blue_lights_pass_a_red_light_and_others_do_not() {
    for (blue, by_agent) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut world = world();
        let (_, start) = before_light(30.0);
        world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
        let lights: Vec<ActorId> =
            world.frame().traffic_lights.iter().map(|light| light.actor).collect();
        for light in lights {
            world.apply(&set_colour(light, Colour::Red)).unwrap();
        }
        let ambulance = Command::spawn("vehicle.ford.ambulance", start, Vec3::zeros());
        let actor = world.apply(&ambulance).unwrap().unwrap();
        let lights = if blue { 0x200 } else { 0 };
        world.apply(&Command::Vehicle(VehicleCommand::Lights { actor, lights })).unwrap();
        let behaviour = schemas::AgentBehaviour::Normal;
        if by_agent {
            let options = AgentOptions { behaviour, ..AgentOptions::default() };
            let keep_route = false;
            let set = AgentCommand::Set { actor, options, keep_route };
            world.apply(&Command::Agent(set)).unwrap();
            world.apply(&Command::Agent(AgentCommand::Drive { actor, on: true })).unwrap();
        } else {
            let join = schemas::TrafficCommand::Join { actor, behaviour };
            world.apply(&Command::Traffic(join)).unwrap();
        }
        run(&mut world, 400);
        let frame = world.frame();
        let place_m = frame.actor(actor).unwrap().world_from_actor.translation.vector;
        let driven_m = (place_m - start.translation.vector).norm();
        assert_eq!(driven_m > 35.0, blue, "{driven_m} m, by an agent: {by_agent}");
    }
}

#[test]
fn who_is_put_elsewhere_before_a_red_light_or_stop_sign_has_run_neither() {
    let mut world = world();
    let (light, start) = before_light(1.0);
    world.apply(&Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true })).unwrap();
    world.apply(&set_colour(light, Colour::Red)).unwrap();
    let speed = start.rotation * Vec3::new(8.0, 0.0, 0.0);
    let actor = world.apply(&Command::spawn("vehicle.lincoln.mkz", start, speed)).unwrap().unwrap();
    run(&mut world, 2);
    assert_eq!(world.frame().actor(actor).unwrap().traffic_light, Some(light));
    let (_, world_from_actor) = before_light(30.0);
    world
        .apply(&Command::Body(BodyCommand::SetPose {
            actor,
            reference_from_actor: world_from_actor,
        }))
        .unwrap();
    run(&mut world, 1);
    assert_eq!(world.frame().actor(actor).unwrap().traffic_light, None);
    let red_lights =
        |world: &World| -> u32 { world.rules_broken().map(|(_, broken)| broken.red_lights).sum() };
    assert_eq!(red_lights(&world), 0);
    // From there it comes to the light again, and runs it.
    let velocity_mps = Some(Vec3::new(8.0, 0.0, 0.0));
    let push = BodyCommand::SetConstantVelocity { actor, velocity_mps };
    world.apply(&Command::Body(push)).unwrap();
    run(&mut world, 120);
    assert_eq!(red_lights(&world), 1);
}

/// Two roads that cross in a junction; a sign of this type stands on the way to the east.
fn signed_crossing(sign: &str) -> Arc<Map> {
    let road =
        |id: u32, junction: i32, [x, y, hdg, length]: [f64; 4], link: &str, signals: &str| {
            format!(
                "<road id=\"{id}\" length=\"{length}\" junction=\"{junction}\"><link>{link}</link>\
             <planView><geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"{length}\">\
             <line/></geometry></planView><lanes><laneSection s=\"0\">\
             <center><lane id=\"0\" type=\"none\"/></center><right>\
             <lane id=\"-1\" type=\"driving\">\
             <link><predecessor id=\"-1\"/><successor id=\"-1\"/></link>\
             <width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/></lane></right>\
             </laneSection></lanes><signals>{signals}</signals></road>"
            )
        };
    let north = std::f64::consts::FRAC_PI_2;
    let to = |way: &str, kind: &str, id: u32, end: &str| {
        format!("<{way} elementType=\"{kind}\" elementId=\"{id}\" contactPoint=\"{end}\"/>")
    };
    let into = to("successor", "junction", 9, "start");
    let through = |from: u32, on: u32| {
        to("predecessor", "road", from, "end") + &to("successor", "road", on, "start")
    };
    let sign = format!(
        "<signal id=\"77\" s=\"3\" t=\"-5\" type=\"{sign}\" subtype=\"-1\" country=\"OpenDRIVE\" \
         dynamic=\"no\" orientation=\"-\" zOffset=\"2\" value=\"-1\" name=\"\"/>"
    );
    let connection = |id: u32, from: u32, way: u32| {
        format!(
            "<connection id=\"{id}\" incomingRoad=\"{from}\" connectingRoad=\"{way}\" \
             contactPoint=\"start\"><laneLink from=\"-1\" to=\"-1\"/></connection>"
        )
    };
    let text = [
        "<OpenDRIVE><header/>".to_owned(),
        road(1, -1, [-70.0, 2.0, 0.0, 60.0], &into, ""),
        road(2, -1, [10.0, 2.0, 0.0, 60.0], &to("predecessor", "junction", 9, "end"), ""),
        road(3, -1, [-2.0, -70.0, north, 60.0], &into, ""),
        road(4, -1, [-2.0, 10.0, north, 60.0], &to("predecessor", "junction", 9, "end"), ""),
        road(10, 9, [-10.0, 2.0, 0.0, 20.0], &through(1, 2), &sign),
        road(11, 9, [-2.0, -10.0, north, 20.0], &through(3, 4), ""),
        format!("<junction id=\"9\">{}{}</junction>", connection(0, 1, 10), connection(1, 3, 11)),
        "</OpenDRIVE>".to_owned(),
    ];
    Arc::new(Map::parse("signed crossing", &text.concat()).unwrap())
}

#[test]
fn a_sign_on_a_way_through_a_junction_holds_a_vehicle_while_others_cross() {
    for (sign, holds_at_first) in [("205", false), ("206", true)] {
        let map = Arc::new(Town::new(signed_crossing(sign)));
        let mut world = World::with_traffic(WorldConfig { map, ..config() }).unwrap();
        let spawn = |world: &mut World, x: f32, y: f32, yaw_rad: f32| {
            let pose = schemas::level_pose(Vec3::new(x, y, 0.3), yaw_rad);
            let car = Command::spawn("vehicle.lincoln.mkz", pose, Vec3::zeros());
            let actor = world.apply(&car).unwrap().unwrap();
            let control = schemas::VehicleControl { brake: 1.0, ..Default::default() };
            world.apply(&Command::Vehicle(VehicleCommand::Control { actor, control })).unwrap();
            actor
        };
        let frame = world.frame();
        let sign = frame.actors.iter().find(|actor| actor.kind == ActorKind::TrafficSign);
        let sign = sign.unwrap().id;
        let car = spawn(&mut world, -9.0, 0.0, 0.0);
        let holder = |world: &World| world.frame().actor(car).unwrap().traffic_light;
        run(&mut world, 5);
        assert_eq!(holder(&world), holds_at_first.then_some(sign));
        // Long enough for it to sleep.
        run(&mut world, 80);
        assert_eq!(holder(&world), None);
        // On the way that crosses, and before the junction.
        for y in [-4.0, -14.0] {
            let other = spawn(&mut world, 0.0, y, std::f32::consts::FRAC_PI_2);
            run(&mut world, 80);
            assert_eq!(holder(&world), Some(sign), "{y}");
            world.apply(&Command::DestroyActor { actor: other }).unwrap();
            run(&mut world, 2);
            assert_eq!(holder(&world), None, "{y}");
        }
        // Who comes from the same road, and who is far away, goes first in nothing.
        spawn(&mut world, -20.0, 0.0, 0.0);
        spawn(&mut world, 0.0, -40.0, std::f32::consts::FRAC_PI_2);
        run(&mut world, 10);
        assert_eq!(holder(&world), None);
        let broken = world.rules_broken().map(|(_, broken)| broken.stop_signs).sum::<u32>();
        assert_eq!(broken, 0);
    }
}
