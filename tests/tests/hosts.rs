//! Goal: several world services on one bus are as good as one.
//! Method: give each worlds and a map of its own, and ask all of them in turn.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::net::TcpListener;

use schemas::{ActorId, ErrorCode, Reply, Request, ServiceId, TickItem, WorldId};
use serde_json::json;
use tests::{Probe, Process, SOON, Session, eventually, get};

const WORLDS_OF_EACH: usize = 3;

/// A straight road of 100 m.
const ROAD: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="mine"/>
  <road name="" length="100" id="1" junction="-1">
    <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="3.5" b="0" c="0" d="0"/>
      </lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;

/// World services on a router, and a look at their bus.
struct Hosts {
    names: Vec<ServiceId>,
    bus: String,
    probe: Probe,
    _processes: Vec<Process>,
}

impl Hosts {
    fn start() -> Self {
        let router = Process::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
        let bus = router.wait_for_line("router's address", |line| {
            line.split_whitespace().find(|word| word.starts_with("tcp/")).map(str::to_owned)
        });
        let names = ["world-a", "world-b", "world-c"];
        let start = |name: &&str| Process::start(&["world", "--connect", &bus, "--id", name]);
        let processes = std::iter::once(router).chain(names.iter().map(start)).collect();
        let probe = Probe::open(bus.parse().unwrap());
        let names: Vec<ServiceId> = names.iter().map(|name| name.parse().unwrap()).collect();
        for name in &names {
            eventually("world service", SOON, || probe.ask_host(name, &Request::ListMaps));
        }
        Self { names, bus, probe, _processes: processes }
    }

    fn create(&self, host: &ServiceId, map: &str) -> WorldId {
        let create = Request::CreateWorld {
            map: map.to_owned(),
            seed: 1,
            dt_secs: 0.05,
            commands: Vec::new(),
            lease: None,
            traffic: false,
            first_actor: ActorId::FIRST,
        };
        match self.probe.ask_host(host, &create) {
            Ok(Reply::WorldCreated { world, .. }) => world,
            other => panic!("no world: {other:?}"),
        }
    }

    fn tick(&self, world: WorldId) {
        let tick = Request::TickWorlds(vec![TickItem::new(world, 1)]);
        match self.probe.ask_world(world, &tick) {
            Ok(Reply::Ticked(results)) => assert!(results[0].outcome.is_ok(), "{results:?}"),
            other => panic!("no tick: {other:?}"),
        }
    }
}

#[test]
fn a_request_finds_the_service_that_has_the_world() {
    let hosts = Hosts::start();
    let mut worlds = Vec::new();
    for _ in 0..WORLDS_OF_EACH {
        worlds.extend(hosts.names.iter().map(|name| hosts.create(name, "Town02")));
    }
    for _ in 0..5 {
        worlds.iter().for_each(|world| hosts.tick(*world));
    }
    for name in &hosts.names {
        let Ok(Reply::Worlds(infos)) = hosts.probe.ask_host(name, &Request::ListWorlds) else {
            panic!("no list of worlds")
        };
        let ticks: Vec<u64> = infos.iter().map(|info| info.tick.0).collect();
        assert_eq!(ticks, [5; WORLDS_OF_EACH], "{name}");
    }
    let gone = worlds[1];
    assert_eq!(
        hosts.probe.ask_world(gone, &Request::DestroyWorld { world: gone }),
        Ok(Reply::Done)
    );
    let refusal = hosts.probe.ask_world(gone, &Request::SnapshotWorld { world: gone });
    assert_eq!(refusal.unwrap_err().code, ErrorCode::UnknownWorld);
}

#[test]
fn a_map_that_only_one_service_has_is_found() {
    let hosts = Hosts::start();
    let maps = hosts.names.iter().map(|host| {
        let text = ROAD.replace("mine", host.as_str());
        let put = Request::PutMap { name: "mine".to_owned(), text: text.clone() };
        hosts.probe.ask_host(host, &put).unwrap();
        let Ok(Reply::Maps(maps)) = hosts.probe.ask_host(host, &Request::ListMaps) else {
            panic!("no maps")
        };
        (maps.into_iter().find(|map| map.name == "mine").unwrap().digest, text)
    });
    for (digest, text) in maps.collect::<Vec<_>>() {
        assert_eq!(hosts.probe.asset(&digest).unwrap(), text.into_bytes());
    }
    let nobody = hosts.probe.asset(&"0".repeat(64)).unwrap_err();
    assert_eq!(nobody.code, ErrorCode::UnknownAsset, "{nobody}");
}

#[test]
fn the_worlds_of_all_services_are_listed() {
    let hosts = Hosts::start();
    let mut worlds: Vec<u64> =
        hosts.names.iter().map(|name| hosts.create(name, "Town02").get()).collect();
    worlds.sort_unstable();
    let mut list = Process::start(&["record", "worlds", "--connect", &hosts.bus]);
    assert!(list.wait(SOON).success(), "{}", list.log());
    let log = list.log();
    let listed: Option<Vec<u64>> =
        log.lines().map(|line| line.split_whitespace().next()?.parse().ok()).collect();
    assert_eq!(listed, Some(worlds), "{log}");
}

#[test]
fn a_second_service_of_the_same_name_ends_with_a_line_that_says_so() {
    let hosts = Hosts::start();
    let mut second = Process::start(&["world", "--connect", &hosts.bus, "--id", "world-b"]);
    assert_eq!(second.wait(SOON).code(), Some(1), "{}", second.log());
    let told = |line: &str| line.contains("\"world-b\"") && line.contains("--id");
    second.wait_for_line("the name and the flag", |line| told(line).then_some(()));
    let world = hosts.create(&hosts.names[1], "Town02");
    hosts.tick(world);
}

#[test]
fn sessions_of_two_faces_drive_beside_each_other() {
    let hosts = Hosts::start();
    let mut faces = Vec::new();
    for name in ["face-a", "face-b"] {
        let http = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let flags = ["scenario", "--connect", &hosts.bus, "--id", name];
        let process = Process::start(&[&flags[..], &["--http", &http.to_string()]].concat());
        eventually("healthy face", SOON, || {
            get(http, "/health").map_err(|error| error.to_string())
        });
        faces.push((process, http));
    }
    let mut sessions: Vec<Session> =
        faces.iter().flat_map(|(_, http)| [Session::open(*http), Session::open(*http)]).collect();
    for session in &mut sessions {
        session.reset(json!({"scenario_name": "trolley_saves", "seed": 1}));
    }
    for step in 1..=10 {
        for session in &mut sessions {
            let answer = session.step(json!({"action_type": "observe"}));
            assert_eq!(answer["observation"]["step_number"], step);
        }
    }
}
