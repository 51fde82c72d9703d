//! How a process sits on the bus, and the transport settings that follow.

use std::time::Duration;

use schemas::limits;

use crate::{BusError, Endpoint};

/// Largest message the transport accepts, in bytes: the largest legal payload and its envelope.
const MESSAGE_BYTES_MAX: usize = {
    let reply = if limits::REPLY_BYTES_MAX > limits::REQUEST_BYTES_MAX {
        limits::REPLY_BYTES_MAX
    } else {
        limits::REQUEST_BYTES_MAX
    };
    let payload = if limits::MAP_BYTES_MAX > reply { limits::MAP_BYTES_MAX } else { reply };
    payload + 64 * 1024
};
/// A silent peer is given up after this time.
const LEASE_MILLIS: u64 = 2_000;
/// A connection that says nothing is closed after this time.
const ACCEPT_TIMEOUT_MILLIS: u64 = 1_000;
/// Sessions one process accepts: four times the planned number.
const SESSIONS_MAX: usize = 4_096;
/// A receiver of a reply that takes nothing for this time is cut off; meanwhile it holds up the
/// thread that answers it.
const STUCK_RECEIVER_MICROS: u64 = 1_000_000;
/// First and longest pause between two attempts to connect.
const RETRY_MILLIS: (u64, u64) = (10, 500);

/// What a process does for the traffic of others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// Nothing.
    #[default]
    Peer,
    /// Passes it on.
    Router,
}

/// How a process sits on the bus.
#[derive(Clone, Debug, Default)]
pub struct BusConfig {
    /// Peer or router.
    pub role: Role,
    /// Where others may connect; port 0 means any free one.
    pub listen: Vec<Endpoint>,
    /// Whom to connect to, and to reconnect to for ever.
    pub connect: Vec<Endpoint>,
    /// How long [`Bus::open`](crate::Bus::open) waits for the first connection; `None`: for ever.
    pub connect_deadline: Option<Duration>,
}

impl BusConfig {
    /// A router on one endpoint: everyone who connects reaches everyone else.
    pub fn listening(endpoint: Endpoint) -> Self {
        Self { role: Role::Router, listen: vec![endpoint], ..Self::default() }
    }

    /// A peer of one endpoint.
    pub fn connecting(endpoint: Endpoint) -> Self {
        Self { connect: vec![endpoint], ..Self::default() }
    }

    /// The transport's settings.
    pub(crate) fn to_zenoh(&self) -> Result<zenoh::Config, BusError> {
        let quoted = |endpoints: &[Endpoint]| {
            let texts: Vec<String> =
                endpoints.iter().map(|endpoint| format!("\"{endpoint}\"")).collect();
            format!("[{}]", texts.join(","))
        };
        let mode = match self.role {
            Role::Peer => "\"peer\"",
            Role::Router => "\"router\"",
        };
        let connect_millis = match self.connect_deadline {
            Some(deadline) => deadline.as_millis().to_string(),
            None => "-1".to_owned(),
        };
        let (retry_first, retry_max) = RETRY_MILLIS;
        let settings = [
            ("mode", mode.to_owned()),
            ("listen/endpoints", quoted(&self.listen)),
            ("connect/endpoints", quoted(&self.connect)),
            ("connect/timeout_ms", connect_millis),
            ("connect/exit_on_failure", "true".to_owned()),
            (
                "connect/retry",
                format!(
                    "{{period_init_ms: {retry_first}, period_max_ms: {retry_max}, period_increase_factor: 1.5}}"
                ),
            ),
            ("scouting/multicast/enabled", "false".to_owned()),
            ("scouting/gossip/enabled", "false".to_owned()),
            ("transport/unicast/accept_timeout", ACCEPT_TIMEOUT_MILLIS.to_string()),
            ("transport/unicast/max_sessions", SESSIONS_MAX.to_string()),
            ("transport/link/tx/lease", LEASE_MILLIS.to_string()),
            (
                "transport/link/tx/queue/congestion_control/block/wait_before_close",
                STUCK_RECEIVER_MICROS.to_string(),
            ),
            ("transport/link/rx/max_message_size", MESSAGE_BYTES_MAX.to_string()),
        ];
        let mut config = zenoh::Config::default();
        for (name, value) in settings {
            config
                .insert_json5(name, &value)
                .map_err(|cause| BusError::Setting { name, cause: cause.to_string() })?;
        }
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_one_the_transport_knows() {
        BusConfig::listening(Endpoint::loopback(0)).to_zenoh().unwrap();
        BusConfig {
            connect_deadline: Some(Duration::from_secs(1)),
            ..BusConfig::connecting(Endpoint::loopback(7447))
        }
        .to_zenoh()
        .unwrap();
    }
}
