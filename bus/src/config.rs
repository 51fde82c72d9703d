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
/// Parts of a large message that may wait for the thread that sends, the most there can be. With
/// the usual two, whoever sends waits for it: 0.9 MB then take 0.9 ms on their way and not 0.7.
const PARTS_WAITING_MAX: usize = 16;
/// First and longest pause between two attempts to connect.
const RETRY_MILLIS: (u64, u64) = (10, 500);

/// Which transport a session wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Speed {
    /// Messages of any size, sent by threads of the transport.
    Usual,
    /// Small messages only, sent by whoever has something to say.
    Fast,
}

/// How a process sits on the bus.
///
/// Who listens passes traffic on, so that all who connect to it reach each other; who only connects
/// leaves routing to the other side.
#[derive(Clone, Debug, Default)]
pub struct BusConfig {
    /// Where others may connect; port 0 means any free one.
    pub listen: Vec<Endpoint>,
    /// Whom to connect to, and to reconnect to for ever. Who only connects uses the first that
    /// answers; who also listens connects to all.
    pub connect: Vec<Endpoint>,
    /// How long [`Bus::open`](crate::Bus::open) waits for the first connection; `None`: for ever.
    pub connect_deadline: Option<Duration>,
}

impl BusConfig {
    /// Everyone who connects to this endpoint reaches everyone else.
    pub fn listening(endpoint: Endpoint) -> Self {
        Self { listen: vec![endpoint], ..Self::default() }
    }

    /// On the bus of somebody who listens.
    pub fn connecting(endpoint: Endpoint) -> Self {
        Self { connect: vec![endpoint], ..Self::default() }
    }

    /// The transport's settings.
    pub(crate) fn to_zenoh(&self, speed: Speed) -> Result<zenoh::Config, BusError> {
        let quoted = |endpoints: &[Endpoint]| {
            let texts: Vec<String> =
                endpoints.iter().map(|endpoint| format!("\"{endpoint}\"")).collect();
            format!("[{}]", texts.join(","))
        };
        // Peers that only connect do not hear of each other's declarations through the one in the
        // middle, and may ask before they hear of its own; clients have neither trouble.
        let mode = if self.listen.is_empty() { "\"client\"" } else { "\"router\"" };
        let connect_millis = match self.connect_deadline {
            Some(deadline) => deadline.as_millis().to_string(),
            None => "-1".to_owned(),
        };
        let (retry_first, retry_max) = RETRY_MILLIS;
        // Who listens leaves the choice to each of those who connect.
        let is_fast = speed == Speed::Fast || !self.listen.is_empty();
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
            // Half a second of waiting for discoveries that are switched off.
            ("scouting/delay", "0".to_owned()),
            ("transport/unicast/accept_timeout", ACCEPT_TIMEOUT_MILLIS.to_string()),
            // The two exclude each other.
            ("transport/unicast/qos/enabled", (!is_fast).to_string()),
            ("transport/unicast/lowlatency", is_fast.to_string()),
            ("transport/unicast/max_sessions", SESSIONS_MAX.to_string()),
            ("transport/link/tx/lease", LEASE_MILLIS.to_string()),
            ("transport/link/tx/queue/size/data", PARTS_WAITING_MAX.to_string()),
            (
                "transport/link/tx/queue/congestion_control/block/wait_before_close",
                STUCK_RECEIVER_MICROS.to_string(),
            ),
            ("transport/link/rx/max_message_size", MESSAGE_BYTES_MAX.to_string()),
        ];
        if self.listen.is_empty() && self.connect.is_empty() {
            return Err(BusError::NoEndpoint);
        }
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
        BusConfig::listening(Endpoint::loopback(0)).to_zenoh(Speed::Usual).unwrap();
        BusConfig::connecting(Endpoint::loopback(7447)).to_zenoh(Speed::Fast).unwrap();
        BusConfig {
            connect_deadline: Some(Duration::from_secs(1)),
            ..BusConfig::connecting(Endpoint::loopback(7447))
        }
        .to_zenoh(Speed::Usual)
        .unwrap();
    }
}
