//! How a process sits on the bus, and the transport settings that follow.

use std::time::Duration;

use schemas::{Tenant, limits};

use crate::{BusAddress, BusError, Identity, access};

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
/// A connection on which nothing is said is given up after this time, by either side: the kernel of
/// a process that hangs still accepts.
const HANDSHAKE_TIMEOUT_MILLIS: u64 = 1_000;
/// Sessions one process accepts: four times the planned number.
const SESSIONS_MAX: usize = 4_096;
/// A receiver of a reply that takes nothing for this time is cut off; meanwhile it holds up the
/// thread that answers it.
const STUCK_RECEIVER_MICROS: u64 = 1_000_000;
/// Parts of a large message that may wait for the thread that sends, the most there can be. With
/// the usual two, whoever sends waits for it: 0.9 MB then take 0.9 ms on their way and not 0.7.
const PARTS_WAITING_MAX: usize = 16;
/// See `.cargo/config.toml`, which cargo reads where it is run.
const _: () = assert!(
    matches!(option_env!("TCP_LINGER_TIMEOUT"), Some(secs) if matches!(secs.as_bytes(), b"0")),
    "wanted TCP_LINGER_TIMEOUT=0: build in the folder of the checkout"
);
/// First and longest pause between two attempts to connect.
pub(crate) const RETRY_MILLIS: (u64, u64) = (10, 500);

/// How a process sits on the bus.
///
/// Who listens passes traffic on, so that all who connect to it reach each other; who only connects
/// leaves routing to the other side.
#[derive(Clone, Debug, Default)]
pub struct BusConfig {
    /// Where others may connect; port 0 means any free one.
    pub listen: Vec<BusAddress>,
    /// Whom to connect to, and to reconnect to for ever. Who only connects uses the first that
    /// answers; who also listens connects to all.
    pub connect: Vec<BusAddress>,
    /// How long [`Bus::open`](crate::Bus::open) waits for the first connection; `None`: for ever.
    pub connect_deadline: Option<Duration>,
    /// For addresses with TLS. Who listens at one denies what the role of a certificate does not
    /// need.
    pub identity: Option<Identity>,
    /// Tenants whose certificates may watch their worlds, for who listens with TLS.
    pub watchers: Vec<Tenant>,
}

impl BusConfig {
    /// Everyone who connects to this address reaches everyone else.
    pub fn listening(address: BusAddress) -> Self {
        Self { listen: vec![address], ..Self::default() }
    }

    /// On the bus of somebody who listens.
    pub fn connecting(address: BusAddress) -> Self {
        Self { connect: vec![address], ..Self::default() }
    }

    /// Whether routing is left to others.
    pub(crate) fn only_connects(&self) -> bool {
        self.listen.is_empty()
    }

    /// The transport's settings.
    pub(crate) fn to_zenoh(&self) -> Result<zenoh::Config, BusError> {
        let quoted = |addresses: &[BusAddress]| {
            let texts: Vec<String> =
                addresses.iter().map(|address| format!("\"{address}\"")).collect();
            format!("[{}]", texts.join(","))
        };
        // Peers that only connect do not hear of each other's declarations through the one in the
        // middle, and may ask before they hear of its own; clients have neither trouble.
        let mode = if self.only_connects() { "\"client\"" } else { "\"router\"" };
        let connect_millis = match self.connect_deadline {
            // Each address once: with more time the first would be tried until that is over.
            _ if self.only_connects() => "0".to_owned(),
            Some(deadline) => deadline.as_millis().to_string(),
            None => "-1".to_owned(),
        };
        let (retry_first, retry_max) = RETRY_MILLIS;
        // Who listens serves those who come, whether or not the others answer that it should join.
        let waits_for_others = self.only_connects();
        let settings = [
            ("mode", mode.to_owned()),
            ("listen/endpoints", quoted(&self.listen)),
            ("connect/endpoints", quoted(&self.connect)),
            ("connect/timeout_ms", connect_millis),
            ("connect/exit_on_failure", waits_for_others.to_string()),
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
            ("transport/unicast/open_timeout", HANDSHAKE_TIMEOUT_MILLIS.to_string()),
            ("transport/unicast/accept_timeout", HANDSHAKE_TIMEOUT_MILLIS.to_string()),
            ("transport/unicast/qos/enabled", "false".to_owned()),
            // Nobody may choose it either: whoever publishes writes to its sockets himself, and one
            // receiver that stands still then stops the process that sends.
            ("transport/unicast/lowlatency", "false".to_owned()),
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
            return Err(BusError::NoAddress);
        }
        let mut config = zenoh::Config::default();
        for (name, value) in settings.into_iter().chain(self.secured()?) {
            config
                .insert_json5(name, &value)
                .map_err(|cause| BusError::Setting { name, cause: cause.to_string() })?;
        }
        Ok(config)
    }

    /// Settings of addresses with TLS.
    fn secured(&self) -> Result<Vec<(&'static str, String)>, BusError> {
        let mut secured = self.listen.iter().chain(&self.connect).filter(|one| one.is_tls());
        let Some(identity) = &self.identity else {
            return match secured.next() {
                Some(address) => Err(BusError::NoIdentity { address: address.clone() }),
                None => Ok(Vec::new()),
            };
        };
        let mut settings = identity.settings()?.to_vec();
        if self.listen.iter().any(BusAddress::is_tls) {
            settings.push(("access_control", access::list(&self.watchers).to_string()));
        }
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn every_setting_is_one_the_transport_knows() {
        BusConfig::listening(BusAddress::loopback(0)).to_zenoh().unwrap();
        BusConfig::connecting(BusAddress::loopback(7460)).to_zenoh().unwrap();
        BusConfig {
            connect_deadline: Some(Duration::from_secs(1)),
            ..BusConfig::connecting(BusAddress::loopback(7460))
        }
        .to_zenoh()
        .unwrap();
    }

    #[test]
    fn an_address_with_tls_wants_certificates_and_has_an_access_list() {
        let config = BusConfig::listening("tls/127.0.0.1:0".parse().unwrap());
        assert!(matches!(config.to_zenoh(), Err(BusError::NoIdentity { .. })));
        let file = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
        let identity = |key: &str| {
            let (authority, certificate) = (file.clone(), file.clone());
            Some(Identity { authority, certificate, key: file.with_file_name(key) })
        };
        let absent = BusConfig { identity: identity("nothing.key"), ..config.clone() }.to_zenoh();
        assert!(absent.unwrap_err().to_string().contains("nothing.key"));
        let watchers = vec!["alice".parse().unwrap()];
        let config = BusConfig { identity: identity("Cargo.toml"), watchers, ..config };
        let list = config.to_zenoh().unwrap().get_json("access_control").unwrap();
        assert!(list.contains("\"deny\"") && list.contains("tenant-alice"), "{list}");
        // Who only connects denies nobody anything.
        let (connect, listen) = (config.listen.clone(), Vec::new());
        let config = BusConfig { connect, listen, ..config };
        let list = config.to_zenoh().unwrap().get_json("access_control").unwrap();
        assert!(!list.contains("tenant-alice"), "{list}");
    }
}
