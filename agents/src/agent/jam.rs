//! Who has long stood in a circle of vehicles that wait for each other closes up, so that room
//! opens elsewhere: on a ring that is full with the distances that they keep, nobody could move.

use super::traits::Traits;
use super::{Agent, STANDING_MPS};
use crate::junction::Claims;
use crate::scene::Ahead;
use crate::senses::Senses;

/// Who has stood there for so long closes up, how close, and until nobody is nearer ahead.
const JAMMED_SECS: f32 = 10.0;
const CLOSE_M: f32 = 2.0;
const FREE_M: f32 = 10.0;

impl Agent {
    /// What distinguishes it on a road with this grip; in a jam with less distance to others.
    pub(super) fn traits(&self, grip: f32) -> Traits {
        let mut traits = Traits::of(&self.options, grip);
        if self.jammed_secs > JAMMED_SECS {
            traits.emergency_m = traits.emergency_m.min(CLOSE_M);
        }
        traits
    }

    /// Counts how long it stands in such a circle; until nobody is near ahead any more.
    pub(super) fn note_jam(
        &mut self,
        senses: &Senses<'_>,
        claims: &Claims,
        (speed_mps, ahead): (f32, Option<Ahead>),
    ) {
        if ahead.is_none_or(|ahead| ahead.is_walker || ahead.gap_m > FREE_M) {
            self.jammed_secs = 0.0;
        } else if speed_mps < STANDING_MPS && claims.is_in_circle(senses.body.id) {
            self.jammed_secs += senses.dt_secs;
        }
    }
}
