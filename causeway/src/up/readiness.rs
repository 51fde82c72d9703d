//! How a site as a whole is: ready when all services are that it is of no use without, and told to
//! take no new work when it is.

use std::net::SocketAddr;
use std::time::Duration;

use monitoring::{Condition, Drain, Monitor};

use super::child::Service;

/// Between two questions.
const ASK_EVERY: Duration = Duration::from_secs(1);
/// How long a service may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// A service that is asked.
struct Asked {
    address: SocketAddr,
    /// Of the site, if it is of no use without the service.
    condition: Option<Condition>,
}

/// Asks services for ever, on a thread of its own, if they can be asked.
///
/// # Errors
/// The system's, when there is no thread.
pub(crate) fn follow(services: &[Service], monitor: &Monitor) -> std::io::Result<()> {
    let asked: Vec<Asked> = services
        .iter()
        .filter_map(|service| {
            let unknown = || monitor.condition(service.name, "it has not answered yet");
            Some(Asked { address: service.admin?, condition: service.essential.then(unknown) })
        })
        .collect();
    if asked.is_empty() {
        return Ok(());
    }
    let monitor = monitor.clone();
    let ask_for_ever = move || {
        let mut was_asked = false;
        loop {
            let drain = monitor.drain_now();
            for service in &asked {
                service.ask();
                match drain {
                    // Services that were started again since have to be told again.
                    Drain::Asked => service.tell("/drain"),
                    Drain::No if was_asked => service.tell("/undrain"),
                    // They are told by signals.
                    Drain::No | Drain::Ending { .. } => {}
                }
            }
            was_asked = drain == Drain::Asked;
            std::thread::sleep(ASK_EVERY);
        }
    };
    std::thread::Builder::new().name("readiness".to_owned()).spawn(ask_for_ever).map(drop)
}

impl Asked {
    fn ask(&self) {
        let Some(condition) = &self.condition else { return };
        match admin::ask(self.address, "GET", "/readyz", PATIENCE) {
            Ok(told) if told.is_good() => condition.meet(),
            Ok(told) => condition.fail(told.body.trim_end()),
            Err(error) => condition.fail(error.to_string()),
        }
    }

    fn tell(&self, path: &str) {
        if let Err(error) = admin::ask(self.address, "POST", path, PATIENCE) {
            tracing::warn!(address = %self.address, path, %error, "a service was not told");
        }
    }
}
