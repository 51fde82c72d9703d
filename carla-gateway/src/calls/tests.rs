//! The dispatcher against a world service that does whatever it is told, and against its own page.

mod bones;
mod recordings;
mod toy;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;

use super::method::Service;
use super::*;
use crate::rpc::{Draw, Payload};
use toy::{Toy, runtime};

/// `[0, 1, method, params]` with params as given.
fn request(method: &str, params: &[u8]) -> Option<Request> {
    let mut bytes = vec![0x94, 0x00, 0x01, 0xd9, method.len() as u8];
    bytes.extend_from_slice(method.as_bytes());
    bytes.extend_from_slice(params);
    Request::parse(&bytes)
}

#[test]
fn all_133_calls_of_the_clients_are_known_once() {
    let names: BTreeSet<&str> = table::all().map(|method| method.name).collect();
    assert_eq!((table::all().count(), names.len()), (133, 133));
}

#[test]
fn what_the_traffic_manager_calls_never_fails() {
    runtime().block_on(async {
        let (mut endpoint, _) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        endpoint.note_loss("for a test");
        // Actor 77 exists nowhere.
        for (method, params) in [
            ("get_actor_bounding_box", &[0x92, 0x91, 0xc2, 77][..]),
            ("get_vehicle_light_states", &[0x91, 0x91, 0xc2]),
            ("get_weather_parameters", &[0x91, 0x91, 0xc2]),
            ("set_actor_simulate_physics", &[0x93, 0x91, 0xc2, 77, 0xc3]),
            ("apply_batch", &[0x93, 0x91, 0xc2, 0x91, 0x91, 0x92, 1, 0x91, 77, 0xc2]),
        ] {
            let answer = answer(&mut endpoint, &request(method, params).unwrap()).await;
            let is_bare = matches!(answer, Ok(Payload::Bare(_)));
            assert!(answer.is_ok(), "{method}: {answer:?}");
            assert_eq!(is_bare, method == "apply_batch");
        }
    });
}

#[test]
fn no_number_of_an_actor_or_stream_is_given_again_in_a_new_world() {
    runtime().block_on(async {
        let (mut endpoint, toy) = Toy::endpoint();
        let camera = schemas::ActorId::new(5).unwrap();
        let mut streams = BTreeSet::new();
        for count in 1..4 {
            let given = toy.newest_actor.load(Ordering::Relaxed);
            endpoint.load("", u16::MAX).await.unwrap();
            assert_eq!(toy.first_actor.load(Ordering::Relaxed), given + 1);
            streams.extend(endpoint.episode().unwrap().stream(camera));
            assert_eq!(streams.len(), count);
        }
    });
}

#[test]
fn a_world_on_another_version_of_the_map_is_refused_and_the_episode_goes_on() {
    runtime().block_on(async {
        let (mut endpoint, toy) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        toy.has_other_map.store(true, Ordering::Relaxed);
        let refusal = endpoint.load("", u16::MAX).await.unwrap_err();
        assert!(refusal.0.contains("another version of the map Town10HD"), "{}", refusal.0);
        assert_eq!(endpoint.episodes_begun, 1);
        endpoint.tick().await.unwrap();
    });
}

#[test]
fn what_was_done_in_a_world_that_is_lost_is_done_again_in_the_next() {
    runtime().block_on(async {
        let (mut endpoint, toy) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        let destroy = |actor| schemas::Command::DestroyActor { actor };
        for actor in [3, 4].map(|actor| schemas::ActorId::new(actor).unwrap()) {
            endpoint.run_now(vec![destroy(actor)]).await.unwrap();
            endpoint.tick().await.unwrap();
        }
        let (commands, ticks) = toy.done();
        assert!(commands.len() > 2 && ticks == 2, "{commands:?}");
        toy.crash();
        let frame_number = endpoint.tick().await.unwrap();
        assert_eq!(frame_number, endpoint.frame_number);
        assert_eq!(toy.done(), (commands, ticks + 1));
        // Also after more than one state is good for.
        for _ in 0..=worlds::RECOVERY_TICKS {
            endpoint.tick().await.unwrap();
        }
        toy.crash();
        endpoint.tick().await.unwrap();
        assert!(toy.done().1 < 10, "all of it is repeated");
        assert!(endpoint.lost.is_none());
    });
}

#[test]
fn a_world_that_nobody_has_room_for_at_first_comes_back() {
    runtime().block_on(async {
        let (mut endpoint, toy) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        toy.crash();
        toy.refusals.store(2, Ordering::Relaxed);
        endpoint.tick().await.unwrap();
        assert_eq!(toy.refusals.load(Ordering::Relaxed), 0);
        assert!(endpoint.lost.is_none());
    });
}

#[test]
fn what_waits_for_a_tick_that_is_refused_waits_for_the_next() {
    let destroy = |actor| {
        let actor = schemas::ActorId::new(actor).unwrap();
        schemas::Command::DestroyActor { actor }
    };
    runtime().block_on(async {
        let (mut endpoint, toy) = Toy::endpoint();
        endpoint.ensure_episode().await.unwrap();
        endpoint.queue(destroy(3)).await.unwrap();
        toy.busy.store(2, Ordering::Relaxed);
        assert!(endpoint.tick().await.is_err());
        // Whoever is told that a command was not carried out does not find it done later.
        assert!(endpoint.run_now(vec![destroy(4)]).await.is_err());
        endpoint.tick().await.unwrap();
        let is_destroyed =
            |command: &schemas::Command| matches!(command, schemas::Command::DestroyActor { .. });
        let (mut done, ticks) = toy.done();
        done.retain(is_destroyed);
        assert_eq!((done, ticks), (vec![destroy(3)], 1));
    });
}

#[test]
fn an_unknown_call_is_named_in_the_refusal() {
    runtime().block_on(async {
        let request = request("fly_to_the_moon", &[0x91, 0x91, 0xc2]).unwrap();
        let refusal = answer(&mut Toy::endpoint().0, &request).await.unwrap_err();
        assert!(refusal.0.contains("fly_to_the_moon"));
    });
}

/// MessagePack of any shape.
fn shape() -> impl Strategy<Value = Vec<u8>> {
    fn headed(head: &[u8], body: &[u8]) -> Vec<u8> {
        [head, body].concat()
    }
    let leaf = prop_oneof![
        proptest::sample::select(vec![0xc0, 0xc2, 0xc3, 0x00, 0x01, 0x7f, 0xff])
            .prop_map(|byte| vec![byte]),
        any::<u32>().prop_map(|number| headed(&[0xce], &number.to_be_bytes())),
        any::<i64>().prop_map(|number| headed(&[0xd3], &number.to_be_bytes())),
        any::<f32>().prop_map(|number| headed(&[0xca], &number.to_be_bytes())),
        any::<f64>().prop_map(|number| headed(&[0xcb], &number.to_be_bytes())),
        "[a-z.*]{0,20}".prop_map(|text| headed(&[0xd9, text.len() as u8], text.as_bytes())),
        proptest::collection::vec(any::<u8>(), 0..20)
            .prop_map(|bytes| headed(&[0xc4, bytes.len() as u8], &bytes)),
    ];
    leaf.prop_recursive(4, 48, 6, |part| {
        proptest::collection::vec(part, 0..7)
            .prop_map(|parts| headed(&[0x90 | parts.len() as u8], &parts.concat()))
    })
}

/// Any answer will do; what counts is that there is one.
fn every_call_is_answered(arguments: impl Strategy<Value = Vec<u8>>, cases: u32) {
    let (runtime, shared) = (runtime(), RefCell::new(Toy::endpoint().0));
    let mut runner = TestRunner::new(ProptestConfig::with_cases(cases));
    let outcome = runner.run(&arguments, |params| {
        let mut endpoint = shared.borrow_mut();
        for method in table::all() {
            if let Some(request) = request(method.name, &params) {
                let _ = runtime.block_on(answer(&mut endpoint, &request));
            }
        }
        Ok(())
    });
    outcome.unwrap();
}

#[test]
fn no_arguments_break_the_dispatcher() {
    let noise = proptest::collection::vec(any::<u8>(), 0..64);
    every_call_is_answered(noise.prop_map(|noise| [&[0x94, 0x91, 0xc2], &noise[..]].concat()), 64);
}

#[test]
fn arguments_of_any_shape_are_answered() {
    let shapes = proptest::collection::vec(shape(), 0..7);
    let params = shapes
        .prop_map(|parts| [&[0x91 + parts.len() as u8, 0x91, 0xc2], &parts.concat()[..]].concat());
    every_call_is_answered(params, 128);
}

/// Calls that do something, by name.
fn served() -> impl Iterator<Item = &'static str> {
    table::all()
        .filter(|method| matches!(method.service, Service::Full(_) | Service::Partial(..)))
        .map(|method| method.name)
}

/// What clients and the world could notice of a call.
fn everything(endpoint: &Endpoint, toy: &Toy) -> String {
    let known = |id: u32| endpoint.episode.as_ref()?.state(schemas::ActorId::new(id)?);
    let states: Vec<_> = (1..64).map(known).collect();
    format!(
        "{:?}",
        (
            (endpoint.settings(), &endpoint.weather, endpoint.imui_gravity_mps2),
            (endpoint.episodes_begun, endpoint.frame_number, &endpoint.lost),
            (&endpoint.pending, endpoint.shapes.len(), states),
            (toy.count_done(), toy.newest_actor.load(Ordering::Relaxed)),
        )
    )
}

/// Draws of the arguments of each call.
const ROUNDS: u64 = 64;
/// The name of a file or thing that is there is never drawn.
const NEVER_DRAWN: [&str; 3] =
    ["apply_color_texture_to_objects", "apply_float_color_texture_to_objects", "request_file"];

#[test]
fn calls_with_arguments_of_their_types_are_mostly_carried_out() {
    let (runtime, (mut endpoint, toy)) = (runtime(), Toy::endpoint());
    runtime.block_on(endpoint.ensure_episode()).unwrap();
    let mut accepted: BTreeMap<&str, u64> = BTreeMap::new();
    for (name, seed) in served().flat_map(|name| (0..ROUNDS).map(move |seed| (name, seed))) {
        // Those that a call before has destroyed are there again.
        runtime.block_on(endpoint.learn(Vec::new())).unwrap();
        let request = Request::drawn(name, Draw { seed, ..Draw::default() });
        let before = everything(&endpoint, &toy);
        let answer = runtime.block_on(answer(&mut endpoint, &request));
        if answer.is_err() {
            assert_eq!(everything(&endpoint, &toy), before, "{name}, draw {seed}, is refused");
        }
        *accepted.entry(name).or_default() += u64::from(answer.is_ok());
        if let Some(later) = endpoint.report(answer).later {
            let _ = runtime.block_on(later).unwrap();
        }
        runtime.block_on(endpoint.flush()).unwrap();
    }
    assert_eq!(toy.garbled.load(Ordering::Relaxed), 0, "requests that no world service reads");
    let never = accepted.iter().filter(|(_, count)| **count == 0).map(|(name, _)| *name);
    assert_eq!(never.collect::<Vec<_>>(), NEVER_DRAWN);
    let share = accepted.values().sum::<u64>() as f64 / (ROUNDS * accepted.len() as u64) as f64;
    assert!(share > 0.5, "{share:.2} of the calls were carried out: {accepted:?}");
}

/// Spoils one float after the other, in a few draws of the arguments of each call.
#[test]
fn no_call_takes_a_number_that_is_not_finite_in_any_of_its_fields() {
    const DRAWS: u64 = 6;
    let (runtime, (mut endpoint, toy)) = (runtime(), Toy::endpoint());
    runtime.block_on(endpoint.ensure_episode()).unwrap();
    let mut spoilt_calls: BTreeSet<&str> = BTreeSet::new();
    let drawn = served().flat_map(|name| (0..DRAWS).map(move |seed| (name, seed)));
    for (name, seed) in drawn {
        let counting = Draw { seed, ..Draw::default() };
        let float_count = Arc::clone(&counting.float_count);
        let _ = runtime.block_on(answer(&mut endpoint, &Request::drawn(name, counting)));
        for at in 0..float_count.load(Ordering::Relaxed) {
            for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let draw = Draw { seed, spoilt: Some((at, number)), ..Draw::default() };
                let before = everything(&endpoint, &toy);
                let answer = runtime.block_on(answer(&mut endpoint, &Request::drawn(name, draw)));
                if answer.is_err() {
                    let after = everything(&endpoint, &toy);
                    assert_eq!(after, before, "{name}, float {at} of draw {seed}: {number}");
                }
                assert!(is_refused(&answer), "{name}, float {at} of draw {seed}: {number}");
                spoilt_calls.insert(name);
            }
        }
        runtime.block_on(endpoint.tick()).unwrap();
    }
    assert_eq!(toy.garbled.load(Ordering::Relaxed), 0);
    assert!(spoilt_calls.len() >= 28, "few calls have floats: {spoilt_calls:?}");
}

/// Whether a call is refused, or one of the commands of a batch.
fn is_refused(answer: &Answer) -> bool {
    match answer {
        Err(_) => true,
        Ok(Payload::Bare(bytes)) => {
            String::from_utf8_lossy(bytes).contains("numbers are not all finite")
        }
        // Its refusals must not reach a Traffic Manager.
        Ok(_) => false,
    }
}

const TABLE_BEGINS: &str = "<!-- calls -->\n";
const TABLE_ENDS: &str = "<!-- end of calls -->\n";

/// The table of the compatibility page.
fn rendered() -> String {
    let mut table = String::from("| call | state | what differs |\n|---|---|---|\n");
    for method in table::all() {
        let (state, remark) = match method.service {
            Service::Full(_) | Service::ByLobby => ("full", ""),
            Service::Partial(_, what) => ("partial", what),
            Service::Refused(why) => ("refused", why),
        };
        // Writing into a String cannot fail.
        let _ = writeln!(table, "| `{}` | {state} | {remark} |", method.name);
    }
    table
}

#[test]
fn the_compatibility_page_says_what_the_table_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/carla-compatibility.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (head, rest) = page.split_once(TABLE_BEGINS).unwrap();
    let (found, tail) = rest.split_once(TABLE_ENDS).unwrap();
    if std::env::var_os("UPDATE_PAGES").is_some() {
        let fresh = format!("{head}{TABLE_BEGINS}{}{TABLE_ENDS}{tail}", rendered());
        std::fs::write(&path, fresh).unwrap();
        return;
    }
    assert_eq!(found, rendered(), "run this test once with UPDATE_PAGES=1");
}
