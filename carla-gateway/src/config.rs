//! What was typed, and what the gateway runs with.

use std::collections::BTreeSet;
use std::net::IpAddr;
use std::path::PathBuf;
use std::time::Duration;

use bus::BusAddress;
use schemas::{ServiceId, ServiceKind, Tenant};

use crate::recorder::Shelf;

/// Ticks per second in asynchronous mode unless told otherwise.
const FPS: f64 = 30.0;
/// Most ticks per second in asynchronous mode.
const FPS_MAX: f64 = 1_000.0;

/// Lets clients of CARLA 0.9.16 drive worlds.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Addresses of the bus; without them CARLA_HOST names the host
    #[arg(long, env = "CAUSEWAY_BUS", value_delimiter = ',', value_name = "tcp/HOST:PORT",
        default_value = bus::site_address())]
    pub connect: Vec<BusAddress>,
    /// Ports of CARLA endpoints, each a world of its own
    #[arg(
        long,
        env = "CARLA_PORT",
        value_name = "PORT",
        default_value = "2000",
        value_delimiter = ','
    )]
    pub port: Vec<u16>,
    /// Ports of the endpoints' streams, one for each [default: the next after each --port]
    #[arg(long, value_name = "PORT", value_delimiter = ',')]
    pub stream_port: Vec<u16>,
    /// Address on which endpoints listen
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub host: IpAddr,
    /// Map of a new world
    #[arg(long, value_name = "NAME", default_value = "Town10HD_Opt")]
    pub map: String,
    /// Ticks per second in asynchronous mode
    #[arg(long, value_name = "N", default_value_t = FPS)]
    pub fps: f64,
    /// Leaves synchronous mode when nobody ticked for so long [default: never, as CARLA]
    #[arg(long, value_name = "SECS")]
    pub sync_lease: Option<f64>,
    /// Tyres and steering of cars: those of real ones, or CARLA's, for whose grip the corners of
    /// its maps are made
    #[arg(long, value_enum, default_value_t)]
    pub tyres: Tyres,
    /// Root of all randomness of new worlds
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Name on the bus; two of one kind need different ones [default: a random one]
    #[arg(long, value_name = "NAME", default_value_t = bus::unused_id(ServiceKind::Gateway),
        hide_default_value = true)]
    pub id: ServiceId,
    /// Folder for CARLA's recordings, in it one for each tenant
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    pub recordings: PathBuf,
    /// What replayed vehicles do when a replay is over
    #[arg(long, value_enum, default_value_t)]
    pub after_replays: AfterReplays,
    /// Owner of the worlds
    #[arg(long, default_value = "local", value_name = "NAME")]
    pub tenant: Tenant,
}

/// Tyres and steering of the cars that clients spawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Tyres {
    /// As measured of real cars: friction about 1, and the published turning circle.
    #[default]
    Real,
    /// `tire_friction` 3.5 and `max_steer_angle` 70°.
    Carla,
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
    pub(crate) endpoints: Vec<Ports>,
    pub(crate) host: IpAddr,
    pub(crate) id: ServiceId,
    pub(crate) tenant: Tenant,
    pub(crate) world: WorldConfig,
}

/// Where clients of an endpoint connect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ports {
    /// For calls.
    pub(crate) calls: u16,
    /// For the streams of sensors.
    pub(crate) streams: u16,
}

/// How worlds of an endpoint are made and run.
#[derive(Clone, Debug)]
pub(crate) struct WorldConfig {
    pub(crate) map: String,
    pub(crate) seed: u64,
    pub(crate) tyres: Tyres,
    /// Between two ticks in asynchronous mode.
    pub(crate) period: Duration,
    pub(crate) sync_lease: Option<Duration>,
    pub(crate) after_replays: AfterReplays,
    /// Where recordings lie.
    pub(crate) shelf: Shelf,
    /// Keeps the worlds while it lives.
    pub(crate) owner: ServiceId,
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
        if !(args.fps.is_finite() && args.fps > 0.0 && args.fps <= FPS_MAX) {
            return Err(wrong("fps", format!("wanted 0 to {FPS_MAX}, found {}", args.fps)));
        }
        let lease = args.sync_lease.map(Duration::try_from_secs_f64).transpose();
        let sync_lease = lease.map_err(|why| wrong("sync-lease", why.to_string()))?;
        let folder = std::path::absolute(args.recordings.join(args.tenant.as_str()));
        let folder = folder.map_err(|why| wrong("recordings", why.to_string()))?;
        // Users of this machine may name whole paths, as with CARLA.
        let shelf = Shelf::new(folder, args.host.is_loopback());
        let endpoints = pair(&args.port, &args.stream_port)?;
        Ok(Self {
            connect: args.connect.clone(),
            endpoints,
            host: args.host,
            id: args.id.clone(),
            tenant: args.tenant.clone(),
            world: WorldConfig {
                map: args.map.clone(),
                seed: args.seed,
                tyres: args.tyres,
                period: Duration::from_secs_f64(1.0 / args.fps),
                sync_lease,
                after_replays: args.after_replays,
                shelf,
                owner: args.id.clone(),
            },
        })
    }
}

/// Each port of calls with that of its streams; no port twice.
fn pair(calls: &[u16], streams: &[u16]) -> Result<Vec<Ports>, ConfigError> {
    let wrong = |setting, why: String| ConfigError { setting, why };
    if calls.is_empty() {
        return Err(wrong("port", "wanted at least one".to_owned()));
    }
    if !streams.is_empty() && streams.len() != calls.len() {
        let why = format!("wanted one for each --port: {}, found {}", calls.len(), streams.len());
        return Err(wrong("stream-port", why));
    }
    let mut taken = BTreeSet::new();
    let mut pairs = Vec::with_capacity(calls.len());
    for (index, &calls) in calls.iter().enumerate() {
        let next = || calls.checked_add(1).filter(|_| calls > 0);
        let streams = streams.get(index).copied().or_else(next).filter(|port| *port > 0);
        let streams =
            streams.ok_or_else(|| wrong("port", format!("wanted 1 to 65534, found {calls}")))?;
        for port in [calls, streams] {
            if port == 0 || !taken.insert(port) {
                return Err(wrong("port", format!("{port} is wanted twice or is none")));
            }
        }
        pairs.push(Ports { calls, streams });
    }
    Ok(pairs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_take_the_next_port_unless_told() {
        let pairs = pair(&[2000, 2010], &[]).unwrap();
        let told = pair(&[2000, 2001], &[3000, 3001]).unwrap();
        let of = |pairs: &[Ports]| pairs.iter().map(|p| (p.calls, p.streams)).collect::<Vec<_>>();
        assert_eq!(of(&pairs), [(2000, 2001), (2010, 2011)]);
        assert_eq!(of(&told), [(2000, 3000), (2001, 3001)]);
    }

    #[test]
    fn ports_that_clash_are_refused() {
        for ports in [&[2000, 2001][..], &[2001, 2000], &[2000, 2000], &[0], &[65_535], &[]] {
            assert_eq!(pair(ports, &[]).unwrap_err().setting, "port", "{ports:?}");
        }
        assert_eq!(pair(&[2000], &[2000]).unwrap_err().setting, "port");
        assert_eq!(pair(&[2000, 2010], &[2005]).unwrap_err().setting, "stream-port");
    }
}
