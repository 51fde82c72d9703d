//! A value that may differ from town to town.

use std::collections::BTreeMap;

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer};

/// The key of all towns that are not named.
const OTHER: &str = "other";

/// One value, or one for each of some towns and one for all others.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ByTown<T> {
    other: T,
    towns: BTreeMap<String, T>,
}

impl<T> ByTown<T> {
    /// That of a map: of the town whose name is part of its own, such as `Town01_Opt`.
    pub(crate) fn of(&self, map: &str) -> &T {
        let named = self.towns.iter().find(|(town, _)| map.contains(town.as_str()));
        named.map_or(&self.other, |(_, value)| value)
    }

    pub(crate) fn values(&self) -> impl Iterator<Item = &T> {
        std::iter::once(&self.other).chain(self.towns.values())
    }
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for ByTown<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let read = |value: toml::Value| T::deserialize(value).map_err(D::Error::custom);
        match toml::Value::deserialize(deserializer)? {
            toml::Value::Table(table) => {
                let mut towns = BTreeMap::new();
                for (town, value) in table {
                    towns.insert(town, read(value)?);
                }
                let missing = || D::Error::custom("the value of `other` towns is missing");
                Ok(Self { other: towns.remove(OTHER).ok_or_else(missing)?, towns })
            }
            value => Ok(Self { other: read(value)?, towns: BTreeMap::new() }),
        }
    }
}
