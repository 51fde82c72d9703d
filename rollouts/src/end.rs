//! Why an episode ends.

use serde::{Deserialize, Serialize};

/// What ends an episode before its time is up. A spec names those that count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The box centre is within 2 m of the goal.
    Arrived,
    /// It ran into something.
    Collision,
    /// Its centre is farther from the middle of its way than half the lane.
    OffRoute,
    /// It lies on its side or roof.
    Overturned,
    /// Its middle passed the line of a light that showed red before and after the step.
    RedLight,
}

impl End {
    /// Every one.
    pub const ALL: [Self; 5] =
        [Self::Arrived, Self::Collision, Self::OffRoute, Self::Overturned, Self::RedLight];
}

/// Why an episode ended; its number stands in the column `cause`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    By(End),
    /// Its time was up.
    Time,
    /// Its world could not go on.
    Fault,
}

impl Cause {
    /// 1 to 4 for the first ends in their order, 5 for the time, 6 for a fault, 7 for a red light.
    pub(crate) fn number(self) -> u8 {
        match self {
            Self::By(End::Arrived) => 1,
            Self::By(End::Collision) => 2,
            Self::By(End::OffRoute) => 3,
            Self::By(End::Overturned) => 4,
            Self::Time => 5,
            Self::Fault => 6,
            Self::By(End::RedLight) => 7,
        }
    }

    pub(crate) fn truncates(self) -> bool {
        matches!(self, Self::Time | Self::Fault)
    }
}
