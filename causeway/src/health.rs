//! `causeway health` and `causeway drain`: what probes ask and operators say, for images that have
//! no other HTTP client.

use std::net::{Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::time::Duration;

use crate::failure::Failure;

/// Whom to ask.
#[derive(Debug, clap::Args)]
pub(crate) struct Targets {
    /// What processes were given as --admin
    #[arg(env = "CAUSEWAY_ADMIN", value_name = "[http://][HOST:]PORT", value_delimiter = ',',
        default_value = "9464", value_parser = address)]
    addresses: Vec<SocketAddr>,
    /// How long one may take to answer
    #[arg(long, value_name = "SECS", default_value_t = 2,
        value_parser = clap::value_parser!(u64).range(1..=60))]
    timeout_secs: u64,
}

/// Settings of `health`.
#[derive(Debug, clap::Args)]
pub(crate) struct HealthArgs {
    #[command(flatten)]
    targets: Targets,
    /// Whether they take new work, not only whether they live
    #[arg(long)]
    ready: bool,
    /// Whether they have started
    #[arg(long, conflicts_with = "ready")]
    started: bool,
}

/// Settings of `drain`.
#[derive(Debug, clap::Args)]
pub(crate) struct DrainArgs {
    #[command(flatten)]
    targets: Targets,
    /// Take new work again
    #[arg(long)]
    undo: bool,
}

/// Not all said yes.
#[derive(Debug, thiserror::Error)]
#[error("{bad} of {asked} said no")]
struct NotAll {
    bad: usize,
    asked: usize,
}

/// Asks processes how they are, and prints what they say.
///
/// # Errors
/// When one says no, or nothing.
pub(crate) fn health(args: &HealthArgs) -> Result<(), Failure> {
    let path = match args {
        HealthArgs { ready: true, .. } => "/readyz",
        HealthArgs { started: true, .. } => "/startupz",
        _ => "/livez",
    };
    ask_all(&args.targets, "GET", path)
}

/// Has processes of this machine take no new work.
///
/// # Errors
/// When one does not, or says nothing.
pub(crate) fn drain(args: &DrainArgs) -> Result<(), Failure> {
    ask_all(&args.targets, "POST", if args.undo { "/undrain" } else { "/drain" })
}

fn ask_all(targets: &Targets, method: &str, path: &str) -> Result<(), Failure> {
    let patience = Duration::from_secs(targets.timeout_secs);
    let mut bad = 0;
    for address in &targets.addresses {
        let told = admin::ask(*address, method, path, patience);
        bad += usize::from(!told.as_ref().is_ok_and(admin::Told::is_good));
        match told {
            Ok(told) => println!("{address} {}", told.body.trim_end()),
            Err(error) => println!("{address} {error}"),
        }
    }
    let asked = targets.addresses.len();
    if bad == 0 { Ok(()) } else { Err(Failure::of(&NotAll { bad, asked })) }
}

/// A port of the loopback, or a host and a port.
fn address(text: &str) -> Result<SocketAddr, String> {
    let place = text.strip_prefix("http://").unwrap_or(text).trim_end_matches('/');
    if let Ok(port) = place.parse() {
        return Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    }
    let wanted = |found: String| format!("wanted a port or HOST:PORT, e.g. 9464 ({found})");
    let mut found = place.to_socket_addrs().map_err(|cause| wanted(cause.to_string()))?;
    found.next().ok_or_else(|| wanted("the name has no address".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_may_be_a_port_and_look_like_a_page() {
        assert_eq!(address("9464").unwrap().to_string(), "127.0.0.1:9464");
        assert_eq!(address("http://127.0.0.1:80/").unwrap().to_string(), "127.0.0.1:80");
        assert!(address("nowhere").unwrap_err().contains("HOST:PORT"));
    }
}
