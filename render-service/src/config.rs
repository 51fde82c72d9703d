//! What was typed, and what the service runs with.

use bus::{BusAddress, Identity, IdentityArgs};
use schemas::{PictureQuality, ServiceId, ServiceKind};

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
    /// How finely pictures in colour are drawn whose cameras do not say it
    #[arg(long, value_enum, default_value_t, env = "CAUSEWAY_QUALITY")]
    pub quality: Quality,
}

/// How finely pictures in colour are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Quality {
    /// More pictures a second, with coarser light and patterns.
    Low,
    /// All that the renderer can.
    #[default]
    High,
}

impl Quality {
    /// As cameras say it.
    pub const fn of_pictures(self) -> PictureQuality {
        match self {
            Self::Low => PictureQuality::Low,
            Self::High => PictureQuality::High,
        }
    }

    /// As it is typed.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::High => "high",
        }
    }
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
    /// Of cameras that do not say theirs.
    pub quality: PictureQuality,
}

impl From<Args> for Config {
    fn from(args: Args) -> Self {
        Self {
            connect: args.connect,
            identity: args.identity.identity(),
            id: args.id,
            adapter: AdapterChoice::parse(&args.adapter),
            quality: args.quality.of_pictures(),
        }
    }
}
