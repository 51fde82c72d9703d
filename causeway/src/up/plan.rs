//! What was typed, and the consistent plan that follows from it.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::net::{IpAddr, SocketAddr};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use bus::{BusAddress, Identity};
use carla_gateway::{Allowed, Cars, Latitudes, PortOfTenant};
use clap::builder::ArgPredicate;
use render_service::{AdapterChoice, Quality};
use tenancy::Door;

use super::check::{check_folder, check_map, check_new_folder};
use super::child::{Service, identity_in};
use super::ports::{self, PortTaken};
use crate::watched::{AdminArgs, AuditArgs, DrainArgs};

/// Settings of a site.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// Where OpenEnv clients and browsers connect; port 0 takes any free one. Beyond the loopback
    /// only with --tokens or --open.
    #[arg(long, value_name = "[IP:]PORT", default_value = "8000",
        value_parser = scenario_service::http_address)]
    http: SocketAddr,
    /// File of tenants, their quotas, and tokens for the OpenEnv face; `causeway token new` makes
    /// them.
    #[arg(long, env = "CAUSEWAY_TOKENS", value_name = "FILE")]
    tokens: Option<PathBuf>,
    /// Without --tokens: serve anybody who reaches the OpenEnv face beyond the loopback.
    #[arg(long, env = "CAUSEWAY_OPEN", value_parser = clap::builder::FalseyValueParser::new())]
    open: bool,
    /// Where the services and other clients of the bus meet; port 0 takes any free one.
    #[arg(
        long,
        value_name = "(tcp|tls)/HOST:PORT",
        default_value = "tcp/127.0.0.1:7460",
        default_value_if("bus_pki", ArgPredicate::IsPresent, "tls/127.0.0.1:7460")
    )]
    bus: BusAddress,
    /// Folder of certificates, as deploy/bus/certificates.sh makes it, with which the services
    /// meet; without it every user of this machine can use every world.
    #[arg(long, value_name = "DIR")]
    bus_pki: Option<PathBuf>,
    /// Folder with OpenDRIVE files (`<map name>.xodr`) that win over the built-in maps.
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
    /// Folder with files of scenarios (`<scenario name>.toml`) beside the built-in ones.
    #[arg(long, env = "CAUSEWAY_SCENARIOS", value_name = "DIR")]
    scenarios: Option<PathBuf>,
    /// Folder for the journals of worlds that are asked to keep one, made when it is needed
    /// [default: that of recordings, beside which they lie then].
    #[arg(long, value_name = "DIR")]
    journals: Option<PathBuf>,
    /// Folder for recordings of CARLA's format [default: recordings].
    #[arg(long, env = "CAUSEWAY_RECORDINGS", value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Threads that advance worlds [default: one per core].
    #[arg(long, value_name = "N", value_parser = world_service::thread_count)]
    threads: Option<NonZeroUsize>,
    /// Where clients of CARLA connect, each port a world of its own, for clients of 0.9.16, or of
    /// 0.10.0 as in 2000@0.10, and of a tenant if that is named; port 0 takes any free one.
    #[arg(
        long,
        env = "CARLA_PORT",
        value_name = "PORT[@VERSION][=TENANT]",
        default_value = "2000",
        value_delimiter = ','
    )]
    carla: Vec<PortOfTenant>,
    /// Where they have the streams of sensors, a port for each, 0 for any free one [default: the
    /// next after each].
    #[arg(long, value_name = "PORT", value_delimiter = ',')]
    carla_stream: Vec<u16>,
    /// Address on which CARLA endpoints listen. Loopback unless told otherwise: nobody is asked for
    /// a password.
    #[arg(long, env = "CAUSEWAY_CARLA_HOST", value_name = "ADDRESS", default_value = "127.0.0.1")]
    carla_host: IpAddr,
    /// Networks whose clients may connect to a CARLA endpoint, e.g. 2000=10.0.3.0/24 [default: all
    /// that reach it].
    #[arg(long, value_name = "PORT=ADDRESS/BITS", value_delimiter = ',')]
    allow: Vec<Allowed>,
    /// Start no CARLA gateway.
    #[arg(long)]
    no_carla: bool,
    /// Map of the CARLA endpoints' first world.
    #[arg(long, value_name = "NAME", default_value = "Town10HD_Opt")]
    carla_map: String,
    /// Ticks per second of CARLA endpoints in asynchronous mode [default: 30]
    #[arg(long, value_name = "N", value_parser = carla_gateway::ticks_per_second)]
    fps: Option<f64>,
    /// Clients of a CARLA endpoint in synchronous mode tick together: its world advances when each
    /// that ticks has asked, and waits so long for one that does not [default: each tick counts]
    #[arg(long, value_name = "SECS", value_parser = carla_gateway::lease_secs)]
    share_clock: Option<f64>,
    /// Cars that clients of CARLA endpoints spawn: CARLA's (its tyres, steering and engines), which
    /// its programs and the corners of its maps are made for, or real ones.
    #[arg(long, alias = "tyres", value_enum, default_value_t)]
    cars: Cars,
    /// Which way the latitudes of sensor.other.gnss grow: to the south, as in CARLA 0.9.16, or to
    /// the north, as before, for programs that drive by them.
    #[arg(long, value_enum, default_value_t)]
    latitudes: Latitudes,
    /// When a replay of a recording is over, its vehicles drive on in traffic instead of standing.
    #[arg(long)]
    drive_after_replays: bool,
    /// Renderers to start; each is a process of its own.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "no_render")]
    render: u8,
    /// What draws: cpu, or part of a Vulkan adapter's name [default: CAUSEWAY_ADAPTER, else a GPU
    /// if there is one, else cpu].
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Start no renderer: `capture_image` then answers without a picture and says why.
    #[arg(long)]
    no_render: bool,
    /// How finely pictures in colour are drawn whose cameras do not say it.
    #[arg(long, value_enum, default_value_t, env = "CAUSEWAY_QUALITY")]
    quality: Quality,
    /// What the services are asked: its port is that of the site as a whole, which is ready when
    /// all services are that it is of no use without; the services have the ports after it.
    #[command(flatten)]
    admin: AdminArgs,
    #[command(flatten)]
    drain: DrainArgs,
    #[command(flatten)]
    audit: AuditArgs,
}

/// Where recordings lie unless told otherwise, as for gateways.
const RECORDINGS: &str = "recordings";

/// Why a site cannot start as typed. Nothing was started.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlanError {
    /// What is to draw is not there.
    #[error("--adapter: {0}")]
    Adapter(#[from] render_service::RenderError),
    /// Somebody listens there already.
    #[error("{0}")]
    Port(#[from] PortTaken),
    /// Everybody could use it.
    #[error("--http: {0}")]
    Unguarded(#[from] scenario_service::Unguarded),
    /// The file of tenants is none.
    #[error("--tokens: {0}")]
    Tokens(#[from] tenancy::DoorError),
    /// Streams of some endpoints only.
    #[error("--carla-stream wants one port for each of --carla: {wanted}, found {found}")]
    Streams {
        /// Endpoints.
        wanted: usize,
        /// Ports of streams.
        found: usize,
    },
    /// No folder, and none can be made.
    #[error("--audit needs a folder: {cause}: {path:?}")]
    Audit {
        /// As typed.
        path: PathBuf,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// A port is that of two endpoints, or of one's calls and another's streams.
    #[error(
        "--carla: port {0} is wanted twice: each endpoint takes two, --carla-stream names the second"
    )]
    PortTwice(u16),
    /// Guests of an endpoint that there is not.
    #[error("--allow: no endpoint has the port {0}; --carla names their ports")]
    Allow(u16),
    /// CARLA's clients would find no world.
    #[error("--carla-map: there is no map {name:?}; wanted one of: {known}")]
    NoMap {
        /// As typed.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// Certificates that nobody would show.
    #[error("--bus-pki wants --bus tls/HOST:PORT, found {0}: over tcp/ nobody shows certificates")]
    InTheOpen(BusAddress),
    /// No folder, or one that may not be read.
    #[error("--{setting} needs a folder that can be read: {cause}: {path:?}")]
    Folder {
        /// What it is for.
        setting: &'static str,
        /// As typed.
        path: PathBuf,
        /// What the operating system says.
        cause: std::io::Error,
    },
}

/// What is started and where it is found; all ports were free a moment ago.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// The OpenEnv address, with its port.
    pub(crate) http: SocketAddr,
    /// The bus, with its port.
    pub(crate) bus: BusAddress,
    /// By what this process looks at the bus, where that asks.
    pub(crate) identity: Option<Identity>,
    /// The CARLA endpoints' ports.
    pub(crate) carla: Vec<PortOfTenant>,
    /// In the order in which they are started.
    pub(crate) services: Vec<Service>,
    /// Where the site as a whole is asked how it is.
    pub(crate) admin: AdminArgs,
    /// How long services may take to end.
    pub(crate) window: Duration,
}

impl Args {
    /// The adapter that is to draw, where one is named.
    pub(crate) fn adapter(&self) -> Option<&str> {
        self.adapter.as_deref().filter(|_| !self.no_render && self.render > 0)
    }
}

impl Plan {
    /// # Errors
    /// The first setting that cannot work.
    pub(crate) fn resolve(mut args: Args) -> Result<Self, PlanError> {
        check_what_is_named(&args)?;
        if !scenario_service::is_guarded(args.http, args.tokens.is_some(), args.open) {
            return Err(scenario_service::Unguarded(args.http).into());
        }
        if let Some(path) = &args.tokens {
            Door::with_tokens(path)?;
        }
        if let Some(path) = &args.audit.audit {
            let wrong = |cause| PlanError::Audit { path: path.clone(), cause };
            std::fs::create_dir_all(path).map_err(wrong)?;
        }
        if args.bus_pki.is_some() && !args.bus.is_tls() {
            return Err(PlanError::InTheOpen(args.bus));
        }
        let http = ports::usable_http(args.http)?;
        let bus = ports::free_bus(&args.bus)?;
        let wanted: &[PortOfTenant] = if args.no_carla { &[] } else { &args.carla };
        let streams = &args.carla_stream;
        if !streams.is_empty() && streams.len() != wanted.len() {
            return Err(PlanError::Streams { wanted: wanted.len(), found: streams.len() });
        }
        let streams = streams.iter().copied().map(Some).chain(std::iter::repeat(None));
        let (carla, streams): (Vec<_>, Vec<_>) = std::iter::zip(wanted, streams)
            .map(|(at, streams)| {
                let (port, streams) = ports::free_carla(args.carla_host, at.port, streams)?;
                Ok((PortOfTenant { port, ..at.clone() }, streams))
            })
            .collect::<Result<_, PortTaken>>()?;
        let mut taken = BTreeSet::new();
        let all = carla.iter().map(|at| at.port).chain(streams.iter().copied());
        if let Some(port) = all.into_iter().find(|port| !taken.insert(*port)) {
            return Err(PlanError::PortTwice(port));
        }
        let is_open = |rule: &&Allowed| carla.iter().any(|at| at.port == rule.port());
        if let Some(rule) = args.allow.iter().find(|rule| !is_open(rule)) {
            return Err(PlanError::Allow(rule.port()));
        }
        if !args.carla_stream.is_empty() {
            args.carla_stream = streams;
        }
        let mut services = services(&args, http, &bus, &carla);
        let mut admin = args.admin;
        if let Some(address) = &mut admin.admin {
            *address = ports::free_admin(*address, services.len())?;
            let beside = (address.port() + 1..).zip(&mut services);
            beside.for_each(|(port, service)| service.watch(SocketAddr::new(address.ip(), port)));
        }
        if let Some(folder) = &args.audit.audit {
            services.iter_mut().for_each(|service| service.write_down_in(folder));
        }
        if let Some(folder) = &args.bus_pki {
            services.iter_mut().for_each(|service| service.show_certificate_of(folder));
        }
        let window = Duration::from_secs(args.drain.drain_secs);
        services.iter_mut().for_each(|service| service.drain_within(args.drain.drain_secs));
        let identity = args.bus_pki.as_deref().map(|folder| identity_in(folder, "face"));
        Ok(Self { http, bus, identity, carla, services, admin, window })
    }
}

/// Whether folders, the adapter and the map are there.
fn check_what_is_named(args: &Args) -> Result<(), PlanError> {
    for (setting, path) in [("maps", &args.maps), ("scenarios", &args.scenarios)] {
        path.as_deref().map_or(Ok(()), |path| check_folder(setting, path))?;
    }
    for (setting, path) in [("recordings", &args.recordings), ("journals", &args.journals)] {
        path.as_deref().map_or(Ok(()), |path| check_new_folder(setting, path))?;
    }
    if let Some(name) = args.adapter() {
        AdapterChoice::parse(name).check()?;
    }
    if !args.no_carla {
        check_map(&args.carla_map, args.maps.as_deref())?;
    }
    Ok(())
}

/// The world service comes first: everybody else connects to it.
fn services(
    args: &Args,
    http: SocketAddr,
    bus: &BusAddress,
    carla: &[PortOfTenant],
) -> Vec<Service> {
    let mut services = vec![world(args, bus), scenario(args, http, bus)];
    if !carla.is_empty() {
        services.push(gateway(args, carla, bus));
    }
    let renderers = if args.no_render { 0 } else { args.render };
    services.extend((0..renderers).map(|index| renderer(args, index, bus)));
    services
}

fn world(args: &Args, bus: &BusAddress) -> Service {
    let mut arguments = flag("--listen", bus.to_string());
    if let Some(path) = &args.maps {
        arguments.extend([OsString::from("--maps"), path.clone().into_os_string()]);
    }
    let journals = args.journals.clone().or_else(|| args.recordings.clone());
    let journals = journals.unwrap_or_else(|| PathBuf::from(RECORDINGS));
    arguments.extend([OsString::from("--journals"), journals.into_os_string()]);
    if let Some(threads) = args.threads {
        arguments.extend(flag("--threads", threads.to_string()));
    }
    Service { arguments, ..Service::new("world") }
}

fn scenario(args: &Args, http: SocketAddr, bus: &BusAddress) -> Service {
    let mut arguments = flag("--connect", bus.to_string());
    arguments.extend(flag("--http", http.to_string()));
    if let Some(path) = &args.tokens {
        arguments.extend([OsString::from("--tokens"), path.clone().into_os_string()]);
    }
    if let Some(path) = &args.scenarios {
        arguments.extend([OsString::from("--scenarios"), path.clone().into_os_string()]);
    }
    if args.open {
        arguments.push(OsString::from("--open"));
    }
    Service { arguments, is_face: true, ..Service::new("scenario") }
}

fn gateway(args: &Args, ports: &[PortOfTenant], bus: &BusAddress) -> Service {
    let mut arguments = flag("--connect", bus.to_string());
    let ports: Vec<String> = ports.iter().map(ToString::to_string).collect();
    arguments.extend(flag("--port", ports.join(",")));
    if !args.carla_stream.is_empty() {
        let streams: Vec<String> = args.carla_stream.iter().map(ToString::to_string).collect();
        arguments.extend(flag("--stream-port", streams.join(",")));
    }
    let allowed = args.allow.iter().flat_map(|rule| flag("--allow", rule.to_string()));
    arguments.extend(allowed);
    arguments.extend(flag("--host", args.carla_host.to_string()));
    arguments.extend(flag("--map", args.carla_map.clone()));
    if let Some(fps) = args.fps {
        arguments.extend(flag("--fps", fps.to_string()));
    }
    if let Some(secs) = args.share_clock {
        arguments.extend(flag("--share-clock", secs.to_string()));
    }
    if let Some(path) = &args.recordings {
        arguments.extend([OsString::from("--recordings"), path.clone().into_os_string()]);
    }
    if let Some(path) = &args.tokens {
        arguments.extend([OsString::from("--tokens"), path.clone().into_os_string()]);
    }
    arguments.extend(flag("--cars", args.cars.to_string()));
    arguments.extend(flag("--latitudes", args.latitudes.to_string()));
    if args.drive_after_replays {
        arguments.extend(flag("--after-replays", "drive".to_owned()));
    }
    Service { arguments, is_face: true, ..Service::new("gateway") }
}

fn renderer(args: &Args, index: u8, bus: &BusAddress) -> Service {
    let mut arguments = flag("--connect", bus.to_string());
    if let Some(adapter) = &args.adapter {
        arguments.extend(flag("--adapter", adapter.clone()));
    }
    arguments.extend(flag("--quality", args.quality.name().to_owned()));
    // The site is of use without pictures, so a machine without Vulkan gets a warning.
    let stem = format!("render-{index}");
    Service { stem, arguments, essential: false, ..Service::new("render") }
}

fn flag(name: &str, value: String) -> Vec<OsString> {
    vec![name.into(), value.into()]
}
