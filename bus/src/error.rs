//! Why a process cannot take its place on the bus.

use schemas::{ServiceId, ServiceKind};

use crate::BusAddress;

/// Why the bus cannot be opened or served. Nothing stays declared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BusError {
    /// A bus of one.
    #[error("neither an address to listen on nor one to connect to; give --listen or --connect")]
    NoAddress,
    /// The port is taken or the address is not ours.
    #[error("cannot listen on {address}: {cause}; free it or give another --listen")]
    Listen {
        /// As given.
        address: BusAddress,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// Nobody answered there before the deadline.
    #[error("no bus at {}: {cause}", addresses.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))]
    Connect {
        /// As given.
        addresses: Vec<BusAddress>,
        /// What the transport says.
        cause: String,
    },
    /// Nobody is known there without a certificate.
    #[error("{address} asks for certificates: give --bus-ca, --bus-cert and --bus-key")]
    NoIdentity {
        /// As given.
        address: BusAddress,
    },
    /// A certificate or a key that is not there, or not for this user to read.
    #[error("cannot read {path:?}: {cause}; see --bus-ca, --bus-cert and --bus-key")]
    IdentityFile {
        /// As given.
        path: std::path::PathBuf,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// A setting the transport refuses; our own fault.
    #[error("the bus refuses the setting {name}: {cause}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What the transport says.
        cause: String,
    },
    /// A key cannot be declared.
    #[error("cannot declare {key:?} on the bus: {cause}")]
    Declare {
        /// Which.
        key: String,
        /// What the transport says.
        cause: String,
    },
    /// The system refuses a socket beside the bus.
    #[error("no shortcut to {key:?}: {cause}")]
    Shortcut {
        /// To what.
        key: String,
        /// What the operating system says.
        cause: std::io::Error,
    },
    /// Two services of one kind have one name.
    #[error(
        "another {} service on this bus is named \"{id}\"; give one of them another --id",
        kind.as_str()
    )]
    NameTaken {
        /// Which kind.
        kind: ServiceKind,
        /// Whose name.
        id: ServiceId,
    },
}
