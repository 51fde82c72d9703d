//! Worlds whose ids begin later.

use schemas::{ActorId, Command, ErrorCode, Frame, Pose, TrafficLightColour as Colour, Vec3};
use world::World;

use crate::support::{before_light, colour, run, set_colour, town, world};

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
