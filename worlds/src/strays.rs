//! Which worlds of a face nobody uses.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use schemas::WorldId;
use tokio::sync::watch;

use crate::patience::Patience;

/// How often worlds are searched for those that nobody uses.
const SWEEP_EVERY: Duration = Duration::from_secs(10);
/// Worlds that are remembered as let go; of more the earliest are found by their age.
const LEFT_MAX: usize = 256;

/// Tells worlds that nobody uses from those that are used, or about to be: the answer that told of
/// one, or the question that was to free it, was lost.
#[derive(Debug)]
pub struct Strays {
    patience: Patience,
    used: BTreeSet<WorldId>,
    /// Were used, and may be there still.
    left: VecDeque<WorldId>,
    /// When those were first listed that nobody was known to use.
    suspects: BTreeMap<WorldId, Instant>,
}

impl Strays {
    /// No worlds yet, of who waits so long for answers.
    pub fn new(patience: Patience) -> Self {
        Self { patience, used: BTreeSet::new(), left: VecDeque::new(), suspects: BTreeMap::new() }
    }

    /// Somebody uses a world from now on.
    pub fn note_used(&mut self, world: WorldId) {
        self.used.insert(world);
        self.suspects.remove(&world);
    }

    /// Nobody uses a world any more, and nobody will.
    pub fn note_left(&mut self, world: WorldId) {
        if !self.used.remove(&world) {
            return;
        }
        self.left.push_back(world);
        if self.left.len() > LEFT_MAX {
            self.left.pop_front();
        }
    }

    /// Those of the listed worlds that may be freed: who was let go, and who has been listed for
    /// longer than the answer that tells of a new world can take.
    pub fn abandoned(&mut self, listed: &[WorldId], now: Instant) -> Vec<WorldId> {
        let unused: Vec<WorldId> =
            listed.iter().copied().filter(|world| !self.used.contains(world)).collect();
        let first_seen = |world: &WorldId| self.suspects.get(world).copied().unwrap_or(now);
        self.suspects = unused.iter().map(|world| (*world, first_seen(world))).collect();
        let is_old = |world: &WorldId| {
            let since = self.suspects.get(world).copied().unwrap_or(now);
            now.saturating_duration_since(since) > self.patience.ask
        };
        unused.into_iter().filter(|world| self.left.contains(world) || is_old(world)).collect()
    }
}

/// Returns when strays should be looked for again: a world service has come, which may have some,
/// or gone, or a while has passed.
pub async fn until_sweep(changes: &mut watch::Receiver<u64>) {
    tokio::select! {
        () = tokio::time::sleep(SWEEP_EVERY) => {}
        Ok(()) = changes.changed() => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASK: Duration = Duration::from_secs(10);

    fn strays() -> Strays {
        Strays::new(Patience { ask: ASK, ticks: ASK, per_tick: Duration::ZERO, ticks_max: ASK })
    }

    fn world(count: u64) -> WorldId {
        WorldId::of_host(1, count)
    }

    #[test]
    fn a_world_that_is_used_or_may_be_soon_is_not_abandoned() {
        let (mut strays, now) = (strays(), Instant::now());
        strays.note_used(world(1));
        let listed = [world(1), world(2)];
        assert_eq!(strays.abandoned(&listed, now), []);
        assert_eq!(strays.abandoned(&listed, now + ASK), [], "its answer may be on its way");
        strays.note_used(world(2));
        assert_eq!(strays.abandoned(&listed, now + 2 * ASK), []);
    }

    #[test]
    fn a_world_of_which_no_answer_told_is_abandoned_when_none_can_come_any_more() {
        let (mut strays, now) = (strays(), Instant::now());
        let late = now + ASK + Duration::from_millis(1);
        assert_eq!(strays.abandoned(&[world(1)], now), []);
        assert_eq!(strays.abandoned(&[world(1)], late), [world(1)]);
        // One that was away meanwhile is another's, or new.
        assert_eq!(strays.abandoned(&[], late), []);
        assert_eq!(strays.abandoned(&[world(1)], late), []);
    }

    #[test]
    fn a_world_that_was_let_go_is_abandoned_whenever_it_is_listed() {
        let (mut strays, now) = (strays(), Instant::now());
        strays.note_used(world(1));
        strays.note_left(world(1));
        assert_eq!(strays.abandoned(&[world(1)], now), [world(1)]);
        assert_eq!(strays.abandoned(&[world(1)], now), [world(1)], "nobody may have heard that");
    }

    #[test]
    fn not_everything_is_remembered() {
        let (mut strays, now) = (strays(), Instant::now());
        for count in 1..=2 * LEFT_MAX as u64 {
            strays.note_used(world(count));
            strays.note_left(world(count));
        }
        assert_eq!(strays.left.len(), LEFT_MAX);
        assert_eq!(strays.abandoned(&[world(1)], now), []);
        assert_eq!(strays.abandoned(&[world(1)], now + 2 * ASK), [world(1)]);
    }
}
