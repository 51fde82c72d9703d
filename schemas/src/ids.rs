//! Identities. Two kinds of id cannot be swapped, and none is ever reused while its owner lives.

use std::fmt;
use std::num::{NonZeroU32, NonZeroU64};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One world of one site.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WorldId(NonZeroU64);

impl WorldId {
    /// `None` for 0, which no world has.
    pub const fn new(value: u64) -> Option<Self> {
        match NonZeroU64::new(value) {
            Some(value) => Some(Self(value)),
            None => None,
        }
    }

    /// The world with this count among those of a host. Below 2⁵³, which every JSON reader keeps
    /// exact.
    ///
    /// - **Domain:** hosts below 2²⁴; counts wrap around after half a billion.
    pub const fn of_host(host: u32, count: u64) -> Self {
        let count = count % (1 << Self::COUNT_BITS);
        let first = (host as u64 % (1 << Self::HOST_BITS)) << Self::COUNT_BITS;
        match Self::new(first | count) {
            Some(id) if count > 0 => id,
            _ => Self(NonZeroU64::MIN.saturating_add(first)),
        }
    }

    /// The number of the process that owns it, which keys carry so that requests find the way.
    pub const fn host(self) -> u32 {
        (self.0.get() >> Self::COUNT_BITS) as u32
    }

    /// The number on the wire.
    pub const fn get(self) -> u64 {
        self.0.get()
    }

    const COUNT_BITS: u32 = 29;
    /// How many bits the number of a host has.
    pub const HOST_BITS: u32 = 24;
}

impl fmt::Display for WorldId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "world {}", self.0)
    }
}

/// One actor of one world; 0 on the wire means "none" or static scenery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ActorId(NonZeroU32);

impl ActorId {
    /// Of a world that follows no other.
    pub const FIRST: Self = Self(NonZeroU32::MIN);

    /// `None` for 0, which no actor has.
    pub const fn new(value: u32) -> Option<Self> {
        match NonZeroU32::new(value) {
            Some(value) => Some(Self(value)),
            None => None,
        }
    }

    /// The id `count` further on, or the last one there is.
    #[must_use]
    pub const fn plus(self, count: u32) -> Self {
        Self(self.0.saturating_add(count))
    }

    /// The number on the wire.
    pub const fn get(self) -> u32 {
        self.0.get()
    }
}

impl fmt::Display for ActorId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "actor {}", self.0)
    }
}

/// Count of completed steps of one world; tick 0 is the initial state.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Tick(pub u64);

impl fmt::Display for Tick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "tick {}", self.0)
    }
}

/// Words that stand where a tenant's name does in keys that belong to no tenant.
pub const RESERVED: [&str; 6] = ["batch", "render", "alive", "draining", "load", "asset"];

/// Why a text names no tenant and no service.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidName {
    /// It could hold key syntax, or is empty or too long.
    #[error("a name is 1 to 32 of a-z, 0-9 and '-', not {found:?}")]
    Text {
        /// The text, cut to 64 characters.
        found: String,
    },
    /// Keys without a tenant begin with it.
    #[error("a tenant may have any name but {}, not {found:?}", RESERVED.join(", "))]
    Reserved {
        /// The word.
        found: &'static str,
    },
}

/// One customer of a shared site: one chunk of a key, 1 to 32 of `[a-z0-9-]`, none of
/// [`RESERVED`].
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Tenant(String);

/// One process of a site, on the bus: one chunk of a key, 1 to 32 of `[a-z0-9-]`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ServiceId(String);

impl Tenant {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl ServiceId {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for Tenant {
    type Err = InvalidName;

    fn from_str(text: &str) -> Result<Self, InvalidName> {
        match RESERVED.into_iter().find(|word| *word == text) {
            Some(found) => Err(InvalidName::Reserved { found }),
            None => chunk_of_key(text).map(Self),
        }
    }
}

impl FromStr for ServiceId {
    type Err = InvalidName;

    fn from_str(text: &str) -> Result<Self, InvalidName> {
        chunk_of_key(text).map(Self)
    }
}

impl fmt::Display for Tenant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Display for ServiceId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

fn chunk_of_key(text: &str) -> Result<String, InvalidName> {
    let allowed = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'-';
    if (1..=32).contains(&text.len()) && text.bytes().all(allowed) {
        Ok(text.to_owned())
    } else {
        Err(InvalidName::Text { found: text.chars().take(64).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenant_is_never_named_like_a_key_of_the_services() {
        for word in RESERVED {
            assert_eq!(word.parse::<Tenant>(), Err(InvalidName::Reserved { found: word }));
            assert_eq!(word.parse::<ServiceId>().unwrap().as_str(), word);
        }
    }
}
