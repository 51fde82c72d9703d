//! What lights and signs are as actors, and what hangs on them.

use nalgebra::{UnitQuaternion, Vector3};
use schemas::{
    ActorId, ActorKind, Attachment, AttachmentKind, BodyCommand, Command, ErrorCode, Pose, Vec3,
};
use world::World;

use crate::support::{config, roads, run, town, world};

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

/// A camera that is to hang on a light or sign.
fn camera_on(parent: ActorId, mount: Pose) -> Command {
    Command::SpawnActor {
        blueprint: "sensor.camera.rgb".to_owned(),
        reference_from_actor: mount,
        linear_velocity_mps: Vec3::zeros(),
        attributes: Vec::new(),
        attachment: Some(Attachment { parent, kind: AttachmentKind::Rigid }),
        id: None,
    }
}

#[test]
fn what_hangs_on_a_light_or_sign_stands_where_it_was_put_on_it() {
    let mut world = world();
    let frame = world.frame();
    let (light, sign) = (&frame.actors[0], frame.actors.last().unwrap());
    let mount = Pose::translation(0.5, 0.0, 4.0);
    for parent in [light, sign] {
        let camera = camera_on(parent.id, mount);
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
    let camera = camera_on(light.id, mount);
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
