//! What was typed, and what the gateway runs with.

use std::net::IpAddr;
use std::time::Duration;

use bus::Endpoint as BusEndpoint;
use schemas::{ServiceId, Tenant};

/// Ticks per second in asynchronous mode unless told otherwise.
const FPS: f64 = 30.0;
/// Most ticks per second in asynchronous mode.
const FPS_MAX: f64 = 1_000.0;

/// Lets clients of CARLA 0.9.16 drive worlds.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Bus endpoints to connect to, e.g. tcp/127.0.0.1:7447
    #[arg(long, required = true, value_name = "ENDPOINT")]
    pub connect: Vec<BusEndpoint>,
    /// Ports of CARLA endpoints, each a world of its own; streams take the next port, and the one
    /// after that stays free as in CARLA
    #[arg(long, value_name = "PORT", default_value = "2000", value_delimiter = ',')]
    pub port: Vec<u16>,
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
    /// Name on the bus; two of one kind need different ones
    #[arg(long, default_value = "gateway", value_name = "NAME")]
    pub id: ServiceId,
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

/// What the gateway runs with; consistent.
#[derive(Clone, Debug)]
pub struct Config {
    pub(crate) connect: Vec<BusEndpoint>,
    pub(crate) ports: Vec<u16>,
    pub(crate) host: IpAddr,
    pub(crate) id: ServiceId,
    pub(crate) tenant: Tenant,
    pub(crate) world: WorldConfig,
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
        check_ports(&args.port).map_err(|why| wrong("port", why))?;
        Ok(Self {
            connect: args.connect.clone(),
            ports: args.port.clone(),
            host: args.host,
            id: args.id.clone(),
            tenant: args.tenant.clone(),
            world: WorldConfig {
                map: args.map.clone(),
                seed: args.seed,
                tyres: args.tyres,
                period: Duration::from_secs_f64(1.0 / args.fps),
                sync_lease,
                owner: args.id.clone(),
            },
        })
    }
}

/// Two ports of each endpoint are taken, so that none may follow another directly.
fn check_ports(ports: &[u16]) -> Result<(), String> {
    if ports.is_empty() {
        return Err("wanted at least one".to_owned());
    }
    for (index, port) in ports.iter().enumerate() {
        let stream = port.checked_add(1).filter(|_| *port > 0);
        let stream = stream.ok_or_else(|| format!("wanted 1 to 65534, found {port}"))?;
        let clash =
            |other: &u16| *other == *port || *other == stream || other.wrapping_add(1) == *port;
        if ports.iter().skip(index + 1).any(clash) {
            return Err(format!("{port} and its streams on {stream} are wanted twice"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_whose_streams_would_clash_are_refused() {
        assert_eq!(check_ports(&[2000, 2010]), Ok(()));
        for ports in [&[2000, 2001][..], &[2001, 2000], &[2000, 2000], &[0], &[65_535], &[]] {
            assert!(check_ports(ports).is_err(), "{ports:?}");
        }
    }
}
