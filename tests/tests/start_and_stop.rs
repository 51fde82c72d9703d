//! Goal: one command starts a site, one signal ends it, and what cannot work says so in one line.
//! Method: the real program on free ports.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::net::TcpListener;
use std::time::{Duration, Instant};

use rustix::process::kill_process;
use schemas::ServiceKind;
use serde_json::json;
use tests::{Process, SOON, Service, Session, Signal, Site, eventually, get, is_running};

/// Ten times the promise to a person who presses Ctrl-C, for a busy machine.
const END_WITHIN: Duration = Duration::from_secs(30);
/// How long the first Ctrl-C waits for a service that hangs.
const GRACE: Duration = Duration::from_secs(2);

fn trolley() -> serde_json::Value {
    json!({"scenario_name": "trolley_saves", "seed": 1})
}

/// Checks that a command ends at once with exit code 2 and one line that holds all `words`.
fn assert_refused(arguments: &[&str], words: &[&str]) {
    let mut process = Process::start(arguments);
    let status = process.wait(SOON);
    let log = process.wait_for_line("refusal", |line| Some(line.to_owned()));
    assert_eq!(status.code(), Some(2), "{log}");
    assert_eq!(process.log().lines().count(), 1, "{}", process.log());
    for word in words {
        assert!(log.contains(word), "{word:?} is not in {log:?}");
    }
}

#[test]
fn a_site_answers_health_and_a_reset() {
    let site = Site::without_renderer();
    let first = site.session().reset(trolley());
    assert_eq!(first["observation"]["scenario_name"], "trolley_saves");
    assert_eq!(first["done"], false);
}

#[test]
fn ctrl_c_ends_every_process() {
    let mut site = Site::start(&[]);
    site.session().reset(trolley());
    let children = site.process().children();
    assert_eq!(children.len(), 4, "{children:?}");
    site.process().signal(Signal::INT);
    let status = site.process().wait(END_WITHIN);
    assert_eq!(status.code(), Some(0), "{}", site.process().log());
    for (pid, command) in children {
        assert!(!is_running(pid), "{command} still runs");
    }
}

#[test]
fn a_service_that_hangs_is_killed_in_the_same_time() {
    let mut site = Site::without_renderer();
    let hanging = site.pid(Service::World);
    kill_process(hanging, Signal::STOP).unwrap();
    site.process().signal(Signal::TERM);
    site.process().wait(END_WITHIN);
    assert!(!is_running(hanging));
}

#[test]
fn a_second_ctrl_c_does_not_wait_for_a_service_that_hangs() {
    let mut site = Site::without_renderer();
    let hanging = site.pid(Service::World);
    // Who is still on the way to the bus would wait for the world as well.
    eventually("all services", SOON, || {
        let log = site.process().log();
        let is_up =
            |service| log.lines().any(|line| line.contains(service) && line.contains("up after"));
        if is_up("scenario-1") && is_up("gateway-1") { Ok(()) } else { Err(log) }
    });
    kill_process(hanging, Signal::STOP).unwrap();
    let started = Instant::now();
    site.process().signal(Signal::INT);
    eventually("orderly end of the other service", SOON, || {
        let left = site.process().children();
        if left.len() == 1 { Ok(()) } else { Err(left) }
    });
    let was_hanging = is_running(hanging) && started.elapsed() < GRACE / 2;
    site.process().signal(Signal::INT);
    site.process().wait(END_WITHIN);
    assert!(!is_running(hanging));
    // On a machine that is too slow to tell, the first signal may have ended it.
    assert!(!was_hanging || started.elapsed() < GRACE, "{:?}", started.elapsed());
}

#[test]
fn services_end_when_the_supervisor_is_killed() {
    let mut site = Site::start(&[]);
    let children = site.process().children();
    assert_eq!(children.len(), 4, "{children:?}");
    site.process().signal(Signal::KILL);
    eventually("end of all services", END_WITHIN, || {
        let left: Vec<_> = children.iter().filter(|(pid, _)| is_running(*pid)).collect();
        if left.is_empty() { Ok(()) } else { Err(format!("{left:?}")) }
    });
}

#[test]
fn a_taken_port_of_the_bus_is_one_line_with_the_flag_that_chooses_another() {
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = holder.local_addr().unwrap().to_string();
    let bus = format!("tcp/{taken}");
    assert_refused(
        &["up", "--carla", "0", "--http", "127.0.0.1:0", "--bus", &bus],
        &[&bus, "--bus"],
    );
}

#[test]
fn a_site_starts_while_another_program_has_the_port_of_the_face_and_takes_it_when_it_is_free() {
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = holder.local_addr().unwrap();
    let ports = ["up", "--no-render", "--bus", "tcp/127.0.0.1:0", "--carla", "0", "--http"];
    let site = Process::start(&[&ports[..], &[&taken.to_string()]].concat());
    site.wait_for_line("the reason why nobody comes in", |line| {
        (line.contains("another program has the port") && line.contains("--http")).then_some(())
    });
    drop(holder);
    eventually("healthy site", SOON, || get(taken, "/health").map_err(|error| error.to_string()));
}

#[test]
fn a_service_that_dies_again_and_again_ends_nothing_else() {
    let mut site = Site::without_renderer();
    for _ in 0..7 {
        site.kill(Service::Scenario);
        eventually("process that is no more", SOON, || {
            let children = site.process().children();
            let left = children.iter().any(|(_, command)| command.contains(" scenario "));
            if left { Err(children) } else { Ok(()) }
        });
    }
    // The first of the seven may have worked long enough to count for none.
    site.process().wait_for_line("the count of deaths", |line| {
        line.contains("scenario").then_some(())?;
        line.contains("6 times in a row").then_some(())
    });
    site.wait_until_healthy();
    site.session().reset(trolley());
}

#[test]
fn a_folder_that_cannot_be_read_is_one_line() {
    let ports = ["up", "--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0", "--carla", "0"];
    for wrong in [["--maps", "/no/such/maps"], ["--recordings", "/dev/null"]] {
        assert_refused(&[&ports[..], &wrong].concat(), &wrong);
    }
}

#[test]
fn endpoints_that_nobody_could_use_are_one_line() {
    let ports = ["up", "--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0"];
    for (wrong, said) in [
        (&["--carla", "0", "--carla-map", "Town99"][..], &["Town99", "Town10HD_Opt"][..]),
        (&["--carla", "25980,25981"], &["--carla", "25981"]),
    ] {
        assert_refused(&[&ports[..], wrong].concat(), said);
    }
}

#[test]
fn an_unknown_map_is_refused_by_name_and_the_session_goes_on() {
    let site = Site::without_renderer();
    let mut session = site.session();
    session.reset(trolley());
    let arguments =
        json!({"scenario_name": "trolley_saves", "scenario_config": {"map_name": "Town99"}});
    let refusal = session.ask(&json!({"type": "reset", "data": arguments}));
    assert_eq!(refusal["data"]["code"], "EXECUTION_ERROR", "{refusal}");
    let message = refusal["data"]["message"].as_str().unwrap();
    assert!(message.contains("Town99") && message.contains("Town10HD_Opt"), "{message}");
    session.step(json!({"action_type": "observe"}));
}

#[test]
fn a_service_that_dies_is_started_again_and_the_log_says_so() {
    let mut site = Site::start(&[]);
    for (service, name) in
        [(Service::World, "world"), (Service::Scenario, "scenario"), (Service::Render, "render")]
    {
        let dead = site.kill(service);
        eventually("new process", SOON, || {
            let new = site.pid(service);
            if new == dead { Err(new) } else { Ok(()) }
        });
        site.process().wait_for_line("restart in the log", |line| {
            (line.contains(name) && line.contains("SIGKILL") && line.contains("again"))
                .then_some(())
        });
    }
    site.wait_until_healthy();
    eventually("reset after the restarts", SOON, || {
        let answer = site.session().ask(&json!({"type": "reset", "data": trolley()}));
        if answer["type"] == "observation" { Ok(()) } else { Err(answer) }
    });
}

#[test]
fn every_service_runs_alone_against_a_router() {
    let router = Process::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let bus = router.wait_for_line("router's address", |line| {
        line.split_whitespace().find(|word| word.starts_with("tcp/")).map(str::to_owned)
    });
    let _world = Process::start(&["world", "--connect", &bus]);
    let http = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let _scenario = Process::start(&["scenario", "--connect", &bus, "--http", &http.to_string()]);
    let probe = tests::Probe::open(bus.parse().unwrap());
    probe.wait_for(ServiceKind::World);
    let mut session = Session::open(http);
    session.reset(trolley());
    session.step(json!({"action_type": "observe"}));
    assert_eq!(probe.worlds().len(), 1);
}

#[test]
fn a_signal_ends_a_service_whose_bus_hangs_while_it_joins() {
    for arguments in [
        &["router", "--listen", "tcp/127.0.0.1:0"][..],
        &["world"],
        &["world", "--listen", "tcp/127.0.0.1:0"],
        &["render", "--adapter", "no such adapter"],
        &["scenario", "--http", "127.0.0.1:0"],
    ] {
        let silent = TcpListener::bind("127.0.0.1:0").unwrap();
        let bus = format!("tcp/{}", silent.local_addr().unwrap());
        let mut process = Process::start(&[arguments, &["--connect", &bus]].concat());
        let _joining = silent.accept().unwrap();
        process.signal(Signal::TERM);
        assert_eq!(process.wait(END_WITHIN).code(), Some(0), "{arguments:?}\n{}", process.log());
    }
}

#[test]
fn a_signal_ends_a_service_that_runs_alone() {
    for arguments in [
        &["router", "--listen", "tcp/127.0.0.1:0"][..],
        &["world", "--listen", "tcp/127.0.0.1:0"],
        // Nobody listens there: a service that still looks for its bus can be stopped too.
        &["scenario", "--connect", "tcp/127.0.0.1:1", "--http", "127.0.0.1:0"],
    ] {
        let mut process = Process::start(arguments);
        process.wait_for_line("first line of the log", |_| Some(()));
        process.signal(Signal::TERM);
        assert_eq!(process.wait(END_WITHIN).code(), Some(0), "{arguments:?}\n{}", process.log());
    }
}
