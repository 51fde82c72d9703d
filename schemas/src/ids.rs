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
    /// `None` for 0, which no actor has.
    pub const fn new(value: u32) -> Option<Self> {
        match NonZeroU32::new(value) {
            Some(value) => Some(Self(value)),
            None => None,
        }
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

/// A name that is one chunk of a key: 1 to 32 of `[a-z0-9-]`, so it can never hold key syntax.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name(String);

/// Why a text is not a [`Name`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a name is 1 to 32 of a-z, 0-9 and '-', not {found:?}")]
pub struct InvalidName {
    /// The text, cut to 64 characters.
    pub found: String,
}

impl Name {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for Name {
    type Err = InvalidName;

    fn from_str(text: &str) -> Result<Self, InvalidName> {
        let allowed = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'-';
        if (1..=32).contains(&text.len()) && text.bytes().all(allowed) {
            Ok(Self(text.to_owned()))
        } else {
            Err(InvalidName { found: text.chars().take(64).collect() })
        }
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// One customer of a shared site.
pub type Tenant = Name;
/// One process of a site, on the bus.
pub type ServiceId = Name;
