//! What was typed, and what the service runs with.

use bus::{BusAddress, Identity, IdentityArgs};
use schemas::{ServiceId, ServiceKind};

use crate::AdapterChoice;

/// Draws pictures of worlds.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Addresses of the bus; without them CARLA_HOST names the host
    #[arg(long, env = "CAUSEWAY_BUS", value_delimiter = ',', value_name = "(tcp|tls)/HOST:PORT",
        default_value = bus::site_address())]
    pub connect: Vec<BusAddress>,
    /// Certificates.
    #[command(flatten)]
    pub identity: IdentityArgs,
    /// Name on the bus; two of one kind need different ones [default: a random one]
    #[arg(long, default_value_t = bus::unused_id(ServiceKind::Render), hide_default_value = true)]
    pub id: ServiceId,
    /// cpu, or part of a Vulkan adapter's name [default: a GPU if there is one, else cpu]
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true,
        env = "CAUSEWAY_ADAPTER"
    )]
    pub adapter: String,
}

/// What the service runs with; consistent.
#[derive(Clone, Debug)]
pub struct Config {
    /// What it joins; never empty.
    pub connect: Vec<BusAddress>,
    /// By what it is known on a bus with TLS.
    pub identity: Option<Identity>,
    /// Name on the bus.
    pub id: ServiceId,
    /// What draws.
    pub adapter: AdapterChoice,
}

impl From<Args> for Config {
    fn from(args: Args) -> Self {
        Self {
            connect: args.connect,
            identity: args.identity.identity(),
            id: args.id,
            adapter: AdapterChoice::parse(&args.adapter),
        }
    }
}
