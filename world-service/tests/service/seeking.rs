//! Any tick of a journal is found, also of one that is cut, and a world goes on from there.

use std::io::Cursor;

use schemas::wire::decode_frame;
use schemas::{
    ActorId, AgentCommand, AgentOptions, Command, ErrorCode, Reply, Request, Tick, TickItem,
    VehicleCommand, VehicleControl, WorldId, keys,
};
use world_service::journal::{Entry, Head, JournalError, Moment, Reader, Replay, cut, verify};
use world_service::service::Recorded;
use world_service::{Config, Journals};

use crate::common::{Site, car, config, deadline, decoded, tenant, ticks};
use crate::journals::{Folder, begun, id, tick_of, world};
use crate::shard::Shared;

/// A tick that no keyframe is at, and the last one.
const MIDDLE: u64 = 77;
const LAST: u64 = 130;
/// Where a journal that is written by hand has them.
const KEYFRAMES: [u64; 3] = [20, 65, 78];
/// From one keyframe to the next there are at most so many ticks, and at least so many.
const APART_MAX: u64 = 100;
const APART_MIN: u64 = 10;

fn steer(by: f32) -> Command {
    let control = VehicleControl { throttle: 0.5, steer: by, ..VehicleControl::default() };
    Command::Vehicle(VehicleCommand::Control { actor: ActorId::FIRST, control })
}

/// A journal of a car that is steered, and the hash of the state after each tick.
fn driven() -> (Vec<u8>, Vec<u64>) {
    let out = Shared::default();
    let mut world = Recorded::new(world());
    world.run(id(), &[car()]);
    let journal = begun(&world, &out, 1 << 30);
    assert!(world.record(Some(Box::new(journal))).is_none());
    let mut hashes = vec![world.frame().state_hash];
    for tick in 0..LAST {
        world.run(id(), &[steer((tick % 7) as f32 / 10.0 - 0.3)]);
        world.tick(id(), None).unwrap();
        hashes.push(world.frame().state_hash);
    }
    world.record(None).unwrap().end(Box::new(|| ()));
    let bytes = out.0.lock().unwrap().clone();
    (bytes, hashes)
}

fn open(bytes: &[u8]) -> Reader<Cursor<&[u8]>> {
    Reader::open(Cursor::new(bytes)).unwrap()
}

/// How many commands and ticks lead to each tick of a journal, from the first on.
fn steps(reader: &mut Reader<Cursor<&[u8]>>) -> Vec<u64> {
    let steps = |tick| reader.way_to(Tick(tick)).unwrap().steps.len() as u64;
    (0..=LAST).map(steps).collect()
}

#[test]
fn any_tick_is_a_few_ticks_from_a_keyframe() {
    let (bytes, _) = driven();
    let mut reader = open(&bytes);
    let steps = steps(&mut reader);
    // How many keyframes there are depends on how fast the machine is.
    let keyframes: Vec<u64> = (0..=LAST).filter(|tick| steps[*tick as usize] == 0).collect();
    assert_eq!(keyframes.len(), 1 + reader.index().keyframe_count(), "{keyframes:?}");
    assert!(keyframes.len() > 1 && keyframes[0] == 0, "{keyframes:?}");
    for pair in keyframes.windows(2) {
        assert!((APART_MIN..=APART_MAX).contains(&(pair[1] - pair[0])), "{keyframes:?}");
    }
    assert!(LAST - keyframes[keyframes.len() - 1] < APART_MAX, "{keyframes:?}");
}

#[test]
fn every_tick_is_sought_from_the_last_keyframe_before_it() {
    let (mut world, out) = (world(), Shared::default());
    world.apply(&car()).unwrap();
    let mut journal = begun(&world, &out, 1 << 30);
    let mut hashes = vec![world.state_hash()];
    for tick in 1..=LAST {
        let command = steer((tick % 7) as f32 / 10.0 - 0.3);
        world.apply(&command).unwrap();
        journal.write(&Entry::commands(id(), vec![command])).unwrap();
        world.tick().unwrap();
        let frame = world.frame();
        journal.write(&tick_of(&frame)).unwrap();
        if KEYFRAMES.contains(&tick) {
            let (moment, snapshot) = (Moment::of(&frame), world.snapshot());
            journal.write(&Entry::Keyframe { moment, snapshot }).unwrap();
        }
        hashes.push(frame.state_hash);
    }
    journal.finish().unwrap();
    let bytes = out.0.lock().unwrap().clone();
    let mut reader = open(&bytes);
    assert_eq!((reader.index().last(), reader.index().keyframe_count()), (Tick(LAST), 3));
    // Commands and a tick each.
    let last_before = |tick: u64| KEYFRAMES.into_iter().filter(|at| *at <= tick).max().unwrap_or(0);
    let wanted: Vec<u64> = (0..=LAST).map(|tick| 2 * (tick - last_before(tick))).collect();
    assert_eq!(steps(&mut reader), wanted);
    let mut replay = Replay::begin(reader.head()).unwrap();
    for tick in [LAST, 0, 1, MIDDLE, KEYFRAMES[0], KEYFRAMES[1] - 1, KEYFRAMES[1] + 1] {
        let way = reader.way_to(Tick(tick)).unwrap();
        replay.go(&way).unwrap();
        let found = replay.world().frame();
        assert_eq!((found.tick, found.state_hash), (Tick(tick), hashes[tick as usize]));
        assert_eq!(way.to.state_hash, found.state_hash);
        if tick > 0 {
            let frame = decode_frame(&reader.frame(Tick(tick)).unwrap().0).unwrap();
            assert_eq!(frame.state_hash, found.state_hash);
            let secs = reader.index().elapsed_secs(Tick(tick)).unwrap();
            assert_eq!(reader.index().tick_at(secs), Tick(tick));
        }
    }
    let JournalError::Part(refused) = reader.way_to(Tick(LAST + 1)).unwrap_err() else {
        panic!("an error of another kind")
    };
    assert_eq!(refused.code, ErrorCode::WrongTick);
}

#[test]
fn a_journal_that_is_cut_or_has_a_damaged_index_is_found_through_all_the_same() {
    let (bytes, hashes) = driven();
    let whole = open(&bytes);
    let mut damaged = bytes.clone();
    let last = damaged.len() - 5;
    damaged[last] ^= 1;
    let found = open(&damaged);
    assert_eq!((found.index(), found.is_ended()), (whole.index(), true));
    let mut found = open(&bytes[..bytes.len() - 10_000]);
    let last = found.index().last();
    assert!(!found.is_ended() && Tick(0) < last && last < Tick(LAST), "{last}");
    let mut replay = Replay::begin(found.head()).unwrap();
    replay.go(&found.way_to(last).unwrap()).unwrap();
    assert_eq!(replay.world().state_hash(), hashes[last.0 as usize]);
}

#[test]
fn a_piece_of_a_journal_is_a_journal() {
    let (bytes, hashes) = driven();
    let mut told = 0;
    let piece = cut(&mut open(&bytes), (Tick(30), Tick(90)), Vec::new(), |ticks| told = ticks);
    let piece = piece.unwrap();
    let replayed = verify(piece.as_slice(), |_| Ok(())).unwrap();
    assert_eq!((replayed.first, replayed.last, told), (Tick(30), Tick(90), 60));
    assert!(replayed.ended && piece.len() < bytes.len());
    let mut reader = open(&piece);
    assert_eq!(reader.tick(Tick(90)).unwrap().moment.state_hash, hashes[90]);
    assert!(cut(&mut open(&bytes), (Tick(0), Tick(LAST + 1)), Vec::new(), |_| ()).is_err());
}

#[test]
fn bytes_that_are_no_journal_are_refused_without_a_panic() {
    let (bytes, _) = driven();
    let mut seed = 1u64;
    for _ in 0..300 {
        let mut hostile = bytes.clone();
        for _ in 0..4 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Heads of chunks are at the end as well: most of it is one frame after the other.
            let back = (seed >> 33) as usize % 6_000;
            let at = hostile.len() - 1 - back.min(hostile.len() - 1);
            hostile[at] ^= 1 << (seed % 8);
        }
        if let Ok(mut reader) = Reader::open(Cursor::new(&hostile)) {
            let _ = reader.way_to(reader.index().last());
            let _ = reader.tick(Tick(LAST));
        }
    }
    let older = [b"CWJL\x01\0\0\0".as_slice(), &bytes[8..]].concat();
    let refused = Reader::open(Cursor::new(&older)).err().unwrap().to_string();
    assert!(refused.contains("version 2"), "{refused}");
    assert!(Reader::open(Cursor::new(b"CARLA")).is_err());
    assert_ne!(Head::default().digest(), open(&bytes).head().digest());
}

/// A site that has the journal `runs/a.journal` of 50 ticks, and the world that it is of.
async fn recorded(folder: &Folder) -> (Site, WorldId, Vec<u64>) {
    let journals = Some(Journals { folder: folder.0.clone(), bytes_max: 1 << 30 });
    let site = Site::open(Config { journals, ..config() }).await;
    let world = site.create(7, None).await.unwrap();
    let key = keys::world(&tenant(), world);
    let on = Request::RecordWorld { world, on: true, name: Some("runs/a.journal".to_owned()) };
    let Reply::JournalBegun { name, tick, state_hash, .. } =
        site.client.request(&key, &on, deadline()).await.unwrap()
    else {
        panic!("no journal")
    };
    assert_eq!((name.as_str(), tick), ("runs/a.journal", Tick(0)));
    let mut hashes = vec![state_hash];
    for number in 0..50u16 {
        let agent = AgentOptions::default();
        let wander = AgentCommand::Set { actor: ActorId::FIRST, options: agent, keep_route: false };
        let commands = match number {
            10 => vec![Command::Agent(wander)],
            _ => vec![steer(f32::from(number) / 100.0)],
        };
        let item = TickItem { commands, ..ticks(world, 1) };
        hashes.push(decoded(&site.tick(item).await.unwrap().frame).state_hash);
    }
    let off = Request::RecordWorld { world, on: false, name: None };
    site.client.request(&key, &off, deadline()).await.unwrap();
    (site, world, hashes)
}

fn branch(name: &str, tick: Option<u64>) -> Request {
    Request::BranchJournal { name: name.to_owned(), tick: tick.map(Tick), lease: None }
}

#[tokio::test(flavor = "multi_thread")]
async fn branches_begin_as_recorded_and_go_on_alike() {
    let folder = Folder::new("branches");
    let (site, world, hashes) = recorded(&folder).await;
    for tick in [0, 33, 50] {
        let mut ends = Vec::new();
        for _ in 0..2 {
            let asked = branch("runs/a.journal", Some(tick));
            let Reply::WorldCreated { world: copy, frame, .. } = site.ask(&asked).await.unwrap()
            else {
                panic!("no world")
            };
            let first = decoded(&frame);
            assert_eq!((first.tick, first.state_hash), (Tick(tick), hashes[tick as usize]));
            assert!(first.world == copy && copy != world);
            let item = TickItem { commands: vec![steer(-0.4)], ..ticks(copy, 40) };
            ends.push(decoded(&site.tick(item).await.unwrap().frame).state_hash);
        }
        assert_eq!(ends[0], ends[1]);
    }
    let last = site.ask(&branch("runs/a.journal", None)).await.unwrap();
    assert!(matches!(last, Reply::WorldCreated { .. }));
}

#[tokio::test(flavor = "multi_thread")]
async fn branches_of_what_is_not_there_are_refused() {
    let folder = Folder::new("no-branches");
    let (site, world, _) = recorded(&folder).await;
    std::fs::write(folder.0.join("local/notes.journal"), "notes of somebody").unwrap();
    let cases = [
        (branch("runs/a.journal", Some(51)), ErrorCode::WrongTick),
        (branch("runs/b.journal", None), ErrorCode::UnknownAsset),
        (branch("../local/runs/a.journal", None), ErrorCode::InvalidArgument),
        (branch("notes.journal", None), ErrorCode::InvalidArgument),
    ];
    for (request, code) in cases {
        assert_eq!(site.ask(&request).await.unwrap_err().code, code, "{request:?}");
    }
    let key = keys::worlds(&"other".parse().unwrap());
    let theirs = branch("runs/a.journal", None);
    let refused = site.client.request(&key, &theirs, deadline()).await.unwrap_err();
    assert_eq!(refused.code, ErrorCode::UnknownAsset);
    let name = Some("notes.journal".to_owned());
    let replace = Request::RecordWorld { world, on: true, name };
    let key = keys::world(&tenant(), world);
    assert!(site.client.request(&key, &replace, deadline()).await.is_err());
    let notes = std::fs::read_to_string(folder.0.join("local/notes.journal")).unwrap();
    assert_eq!(notes, "notes of somebody");
}
