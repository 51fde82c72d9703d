//! Who else is in a shared world.

use serde::Serialize;

/// Who is in the world with an ego.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Company {
    /// What others join by.
    pub(crate) world_id: String,
    /// Its own name.
    pub(crate) ego: String,
    /// All names.
    pub(crate) egos: Vec<String>,
    /// All but itself.
    pub(crate) others: Vec<Other>,
    /// How long the others were waited for.
    #[serde(skip)]
    pub(crate) waited_ms: Option<u64>,
}

/// One of the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Other {
    /// Its name.
    pub(crate) ego: String,
    /// Whether a session steps it.
    pub(crate) live: bool,
}
