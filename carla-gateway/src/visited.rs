//! What a task that follows the world of a session tells.

use schemas::{Error, TickOutcome, WorldId};

/// What came of a tick of a world that clients visit.
#[derive(Debug)]
pub(crate) struct VisitedTick {
    pub(crate) world: WorldId,
    pub(crate) outcome: Result<TickOutcome, Error>,
}
