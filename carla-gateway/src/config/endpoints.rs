//! Where endpoints are, whose they are, and who may connect.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use schemas::Tenant;

use super::ConfigError;
use crate::dialect::ClientVersion;
use crate::guests::{Allowed, Guests};

/// A port of an endpoint, as typed: `PORT[@VERSION][=TENANT]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortOfTenant {
    /// For calls.
    pub port: u16,
    /// Of its clients.
    pub version: ClientVersion,
    /// Owner of its worlds; `None`: that of the gateway.
    pub tenant: Option<Tenant>,
}

impl FromStr for PortOfTenant {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (port, tenant) = match text.split_once('=') {
            Some((port, tenant)) => (port, Some(tenant)),
            None => (text, None),
        };
        let (port, version) = match port.split_once('@') {
            Some((port, version)) => (port, version.parse()?),
            None => (port, ClientVersion::default()),
        };
        let port = port.parse().map_err(|_| {
            format!(
                "wanted PORT[@VERSION][=TENANT], e.g. 2000, 2000@0.10 or 2000=alice, found {text:?}"
            )
        })?;
        let tenant = tenant.map(|tenant| tenant.parse::<Tenant>().map_err(|why| why.to_string()));
        Ok(Self { port, version, tenant: tenant.transpose()? })
    }
}

impl fmt::Display for PortOfTenant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.port)?;
        if self.version != ClientVersion::default() {
            write!(f, "@{}", self.version)?;
        }
        match &self.tenant {
            Some(tenant) => write!(f, "={tenant}"),
            None => Ok(()),
        }
    }
}

/// One endpoint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EndpointConfig {
    pub(crate) ports: Ports,
    /// Of its clients.
    pub(crate) version: ClientVersion,
    /// Owner of its worlds and recordings.
    pub(crate) tenant: Tenant,
    /// Who may connect.
    pub(crate) guests: Guests,
}

/// Where clients of an endpoint connect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ports {
    /// For calls.
    pub(crate) calls: u16,
    /// For the streams of sensors.
    pub(crate) streams: u16,
}

/// Each port of calls with that of its streams, its tenant and its guests; no port twice.
pub(super) fn endpoints(
    calls: &[PortOfTenant],
    streams: &[u16],
    allowed: &[Allowed],
    tenant: &Tenant,
) -> Result<Vec<EndpointConfig>, ConfigError> {
    let unknown = allowed.iter().find(|rule| calls.iter().all(|at| at.port != rule.port));
    if let Some(Allowed { port, .. }) = unknown {
        return Err(ConfigError { setting: "allow", why: format!("{port} is no --port") });
    }
    let ports: Vec<u16> = calls.iter().map(|at| at.port).collect();
    let of = |(at, ports): (&PortOfTenant, Ports)| {
        let own = allowed.iter().filter(|rule| rule.port == at.port);
        EndpointConfig {
            ports,
            version: at.version,
            tenant: at.tenant.clone().unwrap_or_else(|| tenant.clone()),
            guests: Guests(own.map(|rule| rule.network).collect()),
        }
    };
    Ok(calls.iter().zip(pair(&ports, streams)?).map(of).collect())
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

    #[test]
    fn a_port_is_its_tenants_and_its_guests() {
        let calls = ["2000=alice", "2010"].map(|text| text.parse::<PortOfTenant>().unwrap());
        let local = "local".parse().unwrap();
        let of = |allowed: &str| endpoints(&calls, &[], &[allowed.parse().unwrap()], &local);
        let found = of("2000=10.0.3.0/24").unwrap();
        let tenants: Vec<&str> = found.iter().map(|endpoint| endpoint.tenant.as_str()).collect();
        assert_eq!(tenants, ["alice", "local"]);
        assert_eq!(found[0].guests.0.len(), 1);
        assert_eq!(found[1].guests, Guests::default());
        let refused = of("2020=10.0.3.0/24").unwrap_err();
        assert_eq!(refused.to_string(), "--allow: 2020 is no --port");
        assert_eq!(calls[0].to_string(), "2000=alice");
        for wrong in ["", "=alice", "2000=", "2000=Alice", "2000=batch", "70000"] {
            assert!(wrong.parse::<PortOfTenant>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_port_has_the_version_of_its_clients() {
        let parsed = |text: &str| text.parse::<PortOfTenant>();
        for (typed, version, told) in [
            ("2000", ClientVersion::V0_9, "2000"),
            ("2000@0.9.16=alice", ClientVersion::V0_9, "2000=alice"),
            ("2010@0.10", ClientVersion::V0_10, "2010@0.10"),
            ("0@0.10.0=alice", ClientVersion::V0_10, "0@0.10=alice"),
        ] {
            let port = parsed(typed).unwrap();
            assert_eq!((port.version, &*port.to_string()), (version, told));
        }
        for (wrong, why) in [("2000@", "found \"\""), ("2000@0.11", "0.9 or 0.10")] {
            let refusal = parsed(wrong).unwrap_err();
            assert!(refusal.contains(why), "{refusal}");
        }
        assert!(parsed("@0.10").is_err());
    }
}
