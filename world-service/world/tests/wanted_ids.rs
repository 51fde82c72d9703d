//! Actors whose ids were wanted, in a world with lights and signs whose ids begin late.
#![allow(clippy::unwrap_used, reason = "a test fails loudly")]

use std::sync::{Arc, LazyLock};

use roads::Map;
use schemas::{
    ActorId, Attachment, AttachmentKind, Command, Error, ErrorCode, Pose, Vec3, WorldId, limits,
};
use world::{Town, World, WorldConfig};

/// Where the ids of lights and signs begin.
const FIRST: u32 = 1_000;

fn town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| {
        let text = roads::town::build("Town02_Opt").unwrap();
        Arc::new(Town::new(Arc::new(Map::parse("Town02_Opt", &text).unwrap())))
    });
    Arc::clone(&TOWN)
}

fn world() -> World {
    let id = WorldId::new(1).unwrap();
    let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map: town() };
    World::with_traffic(config).unwrap().numbered_from(actor(FIRST)).unwrap()
}

fn actor(id: u32) -> ActorId {
    ActorId::new(id).unwrap()
}

/// A prop high above the town, alone or on another one.
fn spawn(world: &mut World, id: Option<u32>, parent: Option<ActorId>) -> Result<u32, Error> {
    let command = Command::SpawnActor {
        blueprint: "static.prop.constructioncone".to_owned(),
        reference_from_actor: Pose::translation(0.0, 0.0, 500.0),
        linear_velocity_mps: Vec3::zeros(),
        attributes: Vec::new(),
        attachment: parent.map(|parent| Attachment { parent, kind: AttachmentKind::Rigid }),
        id: id.map(actor),
    };
    world.apply(&command).map(|id| id.unwrap().get())
}

fn ids(world: &World) -> Vec<u32> {
    world.frame().actors.iter().map(|actor| actor.id.get()).collect()
}

#[test]
fn ids_are_given_as_wanted_and_others_follow_the_highest() {
    let mut world = world();
    let fixed = ids(&world).len() as u32;
    assert!(fixed > 8);
    assert_eq!(spawn(&mut world, None, None).unwrap(), FIRST + fixed);
    for wanted in [7, 3, 5_000, FIRST + fixed + 3] {
        assert_eq!(spawn(&mut world, Some(wanted), None).unwrap(), wanted);
    }
    assert_eq!(spawn(&mut world, None, None).unwrap(), 5_001);
    let lights = FIRST..FIRST + fixed + 1;
    let expected: Vec<u32> =
        [3, 7].into_iter().chain(lights).chain([FIRST + fixed + 3, 5_000, 5_001]).collect();
    assert_eq!(ids(&world), expected);
    let described: Vec<u32> = world.describe(&[]).iter().map(|one| one.id.get()).collect();
    assert_eq!(described, expected);
    world.apply(&Command::DestroyActor { actor: actor(7) }).unwrap();
    assert_eq!(spawn(&mut world, Some(7), None).unwrap(), 7, "it is free again");
}

#[test]
fn ids_that_cannot_be_given_are_refused_and_change_nothing() {
    let mut world = world();
    let cone = actor(spawn(&mut world, Some(5_000), None).unwrap());
    let before = (world.state_hash(), ids(&world));
    let refused = [
        (FIRST, None),
        (FIRST + 3, None),
        (5_000, None),
        (limits::WANTED_ACTOR_MAX + 1, None),
        (u32::MAX, None),
        (7, Some(cone)),
    ];
    for (wanted, parent) in refused {
        let error = spawn(&mut world, Some(wanted), parent).unwrap_err();
        let found = format!("actor {wanted}");
        assert_eq!((error.code, error.found), (ErrorCode::InvalidArgument, found));
    }
    assert_eq!((world.state_hash(), ids(&world)), before);
    assert_eq!(spawn(&mut world, Some(5_002), Some(cone)).unwrap(), 5_002);
    let highest = limits::WANTED_ACTOR_MAX;
    assert_eq!(spawn(&mut world, Some(highest), None).unwrap(), highest);
    assert_eq!(spawn(&mut world, None, None).unwrap(), highest + 1);
}

#[test]
fn a_world_with_lower_ids_than_its_first_is_restored_bit_for_bit() {
    let mut world = world();
    let pose = Pose::translation(0.0, 0.0, 500.0);
    for wanted in [4, 9] {
        spawn(&mut world, Some(wanted), None).unwrap();
    }
    world.apply(&Command::spawn("spectator", pose, Vec3::zeros())).unwrap();
    world.tick().unwrap();
    let mut restored = World::restore(&world.snapshot(), world.id(), 1, |_| Some(town())).unwrap();
    for _ in 0..3 {
        world.tick().unwrap();
        restored.tick().unwrap();
    }
    assert_eq!(restored.frame(), world.frame());
}
