//! A whole site: `causeway up` and everything it starts.

use std::net::SocketAddr;

use bus::BusAddress;
use rustix::process::{Pid, Signal, kill_process};

use crate::{Probe, Process, SOON, Session, eventually, get};

/// The services of a site, by their subcommand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Service {
    /// Owns worlds.
    World,
    /// Draws.
    Render,
    /// Runs episodes.
    Scenario,
}

impl Service {
    fn subcommand(self) -> &'static str {
        match self {
            Self::World => "world",
            Self::Render => "render",
            Self::Scenario => "scenario",
        }
    }
}

/// `causeway up` on free ports.
pub struct Site {
    process: Process,
    http: SocketAddr,
    bus: BusAddress,
}

impl Site {
    /// A site that answers `/health`; `flags` are those of `causeway up`.
    pub fn start(flags: &[&str]) -> Self {
        let ports = ["up", "--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0", "--carla", "0"];
        let process = Process::start(&[&ports, flags].concat());
        let http = process.wait_for_line("OpenEnv address", |line| {
            line.split_once("http://")?.1.split_whitespace().next()?.parse().ok()
        });
        let bus = process.wait_for_line("bus address", |line| {
            line.split_whitespace().find(|word| word.starts_with("tcp/"))?.parse().ok()
        });
        let site = Self { process, http, bus };
        site.wait_until_healthy();
        site
    }

    /// A site without a renderer: most promises need no pictures.
    pub fn without_renderer() -> Self {
        Self::start(&["--no-render"])
    }

    /// Where OpenEnv clients connect.
    pub fn http(&self) -> SocketAddr {
        self.http
    }

    /// Where clients of the bus connect.
    pub fn bus(&self) -> &BusAddress {
        &self.bus
    }

    /// `causeway up` itself.
    pub fn process(&mut self) -> &mut Process {
        &mut self.process
    }

    /// Returns when `/health` answers.
    pub fn wait_until_healthy(&self) {
        eventually("healthy site", SOON, || {
            let answer = get(self.http, "/health").map_err(|error| error.to_string())?;
            if answer.contains("\"healthy\"") { Ok(()) } else { Err(answer) }
        });
    }

    /// A new WebSocket session.
    pub fn session(&self) -> Session {
        Session::open(self.http)
    }

    /// A look at the bus.
    pub fn probe(&self) -> Probe {
        Probe::open(self.bus.clone())
    }

    /// The process of a service, once it runs.
    pub fn pid(&self, service: Service) -> Pid {
        let subcommand = format!(" {} ", service.subcommand());
        eventually(&format!("process of {service:?}"), SOON, || {
            let children = self.process.children();
            let found = children.iter().find(|(_, command)| command.contains(&subcommand));
            found.map(|(pid, _)| *pid).ok_or_else(|| children.clone())
        })
    }

    /// `kill -9` of a service. Returns the process that is no more.
    pub fn kill(&self, service: Service) -> Pid {
        let pid = self.pid(service);
        kill_process(pid, Signal::KILL).unwrap();
        pid
    }
}
