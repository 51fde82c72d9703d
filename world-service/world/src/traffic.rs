//! Traffic lights of a world: what they show and when they change.

use serde::{Deserialize, Serialize};

/// The state of all traffic lights; no light has any yet.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Traffic {}
