//! One process of the program under test.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process, test_kill_process};

use crate::{SOON, eventually};

/// One running `causeway`. Killed when dropped; its output is printed when the test has failed.
pub struct Process {
    child: Child,
    command: String,
    lines: Arc<Mutex<Vec<String>>>,
    /// Each reads one output to its end.
    readers: Vec<JoinHandle<()>>,
}

/// The program under test: `CAUSEWAY_BIN`, or what Cargo built beside this test.
fn program() -> PathBuf {
    if let Some(path) = std::env::var_os("CAUSEWAY_BIN") {
        return path.into();
    }
    let test = std::env::current_exe().unwrap();
    let profile = test.parent().and_then(|deps| deps.parent()).unwrap();
    let path = profile.join("causeway");
    assert!(
        path.exists(),
        "no {path:?}; test with `cargo nextest run --release -p causeway -p tests`"
    );
    path
}

impl Process {
    /// Starts `causeway` with arguments.
    pub fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(program())
            .args(arguments)
            // What the machine's owner prefers must not reach the test.
            .env_remove("CARLA_SCENARIO")
            .env_remove("CAUSEWAY_MAPS")
            .env_remove("MAX_CONCURRENT_ENVS")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = Arc::new(Mutex::new(Vec::new()));
        let readers = vec![
            keep_lines(child.stdout.take().unwrap(), Arc::clone(&lines)),
            keep_lines(child.stderr.take().unwrap(), Arc::clone(&lines)),
        ];
        Self { child, command: format!("causeway {}", arguments.join(" ")), lines, readers }
    }

    /// Everything it has said so far.
    pub fn log(&self) -> String {
        self.lines.lock().unwrap().join("\n")
    }

    /// The first line for which `find` finds something.
    pub fn wait_for_line<T>(&self, wanted: &str, find: impl Fn(&str) -> Option<T>) -> T {
        eventually(wanted, SOON, || {
            let lines = self.lines.lock().unwrap();
            lines.iter().find_map(|line| find(line)).ok_or_else(|| lines.join("\n"))
        })
    }

    /// Sends a signal to this process alone.
    pub fn signal(&self, signal: Signal) {
        kill_process(self.pid(), signal).unwrap();
    }

    /// Waits until it ends by itself, and all that it said is in the log.
    pub fn wait(&mut self, deadline: Duration) -> ExitStatus {
        let wanted = format!("end of `{}`", self.command);
        let log = Arc::clone(&self.lines);
        eventually(&wanted, deadline, || match self.child.try_wait().unwrap() {
            Some(status) if self.readers.iter().all(JoinHandle::is_finished) => Ok(status),
            _ => Err(log.lock().unwrap().join("\n")),
        })
    }

    /// The processes it has started that still run, with their command lines.
    pub fn children(&self) -> Vec<(Pid, String)> {
        let parent = self.pid().as_raw_nonzero().get();
        let entries = fs::read_dir("/proc").unwrap().flatten();
        let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        pids.filter_map(|pid: i32| {
            // A process may end between being listed and being read.
            let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
            let of_ours = status.lines().any(|line| line == format!("PPid:\t{parent}"));
            let command = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
            let command = String::from_utf8_lossy(&command).replace('\0', " ");
            of_ours.then(|| (Pid::from_raw(pid).unwrap(), command))
        })
        .collect()
    }

    fn pid(&self) -> Pid {
        Pid::from_raw(i32::try_from(self.child.id()).unwrap()).unwrap()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let children = self.children();
        // Already gone is what is wanted.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if thread::panicking() {
            eprintln!("--- {}\n{}\n---", self.command, self.log());
            return;
        }
        eventually("end of all processes of the test", SOON, || {
            let left: Vec<_> = children.iter().filter(|(pid, _)| is_running(*pid)).collect();
            if left.is_empty() { Ok(()) } else { Err(format!("{left:?}")) }
        });
    }
}

/// Whether a process exists and is not only waiting to be buried.
pub fn is_running(pid: Pid) -> bool {
    let zombie = || {
        let status = fs::read_to_string(format!("/proc/{}/status", pid.as_raw_nonzero()));
        status.is_ok_and(|status| status.contains("State:\tZ"))
    };
    test_kill_process(pid).is_ok() && !zombie()
}

fn keep_lines(
    output: impl Read + Send + 'static,
    lines: Arc<Mutex<Vec<String>>>,
) -> JoinHandle<()> {
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            lines.lock().unwrap().push(line);
        }
    })
}
