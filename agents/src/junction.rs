//! How drivers come through junctions: whoever looks around asks, and drives on what was granted.

mod claims;
mod entry;
mod grants;

use schemas::ActorId;
use serde::{Deserialize, Serialize};

use crate::path::Path;
use crate::senses::Senses;
use claims::Asker;
pub use claims::{Claims, Entering};
pub use entry::Held;
use entry::STANDING_MPS;
pub(crate) use entry::{AT_LINE_M, Approach, BEFORE_LINE_M, INSIDE_M};
use grants::{Grants, Way};

/// What a driver was granted of the junctions ahead and below, and what it waits for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Passage {
    grants: Grants,
    /// Whether nothing but others' claims kept it from the next junction in the last tick, or
    /// would have done so a moment later; it was told to all then.
    comes: bool,
    held: Held,
    /// Without room beyond the next junction.
    blocked_secs: f32,
}

impl Passage {
    /// Whether it could have come to be; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self) -> bool {
        self.grants.is_consistent() && self.blocked_secs.is_finite()
    }

    /// Whether no junction is claimed.
    pub(crate) fn is_free(&self) -> bool {
        self.grants.is_empty()
    }

    /// What it waited for in the last tick.
    pub(crate) fn held(&self) -> Held {
        self.held
    }

    /// It waits for somebody on the lane beside that it changes to.
    pub(crate) fn wait_beside(&mut self, other: ActorId) {
        self.held = Held::Beside(other);
    }

    /// Says what is claimed and wished for, after the path was followed by `driven_m`.
    pub(crate) fn look(
        &mut self,
        senses: &Senses<'_>,
        path: &Path,
        (driven_m, gap_m): (f32, f32),
        claims: &mut Claims,
    ) {
        let (network, view) = (senses.network, senses.view);
        self.grants.drive_on(path, driven_m, senses.body.half_m.x);
        self.grants.hold_present(network, path);
        self.grants.tell(network, path, senses.body, claims);
        let way = Way::next(network, path, &self.grants, room_m(senses, gap_m));
        let urgent = senses.body.is_urgent;
        let wishes =
            |way: &Way| self.comes && (urgent || !waits_at_light(senses, path, way.entry_m));
        if let Some(way) = way.filter(wishes) {
            claims.wish(network, &way, &self.asker(senses, path, &way));
        }
        if let Some((way, _)) = self.grants.part(path) {
            claims.wish(network, &way, &Asker { eta_secs: 0.0, ..self.asker(senses, path, &way) });
        }
        if view.velocity_mps.norm() < STANDING_MPS {
            claims.wait(senses.body.id, self.held);
        }
        let asks = matches!(self.held, Held::Claim(_));
        self.grants.wait(senses.dt_secs, view.velocity_mps.norm(), asks);
    }

    /// Where a path is to be cut whose way through the next junction has had no room beyond it for
    /// long.
    pub(crate) fn turn_away(
        &mut self,
        senses: &Senses<'_>,
        path: &Path,
        gap_m: f32,
    ) -> Option<f32> {
        /// Whoever has no room beyond a junction for so long looks for another way.
        const BLOCKED_SECS: f32 = 6.0;
        if self.blocked_secs < BLOCKED_SECS {
            return None;
        }
        self.blocked_secs = 0.0;
        let way = Way::next(senses.network, path, &self.grants, room_m(senses, gap_m))?;
        Some(way.entry_m)
    }
}

/// Between junctions nearer to each other than this a vehicle cannot stop clear of both.
fn room_m(senses: &Senses<'_>, gap_m: f32) -> f32 {
    2.0 * senses.body.half_m.x + gap_m
}

/// Whether a light before a junction does not show green.
fn waits_at_light(senses: &Senses<'_>, path: &Path, entry_m: f32) -> bool {
    use crate::network::Stop;
    use schemas::TrafficLightColour::{Red, Yellow};
    let mut lines = path.lines(senses.network, 0.0, entry_m + INSIDE_M);
    lines.any(|line| match line.why {
        Stop::Light(light) => matches!(senses.scene.light(light), Red | Yellow),
        _ => false,
    })
}
