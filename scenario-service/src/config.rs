//! What was typed, and what the service runs with.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use bus::{BusAddress, Identity, IdentityArgs};
use clap::Args as ClapArgs;
use schemas::{ServiceId, ServiceKind, Tenant};

use crate::limits;
use crate::openenv::Mode;
use crate::scenario::{Profile, registry};
use crate::scenario_files::ScenarioFiles;
use crate::session::table::IdleTimes;

/// Arguments of the scenario service.
#[derive(Clone, Debug, ClapArgs)]
pub struct Args {
    /// Addresses of the bus; without them CARLA_HOST names the host
    #[arg(long, env = "CAUSEWAY_BUS", value_delimiter = ',', value_name = "(tcp|tls)/HOST:PORT",
        default_value = bus::site_address())]
    pub connect: Vec<BusAddress>,
    /// Certificates.
    #[command(flatten)]
    pub identity: IdentityArgs,
    /// Address of the OpenEnv face.
    #[arg(long, default_value = "8000", value_name = "[IP:]PORT", value_parser = http_address)]
    pub http: SocketAddr,
    /// Name on the bus; two of one kind need different ones [default: a random one]
    #[arg(long, value_name = "NAME", default_value_t = bus::unused_id(ServiceKind::Scenario),
        hide_default_value = true)]
    pub id: ServiceId,
    /// Owner of the worlds that sessions make.
    #[arg(long, default_value = "local", value_name = "NAME")]
    pub tenant: String,
    /// File of tenants and tokens: whoever comes must have one, and has worlds and quotas of its
    /// tenant.
    #[arg(long, env = "CAUSEWAY_TOKENS", value_name = "FILE")]
    pub tokens: Option<PathBuf>,
    /// Without --tokens: serve anybody who reaches an address beyond the loopback.
    #[arg(long, env = "CAUSEWAY_OPEN", value_parser = clap::builder::FalseyValueParser::new())]
    pub open: bool,
    /// Sessions at once.
    #[arg(long, env = "MAX_CONCURRENT_ENVS", default_value_t = limits::SESSIONS_MAX,
        value_name = "N")]
    pub sessions_max: u32,
    /// Scenario of sessions that name none.
    #[arg(long, env = "CARLA_SCENARIO", default_value = "trolley_saves", value_name = "NAME")]
    pub default_scenario: String,
    /// Folder with files of more scenarios, `<scenario name>.toml`, read when a reset names them.
    #[arg(long, env = "CAUSEWAY_SCENARIOS", value_name = "DIR")]
    pub scenarios: Option<PathBuf>,
    /// Where documents and the reference server disagree: documented or literal.
    #[arg(long, env = "CAUSEWAY_PROFILE", default_value = "documented", value_name = "PROFILE")]
    pub profile: String,
    /// simulation, or production without /reset, /step and /state.
    #[arg(long, env = "OPENENV_MODE", default_value = "simulation", value_name = "MODE")]
    pub mode: String,
    /// Whether there is a page to try environments by hand at `/` and `/web`, and routes below it.
    #[arg(long, env = "ENABLE_WEB_INTERFACE", default_value = "true", value_name = "true|false",
        value_parser = is_on, action = clap::ArgAction::Set)]
    pub web_interface: bool,
    /// Web pages of others that may use the face, e.g. `https://example.com`, whose name may also
    /// be its own; pages of localhost always may.
    #[arg(long, env = "CAUSEWAY_ALLOW_ORIGIN", value_delimiter = ',', value_name = "ORIGIN",
        value_parser = origin)]
    pub allow_origin: Vec<String>,
    /// Memory to make worlds again whose world service is gone; 0: their episodes end.
    #[arg(long, env = "CAUSEWAY_RECOVERY_MIB", default_value_t = limits::RECOVERY_MIB,
        value_name = "MIB")]
    pub recovery_mib: usize,
    /// Seconds after which a silent connection ends.
    #[arg(long, default_value_t = 3_600, value_name = "SECONDS")]
    pub idle_secs: u64,
    /// Seconds after which a session without a connection ends.
    #[arg(long, default_value_t = 600, value_name = "SECONDS")]
    pub detached_idle_secs: u64,
}

/// What the service runs with; consistent if it exists.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    /// Bus addresses.
    pub(crate) connect: Vec<BusAddress>,
    /// On a bus with TLS.
    pub(crate) identity: Option<Identity>,
    /// Address of the face.
    pub(crate) http: SocketAddr,
    /// On the bus.
    pub(crate) id: ServiceId,
    /// Of the worlds.
    pub(crate) tenant: Tenant,
    /// Who may come in; `None`: everybody.
    pub(crate) tokens: Option<PathBuf>,
    /// At once.
    pub(crate) sessions_max: u32,
    /// Scenarios beside the built-in ones.
    pub(crate) files: ScenarioFiles,
    /// Exists.
    pub(crate) default_scenario: String,
    /// Of sessions that name none.
    pub(crate) profile: Profile,
    /// Which endpoints there are.
    pub(crate) mode: Mode,
    /// Whether people may try environments by hand.
    pub(crate) web_interface: bool,
    /// Origins of web pages besides the face's own.
    pub(crate) allow_origin: Vec<String>,
    /// Bytes to make worlds again.
    pub(crate) recovery_bytes: usize,
    /// How long sessions may be idle.
    pub(crate) idle: IdleTimes,
}

/// The first setting that cannot work.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("--{setting}: {why}")]
pub struct ConfigError {
    /// As typed.
    pub setting: &'static str,
    /// What is wrong with it.
    pub why: String,
}

/// Whether something is on, in the words that OpenEnv's servers know, in any case.
fn is_on(text: &str) -> Result<bool, String> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" | "1" | "yes" | "on" => Ok(true),
        "" | "false" | "0" | "no" | "off" => Ok(false),
        _ => Err("wanted true, 1, yes or on, or false, 0, no or off".to_owned()),
    }
}

/// An origin as browsers send it.
fn origin(text: &str) -> Result<String, String> {
    let host = text.split_once("://").map(|(_, host)| host);
    // A page of a file has the origin `null`.
    if text == "null" || host.is_some_and(|host| !host.is_empty() && !host.contains('/')) {
        Ok(text.to_owned())
    } else {
        Err("wanted a scheme and a host, e.g. https://example.com".to_owned())
    }
}

/// Where a face listens, as typed: a port of the loopback, or an address and a port.
///
/// # Errors
/// What was wanted instead.
pub fn http_address(text: &str) -> Result<SocketAddr, String> {
    match text.parse() {
        Ok(port) => Ok(SocketAddr::from(([127, 0, 0, 1], port))),
        Err(_) => {
            text.parse().map_err(|_| "wanted a port or IP:PORT, e.g. 0.0.0.0:8000".to_owned())
        }
    }
}

/// A face that anybody could use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "whoever reaches {0} could use this server: say who may with --tokens FILE (causeway token new), \
     or that everybody may with --open"
)]
pub struct Unguarded(pub SocketAddr);

/// Whether a face may be served: others reach it only with tokens, or because somebody wants that.
pub fn is_guarded(http: SocketAddr, has_tokens: bool, open: bool) -> bool {
    http.ip().is_loopback() || has_tokens || open
}

impl Config {
    /// # Errors
    /// [`ConfigError`] names the first setting that cannot work.
    pub(crate) fn resolve(args: &Args) -> Result<Self, ConfigError> {
        let wrong =
            |setting, why: &dyn std::fmt::Display| ConfigError { setting, why: why.to_string() };
        let profile = Profile::parse(&args.profile)
            .ok_or_else(|| wrong("profile", &"wanted documented or literal"))?;
        let mode = Mode::parse(&args.mode)
            .ok_or_else(|| wrong("mode", &"wanted simulation or production"))?;
        let files = match &args.scenarios {
            Some(folder) => ScenarioFiles::of(folder).map_err(|why| {
                wrong("scenarios", &format_args!("wanted a folder that can be read: {why}"))
            })?,
            None => ScenarioFiles::default(),
        };
        registry::find(&files, &args.default_scenario, profile)
            .map_err(|why| wrong("default-scenario", &why))?;
        if args.sessions_max == 0 {
            return Err(wrong("sessions-max", &"wanted at least 1"));
        }
        if !is_guarded(args.http, args.tokens.is_some(), args.open) {
            return Err(wrong("http", &Unguarded(args.http)));
        }
        Ok(Self {
            connect: args.connect.clone(),
            identity: args.identity.identity(),
            http: args.http,
            id: args.id.clone(),
            tokens: args.tokens.clone(),
            tenant: args.tenant.parse().map_err(|why| wrong("tenant", &why))?,
            sessions_max: args.sessions_max,
            files,
            default_scenario: args.default_scenario.clone(),
            profile,
            mode,
            web_interface: args.web_interface,
            allow_origin: args.allow_origin.clone(),
            recovery_bytes: args.recovery_mib.saturating_mul(1 << 20),
            idle: IdleTimes {
                connected: Duration::from_secs(args.idle_secs.max(1)),
                detached: Duration::from_secs(args.detached_idle_secs.max(1)),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_web_interface_is_off_where_its_variable_says_so() {
        for (text, wanted) in [("true", true), ("YES", true), ("1", true), ("False", false)] {
            assert_eq!(is_on(text), Ok(wanted), "{text}");
        }
        assert_eq!(is_on(""), Ok(false), "a variable that is set to nothing");
        assert!(is_on("maybe").unwrap_err().contains("wanted true"));
    }

    #[test]
    fn an_origin_is_a_scheme_and_a_host_as_browsers_send_it() {
        for right in ["https://example.com", "http://localhost:3000", "http://[::1]:80", "null"] {
            assert_eq!(origin(right).unwrap(), right);
        }
        for wrong in ["example.com", "https://example.com/", "http://", "*"] {
            assert!(origin(wrong).unwrap_err().contains("https://example.com"), "{wrong}");
        }
    }

    #[test]
    fn a_port_alone_is_one_of_the_loopback() {
        assert_eq!(http_address("8100").unwrap().to_string(), "127.0.0.1:8100");
        assert_eq!(http_address("0.0.0.0:80").unwrap().to_string(), "0.0.0.0:80");
        assert_eq!(http_address("[::1]:80").unwrap().to_string(), "[::1]:80");
        assert!(http_address("somewhere").unwrap_err().contains("IP:PORT"));
        assert!(http_address("65536").is_err());
    }
}
