//! What was typed, and what the gateway runs with.

mod endpoints;

use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use bus::{BusAddress, Identity, IdentityArgs};
use schemas::{Lease, ServiceId, ServiceKind, Tenant};
use worlds::Budget;

use crate::allowance::Allowance;
use crate::dialect::ClientVersion;
use crate::guests::Allowed;
use crate::latitudes::Latitudes;
use crate::recorder::RecordingFolder;
pub use endpoints::PortOfTenant;
pub(crate) use endpoints::{EndpointConfig, Ports};

/// Ticks per second in asynchronous mode unless told otherwise.
const FPS: f64 = 30.0;
/// Most ticks per second in asynchronous mode.
const FPS_MAX: f64 = 1_000.0;
/// Longest wait for a client that does not tick.
const LEASE_SECS_MAX: f64 = 86_400.0;

/// Ticks per second of an endpoint in asynchronous mode, as typed.
///
/// # Errors
/// What was wanted instead.
pub fn ticks_per_second(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|fps| *fps > 0.0 && *fps <= FPS_MAX);
    number.ok_or_else(|| format!("wanted a number above 0 and at most {FPS_MAX}"))
}

/// How long a client that does not tick is waited for, as typed.
///
/// # Errors
/// What was wanted instead.
pub fn lease_secs(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|secs| *secs > 0.0 && *secs <= LEASE_SECS_MAX);
    number.ok_or_else(|| format!("wanted seconds above 0 and at most {LEASE_SECS_MAX}"))
}

/// Lets clients of CARLA 0.9.16 and 0.10.0 drive worlds.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Addresses of the bus; without them CARLA_HOST names the host
    #[arg(long, env = "CAUSEWAY_BUS", value_delimiter = ',', value_name = "(tcp|tls)/HOST:PORT",
        default_value = bus::site_address())]
    pub connect: Vec<BusAddress>,
    /// Certificates.
    #[command(flatten)]
    pub identity: IdentityArgs,
    /// Ports of CARLA endpoints, each a world of its own, with the version of its clients, 0.10 if
    /// that is not 0.9, and its owner if that is not --tenant
    #[arg(
        long,
        visible_alias = "endpoint",
        env = "CARLA_PORT",
        value_name = "PORT[@VERSION][=TENANT]",
        default_value = "2000",
        value_delimiter = ','
    )]
    pub port: Vec<PortOfTenant>,
    /// Ports of the endpoints' streams, one for each [default: the next after each --port]
    #[arg(long, value_name = "PORT", value_delimiter = ',')]
    pub stream_port: Vec<u16>,
    /// Networks whose clients may connect to an endpoint, e.g. 2000=10.0.3.0/24 [default: all
    /// that reach it]
    #[arg(long, value_name = "PORT=ADDRESS/BITS", value_delimiter = ',')]
    pub allow: Vec<Allowed>,
    /// Address on which endpoints listen
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub host: IpAddr,
    /// Map of a new world
    #[arg(long, value_name = "NAME", default_value = "Town10HD_Opt")]
    pub map: String,
    /// Ticks per second in asynchronous mode
    #[arg(long, value_name = "N", default_value_t = FPS, value_parser = ticks_per_second)]
    pub fps: f64,
    /// Leaves synchronous mode when nobody ticked for so long [default: never, as CARLA]
    #[arg(long, value_name = "SECS", value_parser = lease_secs)]
    pub sync_lease: Option<f64>,
    /// Clients in synchronous mode tick together: the world advances when each that ticks has
    /// asked, and waits so long for one that does not [default: each tick counts, as in CARLA]
    #[arg(long, value_name = "SECS", value_parser = lease_secs)]
    pub share_clock: Option<f64>,
    /// Cars that clients spawn: CARLA's, for which its programs and the corners of its maps are
    /// made, or real ones
    #[arg(long, alias = "tyres", value_enum, default_value_t)]
    pub cars: Cars,
    /// Which way the latitudes of sensor.other.gnss grow: to the south, as in CARLA 0.9.16, or to
    /// the north, as before, for programs that drive by them
    #[arg(long, value_enum, default_value_t)]
    pub latitudes: Latitudes,
    /// Root of all randomness of new worlds
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Name on the bus; two of one kind need different ones [default: a random one]
    #[arg(long, value_name = "NAME", default_value_t = bus::unused_id(ServiceKind::Gateway),
        hide_default_value = true)]
    pub id: ServiceId,
    /// Folder for CARLA's recordings, in it one for each tenant
    #[arg(long, env = "CAUSEWAY_RECORDINGS", value_name = "DIR", default_value = "recordings")]
    pub recordings: PathBuf,
    /// What replayed vehicles do when a replay is over
    #[arg(long, value_enum, default_value_t)]
    pub after_replays: AfterReplays,
    /// MiB kept to make worlds again whose service is gone; 0: none is made again
    #[arg(long, env = "CAUSEWAY_RECOVERY_MIB", value_name = "MIB", default_value_t = 256)]
    pub recovery_mib: usize,
    /// Owner of the worlds of endpoints that name none
    #[arg(long, default_value = "local", value_name = "NAME")]
    pub tenant: Tenant,
    /// File of tenants: how much each may use [default: as much as there is]
    #[arg(long, env = "CAUSEWAY_TOKENS", value_name = "FILE")]
    pub tokens: Option<PathBuf>,
}

/// Tyres, steering and engines of the cars that clients spawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Cars {
    /// CARLA's: `tire_friction` 3.5, `max_steer_angle` 70°, quick steering, engines that brake.
    #[default]
    Carla,
    /// Real ones: friction about 1, published turning circles and engines.
    Real,
}

impl std::fmt::Display for Cars {
    /// As typed.
    fn fmt(&self, to: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        to.write_str(match self {
            Self::Real => "real",
            Self::Carla => "carla",
        })
    }
}

/// What replayed vehicles do when a replay is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum AfterReplays {
    /// They stand, as in CARLA 0.9.16, until a client drives them.
    #[default]
    Stand,
    /// They drive on in the world's own traffic, as in CARLA before 0.9.9.
    Drive,
}

/// What the gateway runs with; consistent.
#[derive(Clone, Debug)]
pub struct Config {
    pub(crate) connect: Vec<BusAddress>,
    /// On a bus with TLS.
    pub(crate) identity: Option<Identity>,
    pub(crate) endpoints: Vec<EndpointConfig>,
    pub(crate) host: IpAddr,
    pub(crate) id: ServiceId,
    /// Of endpoints that name none.
    pub(crate) tenant: Tenant,
    /// Says how much tenants may use.
    pub(crate) tokens: Option<PathBuf>,
    /// Of no endpoint; see [`Config::world_of`].
    world: WorldConfig,
    recordings: PathBuf,
    /// Whether clients may name files anywhere.
    takes_paths: bool,
}

/// How worlds of an endpoint are made and run.
#[derive(Clone, Debug)]
pub(crate) struct WorldConfig {
    pub(crate) version: ClientVersion,
    pub(crate) map: String,
    pub(crate) seed: u64,
    pub(crate) cars: Cars,
    pub(crate) latitudes: Latitudes,
    pub(crate) pacing: Pacing,
    pub(crate) after_replays: AfterReplays,
    /// Where recordings lie.
    pub(crate) recordings: RecordingFolder,
    /// Keeps the worlds while it lives.
    pub(crate) owner: ServiceId,
    /// What may be kept to make worlds again, by all endpoints.
    pub(crate) recovery: Arc<Budget>,
    /// How much of the site their tenant may use.
    pub(crate) allowance: Allowance,
}

/// How the clock of an endpoint runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pacing {
    /// Between two ticks in asynchronous mode.
    pub(crate) period: Duration,
    /// Leaves synchronous mode when nobody ticked for so long.
    pub(crate) sync_lease: Option<Duration>,
    /// Clients tick together, and wait so long for each other.
    pub(crate) clock_lease: Option<Duration>,
}

/// How long worlds outlive the gateway.
const LEASE_MILLIS: u32 = 5_000;

impl WorldConfig {
    /// Keeps a world while the gateway lives.
    pub(crate) fn lease(&self) -> Lease {
        Lease { owner: self.owner.clone(), millis: LEASE_MILLIS }
    }
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

impl Config {
    /// Checks what was typed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that cannot work.
    pub fn resolve(args: &Args) -> Result<Self, ConfigError> {
        let wrong = |setting, why: String| ConfigError { setting, why };
        let pacing = Pacing {
            period: Duration::from_secs_f64(1.0 / args.fps),
            sync_lease: args.sync_lease.map(Duration::from_secs_f64),
            clock_lease: args.share_clock.map(Duration::from_secs_f64),
        };
        let recordings = std::path::absolute(&args.recordings);
        let recordings = recordings.map_err(|why| wrong("recordings", why.to_string()))?;
        if let Some(at) = recordings.ancestors().find(|at| at.exists()).filter(|at| !at.is_dir()) {
            let why = format!("no folder can be made there, as a file is in the way: {at:?}");
            return Err(wrong("recordings", why));
        }
        let endpoints =
            endpoints::endpoints(&args.port, &args.stream_port, &args.allow, &args.tenant)?;
        Ok(Self {
            connect: args.connect.clone(),
            identity: args.identity.identity(),
            endpoints,
            host: args.host,
            id: args.id.clone(),
            tenant: args.tenant.clone(),
            tokens: args.tokens.clone(),
            world: WorldConfig {
                version: ClientVersion::default(),
                map: args.map.clone(),
                seed: args.seed,
                cars: args.cars,
                latitudes: args.latitudes,
                pacing,
                after_replays: args.after_replays,
                recordings: RecordingFolder::new(recordings.clone(), false),
                owner: args.id.clone(),
                recovery: Budget::new(args.recovery_mib.saturating_mul(1 << 20)),
                allowance: Allowance::open(args.tenant.clone()),
            },
            recordings,
            // Users of this machine may name whole paths, as with CARLA, but not those of others.
            takes_paths: args.host.is_loopback() && args.port.iter().all(|at| at.tenant.is_none()),
        })
    }

    /// What may be kept to make worlds again, by all endpoints.
    pub(crate) fn recovery(&self) -> Arc<Budget> {
        Arc::clone(&self.world.recovery)
    }

    /// How worlds of an endpoint are made, with a folder for its tenant's recordings.
    pub(crate) fn world_of(&self, endpoint: &EndpointConfig, allowance: Allowance) -> WorldConfig {
        let (tenant, version) = (&endpoint.tenant, endpoint.version);
        let recordings =
            RecordingFolder::new(self.recordings.join(tenant.as_str()), self.takes_paths);
        WorldConfig { version, recordings, allowance, ..self.world.clone() }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn a_lease_is_a_time_that_can_be_waited_for() {
        assert_eq!(lease_secs("0.5"), Ok(0.5));
        for wrong in ["nan", "inf", "-1", "0", "1e18", "soon"] {
            assert!(lease_secs(wrong).unwrap_err().contains("at most 86400"), "{wrong}");
        }
    }

    #[test]
    fn a_file_in_the_place_of_the_recordings_is_refused_by_name() {
        let line = ["gateway", "--recordings", "/dev/null/below"];
        let refused = Config::resolve(&Line::parse_from(line).args).unwrap_err().to_string();
        assert!(refused.contains("--recordings") && refused.contains("/dev/null"), "{refused}");
    }
}
