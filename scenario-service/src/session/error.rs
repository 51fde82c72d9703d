//! Why a session refuses.

use schemas::{Error, ErrorCode};

use crate::scenario::ScenarioError;

/// Why a session refused. The episode that was running still is, except in [`WorldLost`].
///
/// [`WorldLost`]: SessionError::WorldLost
#[derive(Debug, thiserror::Error)]
pub(crate) enum SessionError {
    /// No such scenario, or not so, or not there.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The world refuses what the action asks for.
    #[error("{0}")]
    Refused(Error),
    /// The world service refused or is not there.
    #[error("{0}")]
    World(Error),
    /// The episode cannot go on.
    #[error("the world of this episode is gone ({0}); reset to start a new episode")]
    WorldLost(String),
}

impl SessionError {
    /// Whether the caller can do better.
    pub(crate) fn is_callers_fault(&self) -> bool {
        match self {
            Self::Scenario(_) | Self::Refused(_) => true,
            Self::World(error) => {
                matches!(error.code, ErrorCode::UnknownMap | ErrorCode::UnknownBlueprint)
            }
            Self::WorldLost(_) => false,
        }
    }
}
