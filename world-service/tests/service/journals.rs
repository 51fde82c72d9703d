//! Journals replay to the bit, and a replay that goes another way says where.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::sync::Arc;

use proptest::prelude::*;
use schemas::wire::encode_frame;
use schemas::{
    Command, Frame, Request, Tick, TickItem, Vec3, VehicleCommand, VehicleControl, WorldId, keys,
};
use world::{Town, World, WorldConfig};
use world_service::journal::{
    Difference, Entry, Head, JournalError, Moment, Replayed, TickEntry, Writer, verify,
};
use world_service::service::{Recorded, WorldWork};
use world_service::{Config, Journals};

use crate::any_command::command;
use crate::common::{MAP, Site, car, config, deadline, tenant, ticks};
use crate::shard::{Bench, Shared};

/// A folder that goes away with the test.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("causeway-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub(crate) fn id() -> WorldId {
    WorldId::new(7).unwrap()
}

pub(crate) fn world() -> World {
    use std::sync::LazyLock;
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| {
        let text = roads::town::build(MAP).unwrap();
        Arc::new(Town::new(Arc::new(roads::Map::parse(MAP, &text).unwrap())))
    });
    let map = Arc::clone(&TOWN);
    World::new(WorldConfig { id: id(), epoch: 3, seed: 7, dt_secs: 0.05, map }).unwrap()
}

fn recording(on: bool) -> WorldWork {
    WorldWork::Record { on, name: None }
}

fn head(world: &World) -> Head {
    Head {
        map_name: world.map_ref().name.clone(),
        map_text: world.map_text().to_owned(),
        snapshot: world.snapshot(),
        first: Moment::of(&world.frame()),
    }
}

pub(crate) fn begun(world: &World, out: &Shared, bytes_max: u64) -> Writer<Shared> {
    Writer::begin(out.clone(), bytes_max, &head(world)).unwrap()
}

pub(crate) fn tick_of(frame: &Frame) -> Entry {
    let (moment, frame) = (Moment::of(frame), encode_frame(frame));
    Entry::Tick(TickEntry { wanted_secs: None, moment, frame })
}

fn replay(out: &Shared) -> Result<Replayed, JournalError> {
    verify(out.0.lock().unwrap().as_slice(), |_| Ok(()))
}

#[test]
fn a_journal_that_began_in_the_middle_replays_to_its_end() {
    let mut bench = Bench::new();
    let world = bench.create(7, None);
    bench.tick(ticks(world, 5)).unwrap();
    bench.work(world, recording(true));
    let drive = |steer| {
        Command::Vehicle(VehicleCommand::Control {
            actor: schemas::ActorId::new(1).unwrap(),
            control: VehicleControl { throttle: 0.6, steer, ..VehicleControl::default() },
        })
    };
    bench.tick(TickItem { commands: vec![drive(0.1)], ..ticks(world, 20) }).unwrap();
    bench.work(world, WorldWork::Commands(vec![drive(-0.2), car()]));
    bench.tick(TickItem { dt_secs: Some(0.02), ..ticks(world, 20) }).unwrap();
    bench.work(world, recording(false));
    bench.tick(ticks(world, 5)).unwrap();
    let replayed = replay(&bench.outlet.journal).unwrap();
    assert_eq!((replayed.first, replayed.last), (Tick(5), Tick(45)));
    assert_eq!((replayed.map.as_str(), replayed.commands, replayed.ended), (MAP, 3, true));
}

#[test]
fn the_first_tick_actor_and_field_that_differ_are_named() {
    let out = Shared::default();
    let mut world = world();
    world.apply(&car()).unwrap();
    let mut journal = begun(&world, &out, 1 << 30);
    for tick in 1..=10 {
        world.tick().unwrap();
        let mut frame = world.frame();
        if tick >= 6 {
            frame.actors[0].linear_velocity_mps += Vec3::new(0.0, 1.0e-6, 0.0);
            frame.state_hash ^= 1;
        }
        journal.write(&tick_of(&frame)).unwrap();
    }
    let Err(JournalError::Differs(difference)) = replay(&out) else { panic!("it is the same") };
    let Difference { tick, actor, field, .. } = *difference;
    assert_eq!((tick, actor.unwrap().get(), field), (Tick(6), 1, "linear_velocity_mps"));
}

#[test]
fn a_command_that_is_missing_shows_in_the_actor_that_it_was_for() {
    let out = Shared::default();
    let mut world = world();
    let actor = world.apply(&car()).unwrap().unwrap();
    let mut journal = begun(&world, &out, 1 << 30);
    let control = VehicleControl { brake: 1.0, ..VehicleControl::default() };
    world.apply(&Command::Vehicle(VehicleCommand::Control { actor, control })).unwrap();
    world.tick().unwrap();
    journal.write(&tick_of(&world.frame())).unwrap();
    let Err(JournalError::Differs(difference)) = replay(&out) else { panic!("it is the same") };
    assert_eq!((difference.actor, difference.field), (Some(actor), "control"));
    assert!(difference.to_string().contains("brake: 1.0"), "{difference}");
}

#[test]
fn a_full_journal_ends_and_its_world_goes_on() {
    let out = Shared::default();
    let mut world = Recorded::new(world());
    world.run(id(), &[car()]);
    let probe = Shared::default();
    drop(begun(&world, &probe, 1 << 30));
    let head_bytes = probe.0.lock().unwrap().len() as u64;
    let journal = begun(&world, &out, head_bytes + 4_000);
    assert!(world.record(Some(Box::new(journal))).is_none());
    for _ in 0..20 {
        world.tick(id(), None).unwrap();
    }
    assert!(out.0.lock().unwrap().len() as u64 <= head_bytes + 4_000);
    let replayed = replay(&out).unwrap();
    assert!(replayed.ended && (1..20).contains(&replayed.last.0), "{replayed:?}");
    assert_eq!(world.tick_number(), Tick(20));
}

#[test]
fn a_journal_cut_anywhere_replays_up_to_there_and_a_damaged_one_is_refused() {
    let out = Shared::default();
    let mut world = world();
    world.apply(&car()).unwrap();
    let mut journal = begun(&world, &out, 1 << 30);
    for _ in 0..5 {
        world.tick().unwrap();
        journal.write(&tick_of(&world.frame())).unwrap();
    }
    let bytes = out.0.lock().unwrap().clone();
    let replayed = verify(&bytes[..bytes.len() - 100], |_| Ok(())).unwrap();
    assert_eq!((replayed.last, replayed.ended), (Tick(4), false));
    for at in [0, 9, bytes.len() / 2, bytes.len() - 50] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x20;
        assert!(
            matches!(verify(damaged.as_slice(), |_| Ok(())), Err(JournalError::Read(_))),
            "at {at}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn asked_over_the_bus_a_world_keeps_a_journal_in_the_folder() {
    let folder = Folder::new("journals");
    let journals = Some(Journals { folder: folder.0.clone(), bytes_max: 1 << 30 });
    let site = Site::open(Config { journals, ..config() }).await;
    let world = site.create(7, None).await.unwrap();
    let key = keys::world(&tenant(), world);
    let record = |on| Request::RecordWorld { world, on, name: None };
    for round in 1..=2 {
        site.client.request(&key, &record(true), deadline()).await.unwrap();
        site.tick(ticks(world, 10)).await.unwrap();
        site.client.request(&key, &record(false), deadline()).await.unwrap();
        let name = format!("world-{}-{round}.journal", world.get());
        let file = File::open(folder.0.join("local").join(name)).unwrap();
        let replayed = verify(BufReader::new(file), |_| Ok(())).unwrap();
        assert_eq!(replayed.last.0 - replayed.first.0, 10);
    }
    let site = Site::open(config()).await;
    let world = site.create(7, None).await.unwrap();
    let key = keys::world(&tenant(), world);
    let asked = Request::RecordWorld { world, on: true, name: None };
    let refused = site.client.request(&key, &asked, deadline()).await.unwrap_err();
    assert!(refused.wanted.contains("--journals"), "{refused}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn any_commands_are_replayed_to_the_bit(
        commands in prop::collection::vec((command(), 0usize..5), 1..30),
    ) {
        let out = Shared::default();
        let mut world = Recorded::new(world());
        let journal = begun(&world, &out, 1 << 30);
        assert!(world.record(Some(Box::new(journal))).is_none());
        for (command, ticks) in &commands {
            world.run(id(), std::slice::from_ref(command));
            for _ in 0..*ticks {
                world.tick(id(), None).unwrap();
            }
        }
        let last = world.tick_number();
        world.record(None).unwrap().end(Box::new(|| ()));
        prop_assert_eq!(replay(&out).unwrap().last, last);
    }
}
