//! What was typed, and what the service runs with.

use bus::Endpoint;
use schemas::ServiceId;

use crate::AdapterChoice;

/// Draws pictures of worlds.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The bus to join; may be repeated [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT")]
    pub connect: Vec<Endpoint>,
    /// Name on the bus; two of one kind need different ones
    #[arg(long, default_value = "render")]
    pub id: ServiceId,
    /// Part of an adapter's name, or cpu for software [default: a GPU if there is one]
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
    pub connect: Vec<Endpoint>,
    /// Name on the bus.
    pub id: ServiceId,
    /// What draws.
    pub adapter: AdapterChoice,
}

/// Where a world service listens unless told otherwise.
const BUS_PORT: u16 = 7447;

impl From<Args> for Config {
    fn from(args: Args) -> Self {
        let mut connect = args.connect;
        if connect.is_empty() {
            connect.push(Endpoint::loopback(BUS_PORT));
        }
        Self { connect, id: args.id, adapter: AdapterChoice::parse(&args.adapter) }
    }
}
