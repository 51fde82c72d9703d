//! Which aids of its driver a vehicle has.

use crate::Result;
use crate::track::Rig;

/// Which aids a vehicle drives with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Aids {
    /// Anti-lock brakes.
    pub anti_lock: bool,
    /// Stability control.
    pub stability: bool,
}

impl Aids {
    /// Both.
    pub const BOTH: Self = Self { anti_lock: true, stability: true };
    /// Anti-lock brakes alone.
    pub const ANTI_LOCK: Self = Self { anti_lock: true, stability: false };
    /// Neither.
    pub const NONE: Self = Self { anti_lock: false, stability: false };

    /// As tables name them.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match (self.anti_lock, self.stability) {
            (true, true) => "anti-lock and stability control",
            (true, false) => "anti-lock",
            (false, true) => "stability control",
            (false, false) => "neither",
        }
    }

    pub(crate) fn fit(self, rig: &mut Rig) -> Result<()> {
        rig.change(|physics| {
            (physics.anti_lock, physics.stability_control) = (self.anti_lock, self.stability);
        })
    }
}
