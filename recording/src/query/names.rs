//! What a query keeps in mind of actors.

use std::collections::BTreeMap;

use super::QueryError;
use crate::record::{Add, Class};

/// Actors of one log.
const ACTORS_MAX: usize = 1_000_000;
/// Characters of all their blueprints.
const NAMES_BYTES_MAX: usize = 64 * 1024 * 1024;

/// Class and blueprint of every actor that a log has had; ids are unique in a log.
#[derive(Default)]
pub(super) struct Names {
    known: BTreeMap<u32, (Class, Box<str>)>,
    bytes: usize,
}

impl Names {
    pub(super) fn note(&mut self, adds: Vec<Add>) -> Result<(), QueryError> {
        for add in adds {
            self.bytes += add.blueprint.len();
            self.known.insert(add.id, (add.class, add.blueprint.into_boxed_str()));
        }
        if self.known.len() > ACTORS_MAX {
            return Err(QueryError::TooLarge { what: "actors", limit: ACTORS_MAX });
        }
        if self.bytes > NAMES_BYTES_MAX {
            return Err(QueryError::TooLarge { what: "bytes of names", limit: NAMES_BYTES_MAX });
        }
        Ok(())
    }

    pub(super) fn class(&self, id: u32) -> Option<Class> {
        self.known.get(&id).map(|(class, _)| *class)
    }

    /// Nothing for what is not known.
    pub(super) fn blueprint(&self, id: u32) -> &str {
        self.known.get(&id).map_or("", |(_, blueprint)| blueprint)
    }
}
