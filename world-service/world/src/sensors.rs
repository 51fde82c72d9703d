//! What the sensors of a world remember from tick to tick.

use serde::{Deserialize, Serialize};

/// The state of all sensors; none measures yet.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Sensors {}
