//! The dispatcher against a world service that refuses nearly everything, and against its own page.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use schemas::WorldId;
use schemas::wire::encode_frame;
use schemas::{Error, ErrorCode, Frame, MapRef, Reply, TickOutcome, TickResult};

use super::table::{METHODS, State};
use super::*;
use crate::config::{Tyres, WorldConfig};
use crate::maps::Maps;
use crate::rpc::Payload;
use crate::site::{Later, Site};

/// One empty world on one small map, which is built once for all tests.
struct Toy;

static TOWN: LazyLock<(String, MapRef)> = LazyLock::new(|| {
    let xodr = roads::town::build("Town10HD").unwrap();
    let digest = roads::Map::parse("Town10HD", &xodr).unwrap().digest().to_owned();
    (xodr, MapRef { name: "Town10HD".to_owned(), digest })
});

impl Toy {
    fn frame(&self) -> schemas::EncodedFrame {
        let map = MapRef { name: "Town10HD".to_owned(), digest: "0".repeat(64) };
        encode_frame(&Frame::empty(WorldId::new(1).unwrap(), map))
    }
}

impl Site for Toy {
    fn announce_traffic_manager(&self, _: u16) {}

    fn ask(&self, request: schemas::Request) -> Later<'_, Reply> {
        let refusal = Error::new(ErrorCode::Unsupported, "a toy cannot do this");
        let world = WorldId::new(1).unwrap();
        let answer = match request {
            schemas::Request::ListMaps => Ok(Reply::Maps(vec![TOWN.1.clone()])),
            schemas::Request::CreateWorld { .. } => {
                Ok(Reply::WorldCreated { world, frame: self.frame(), replies: Vec::new() })
            }
            schemas::Request::DestroyWorld { .. } => Ok(Reply::Done),
            schemas::Request::DescribeActors { .. } => Ok(Reply::Actors(Vec::new())),
            schemas::Request::TickWorlds(items) => {
                let replies = items[0].commands.iter().map(|_| Err(refusal.clone())).collect();
                let outcome = TickOutcome { replies, ..TickOutcome::new(self.frame()) };
                Ok(Reply::Ticked(vec![TickResult { world, outcome: Ok(outcome) }]))
            }
            _ => Err(refusal),
        };
        Box::pin(std::future::ready(answer))
    }

    fn draw(&self, _: Frame, _: Vec<schemas::Camera>) -> Later<'_, Vec<schemas::Image>> {
        Box::pin(std::future::ready(Err(Error::new(ErrorCode::RendererUnavailable, "a toy"))))
    }

    fn map_text(&self, _digest: String) -> Later<'_, Vec<u8>> {
        Box::pin(std::future::ready(Ok(TOWN.0.clone().into_bytes())))
    }

    fn can_draw(&self) -> bool {
        false
    }
}

/// Never dropped, as a runtime may not be inside another.
static WORKERS: LazyLock<tokio::runtime::Runtime> = LazyLock::new(runtime);

fn endpoint() -> Endpoint {
    let site: Arc<dyn Site> = Arc::new(Toy);
    let config = WorldConfig {
        map: "Town10HD".to_owned(),
        seed: 0,
        tyres: Tyres::Real,
        period: std::time::Duration::from_secs(1),
        sync_lease: None,
        owner: "toy".parse().unwrap(),
    };
    let maps = Arc::new(Maps::new(Arc::clone(&site)));
    Endpoint::new(site, maps, config, 2000, WORKERS.handle().clone())
}

/// `[0, 1, method, params]` with params as given.
fn request(method: &str, params: &[u8]) -> Option<Request> {
    let mut bytes = vec![0x94, 0x00, 0x01, 0xd9, method.len() as u8];
    bytes.extend_from_slice(method.as_bytes());
    bytes.extend_from_slice(params);
    Request::parse(&bytes)
}

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap()
}

#[test]
fn all_128_calls_of_the_client_are_known_once() {
    let names: BTreeSet<&str> = METHODS.iter().map(|method| method.name).collect();
    assert_eq!((METHODS.len(), names.len()), (128, 128));
}

#[test]
fn every_call_has_an_answer_in_its_group() {
    runtime().block_on(async {
        let mut endpoint = endpoint();
        for method in METHODS {
            let request = request(method.name, &[0x91, 0x91, 0xc2]).unwrap();
            if let Err(refusal) = answer(&mut endpoint, &request).await {
                assert!(!refusal.0.contains("has no answer"), "{refusal}");
            }
        }
    });
}

#[test]
fn what_the_traffic_manager_calls_never_fails() {
    runtime().block_on(async {
        let mut endpoint = endpoint();
        endpoint.ensure_episode().await.unwrap();
        endpoint.note_loss("for a test");
        // Actor 77 exists nowhere.
        for (method, params) in [
            ("get_actor_bounding_box", &[0x92, 0x91, 0xc2, 77][..]),
            ("get_episode_settings", &[0x91, 0x91, 0xc2]),
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
fn an_unknown_call_is_named_in_the_refusal() {
    runtime().block_on(async {
        let request = request("fly_to_the_moon", &[0x91, 0x91, 0xc2]).unwrap();
        let refusal = answer(&mut endpoint(), &request).await.unwrap_err();
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
    let (runtime, shared) = (runtime(), RefCell::new(endpoint()));
    let mut runner = TestRunner::new(ProptestConfig::with_cases(cases));
    let outcome = runner.run(&arguments, |params| {
        let mut endpoint = shared.borrow_mut();
        for method in METHODS {
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

const TABLE_BEGINS: &str = "<!-- calls -->\n";
const TABLE_ENDS: &str = "<!-- end of calls -->\n";

/// The table of the compatibility page.
fn rendered() -> String {
    let mut table = String::from("| call | state | what differs |\n|---|---|---|\n");
    for method in METHODS {
        let (state, remark) = match method.state {
            State::Full => ("full", ""),
            State::Partial(what) => ("partial", what),
            State::Refused(why) => ("refused", why),
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
