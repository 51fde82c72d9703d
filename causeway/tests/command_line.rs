//! Goal: the command line explains itself, and programs can tell wrong use from failure.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::io::{BufRead as _, BufReader};
use std::os::unix::fs::PermissionsExt as _;
use std::process::{Command, Output, Stdio};

fn causeway(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_causeway")).args(arguments).output().unwrap()
}

#[test]
fn help_names_every_command_and_the_exit_codes() {
    let help = causeway(&["--help"]);
    let text = String::from_utf8(help.stdout).unwrap();
    for word in ["up", "world", "render", "scenario", "router", "map", "Exit codes"] {
        assert!(text.contains(word), "{word} is not in:\n{text}");
    }
    assert_eq!(help.status.code(), Some(0));
}

#[test]
fn what_cannot_be_understood_is_exit_code_2() {
    for arguments in
        [&["fly"][..], &["up", "--http", "nowhere"], &["router", "--listen", "udp/x:1"]]
    {
        assert_eq!(causeway(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn commands_of_the_package_are_those_of_the_python_that_is_named() {
    let told = |python: &str, words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_causeway"));
        let output = command.args(words).env("CAUSEWAY_PYTHON", python).output().unwrap();
        let said = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
        (output.status.code(), said.concat())
    };
    // `echo` says what it was to run.
    let (code, said) = told("echo", &["evaluate", "--help", "--seeds", "1", "2"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.starts_with("-c "), "{said}");
    assert!(said.ends_with(" causeway.evaluate --help --seeds 1 2\n"), "{said}");
    let (_, said) = told("echo", &["record-episodes", "lane-keep", "--", "-x"]);
    assert!(said.contains(" causeway.record_episodes lane-keep "), "{said}");
    let (code, said) = told("/python/of/nobody", &["evaluate"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("CAUSEWAY_PYTHON"), "{said}");
}

#[test]
fn a_python_without_the_package_is_named() {
    let folder = std::env::temp_dir().join(format!("causeway-python-{}", std::process::id()));
    let python = folder.join("python");
    // Without folders of packages, but beside a folder of our name.
    std::fs::create_dir_all(folder.join("causeway")).unwrap();
    std::fs::write(&python, "#!/bin/sh\nexec python3 -S -E \"$@\"\n").unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    for word in ["evaluate", "evaluate-dilemmas"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_causeway"));
        command.args([word, "--help"]).env("CAUSEWAY_PYTHON", &python);
        let output = command.current_dir(&folder).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        let module = word.replace('-', ".");
        let wanted = format!("has no module causeway.{module}: install agents/python");
        assert!(said.contains(&wanted), "{said}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Of what a service would refuse, as it would be started again for ever.
#[test]
fn a_site_with_a_setting_that_no_service_takes_does_not_start() {
    for (setting, wanted) in [
        (&["--threads", "100000"][..], "wanted 1 to 256"),
        (&["--share-clock", "nan"], "wanted seconds above 0 and at most 86400"),
        (&["--fps", "-1"], "wanted a number above 0 and at most 1000"),
        (&["--allow", "2000=10.0.3.0/24"], "no endpoint has the port 2000"),
        (&["--adapter", "quantum"], "named \"quantum\", found "),
    ] {
        let ports = ["--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0", "--carla", "0"];
        let no_render: &[&str] = if setting[0] == "--adapter" { &[] } else { &["--no-render"] };
        let output = causeway(&[&["up"], no_render, &ports[..], setting].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(wanted), "{said}");
    }
}

#[test]
fn a_whole_number_that_is_none_is_refused_by_what_was_wanted() {
    for number in ["-1", "many", "1.5"] {
        let output = causeway(&["world", "--worlds-max", number]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        let wanted = format!("'{number}' for '--worlds-max <N>': wanted a whole number from 0 on");
        assert!(said.contains(&wanted), "{said}");
    }
}

#[test]
fn a_variable_that_is_set_but_empty_is_not_set() {
    let with_empty = |variable: &str, arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_causeway"));
        let output = command.args(arguments).env(variable, "").output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = with_empty("CAUSEWAY_MAPS", &["map", "list"]);
    assert_eq!(code, Some(0), "{said}");
    // Whether anybody is there is another question.
    let (code, said) = with_empty("CAUSEWAY_ADMIN", &["health"]);
    assert_ne!(code, Some(2), "{said}");
}

/// A router stands for all services, as the limit is raised before any of them begins.
#[test]
fn a_service_may_open_as_many_files_as_the_machine_lets_it() {
    let binary = env!("CARGO_BIN_EXE_causeway");
    let few = format!(
        "ulimit -Sn 100 && ulimit -Hn 200 && exec {binary} router --listen tcp/127.0.0.1:0"
    );
    let mut command = Command::new("sh");
    command.args(["-c", &few]).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut service = command.spawn().unwrap();
    let said = BufReader::new(service.stderr.take().unwrap()).lines().next().unwrap().unwrap();
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", service.id())).unwrap();
    service.kill().unwrap();
    service.wait().unwrap();
    let files = limits.lines().find(|line| line.starts_with("Max open files")).unwrap();
    let numbers: Vec<&str> = files.split_whitespace().skip(3).take(2).collect();
    assert_eq!(numbers, ["200", "200"], "{limits}{said}");
}

/// Mesa's layer that orders devices looks for one.
#[test]
fn a_renderer_that_runs_alone_does_not_complain_that_there_is_no_display() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_causeway"));
    command.args(["render", "--connect", "tcp/127.0.0.1:1"]).env_remove("XDG_RUNTIME_DIR");
    command.env_remove("NODEVICE_SELECT").stdout(Stdio::null()).stderr(Stdio::piped());
    let mut service = command.spawn().unwrap();
    let mut said = BufReader::new(service.stderr.take().unwrap()).lines().map(Result::unwrap);
    let first = said.next().unwrap();
    service.kill().unwrap();
    service.wait().unwrap();
    assert!(!first.contains("XDG_RUNTIME_DIR"), "{first}");
}
