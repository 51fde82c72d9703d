//! One process of one service.

use std::ffi::OsString;
use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use bus::Identity;
use rustix::process::{Pid, Signal, kill_process};
use tokio::process::{ChildStdin, Command};
use tokio::sync::watch;
use tokio::time::timeout;

use super::stop::Stop;

/// How long a process may take to end in good order; the whole site is gone a second later.
const GRACE: Duration = Duration::from_secs(2);

/// A service to run: its subcommand and what follows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Service {
    /// The subcommand.
    pub(crate) name: &'static str,
    /// What its names on the bus begin with; no other service of the site has the same.
    pub(crate) stem: String,
    /// What follows the subcommand.
    pub(crate) arguments: Vec<OsString>,
    /// Whether the site is of no use without it.
    pub(crate) essential: bool,
    /// Whether users are connected to it; it ends before those that it asks.
    pub(crate) is_face: bool,
    /// Where it is asked how it is.
    pub(crate) admin: Option<SocketAddr>,
    /// How long it may take to end in good order.
    pub(crate) grace: Duration,
}

/// By what a role is known on the bus, in a folder of certificates.
pub(crate) fn identity_in(folder: &Path, role: &str) -> Identity {
    Identity {
        authority: folder.join("ca.crt"),
        certificate: folder.join(format!("causeway-{role}.crt")),
        key: folder.join(format!("causeway-{role}.key")),
    }
}

impl Service {
    /// Without settings.
    pub(crate) fn new(name: &'static str) -> Self {
        Self {
            name,
            stem: name.to_owned(),
            arguments: Vec::new(),
            essential: true,
            is_face: false,
            admin: None,
            grace: GRACE,
        }
    }

    /// Has it answer how it is.
    pub(crate) fn watch(&mut self, address: SocketAddr) {
        self.admin = Some(address);
        self.arguments.extend([OsString::from("--admin"), address.to_string().into()]);
    }

    /// Has it write down who did what, if people come to it.
    pub(crate) fn write_down_in(&mut self, folder: &Path) {
        if self.is_face {
            self.arguments.extend([OsString::from("--audit"), folder.into()]);
        }
    }

    /// Has it show the certificate of its role on the bus.
    pub(crate) fn show_certificate_of(&mut self, folder: &Path) {
        let Identity { authority, certificate, key } =
            identity_in(folder, if self.is_face { "face" } else { self.name });
        for (flag, file) in
            [("--bus-ca", authority), ("--bus-cert", certificate), ("--bus-key", key)]
        {
            self.arguments.extend([OsString::from(flag), file.into_os_string()]);
        }
    }

    /// Gives it so many seconds to end; services that only serve others need none once those are
    /// gone.
    pub(crate) fn drain_within(&mut self, secs: u64) {
        if self.is_face && secs > 0 {
            self.grace += Duration::from_secs(secs);
            self.arguments.extend([OsString::from("--drain-secs"), secs.to_string().into()]);
        }
    }
}

/// A running process of a service. It dies with this value, and with this process.
pub(crate) struct Child {
    process: tokio::process::Child,
    grace: Duration,
    /// Never written; see [`lifeline`](crate::lifeline).
    _lifeline: Option<ChildStdin>,
}

impl Child {
    /// Starts this program again as the service, for the `generation`th time.
    ///
    /// Every process has a name of its own on the bus: what a dead one has leased must not be kept
    /// alive by the one that takes its place.
    ///
    /// # Errors
    /// When the operating system cannot start a process.
    pub(crate) fn start(service: &Service, generation: u64) -> io::Result<Self> {
        let mut process = Command::new(std::env::current_exe()?);
        for (variable, value) in [bus::RUNTIME, render_service::NO_DISPLAY] {
            if std::env::var_os(variable).is_none() {
                process.env(variable, value);
            }
        }
        let mut process = process
            // Meant for `up`; the services have other ports.
            .env_remove("CAUSEWAY_ADMIN")
            // Those that write lines are told to by an option.
            .env_remove("CAUSEWAY_AUDIT")
            .arg("--exit-with-parent")
            .arg(service.name)
            .args(&service.arguments)
            .arg("--id")
            .arg(format!("{}-{generation}", service.stem))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            // Its own group: Ctrl-C in a terminal reaches `up` alone, which stops each in order.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()?;
        // `wait` would close it, and with it tell the process to end.
        let lifeline = process.stdin.take();
        Ok(Self { process, grace: service.grace, _lifeline: lifeline })
    }

    /// Waits until the process ends by itself. May be dropped and called again.
    ///
    /// # Errors
    /// When the operating system cannot tell.
    pub(crate) async fn wait(&mut self) -> io::Result<ExitStatus> {
        self.process.wait().await
    }

    /// Asks the process to end, and kills it when it takes too long or nobody wants to wait.
    pub(crate) async fn stop(mut self, stop: &mut watch::Receiver<Stop>) {
        if self.ask_to_end() {
            let patient = async {
                tokio::select! {
                    _ = self.process.wait() => true,
                    () = Stop::at_once(stop) => false,
                }
            };
            if timeout(self.grace, patient).await.unwrap_or(false) {
                return;
            }
        }
        // Already gone is as good as killed.
        let _ = self.process.kill().await;
    }

    fn ask_to_end(&self) -> bool {
        let raw = self.process.id().and_then(|id| i32::try_from(id).ok());
        let Some(pid) = raw.and_then(Pid::from_raw) else { return false };
        kill_process(pid, Signal::TERM).is_ok()
    }
}
