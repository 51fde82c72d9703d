//! Whose things are done together next, and for whom nothing is done for a moment.

use std::time::{Duration, Instant};

use schemas::Tenant;

use super::fair_queue::{FairQueue, Whose};
use super::prompt_askers::PromptAskers;

/// Jobs drawn together. What they cost bounds them before, but on GPUs.
const TOGETHER_MAX: usize = 128;
/// Once what is drawn together costs so much, nothing more joins it.
const TOGETHER_NANOS: u64 = 10_000_000;
/// A job that costs more is drawn in slices that cost about so much; others come in between.
pub(crate) const SLICE_NANOS: u64 = 30_000_000;
/// Before a turn that costs more, whoever is owed time and asks again at once is waited for.
const HELD_NANOS: u64 = 5_000_000;
/// What a tenant or session that asks for nothing is owed later, at most.
pub(crate) const SAVED_NANOS_MAX: u64 = 2 * SLICE_NANOS;

/// Begins things whose turn it is.
pub(crate) trait Begin<T> {
    /// A turn of one.
    type Turn;

    /// Whether it can be begun now.
    fn can_begin(&self, tenant: &Tenant, thing: &T) -> bool;

    /// What its turn costs until others have theirs, in nanoseconds.
    fn cost_of_turn(&self, thing: &T) -> u64;

    /// Begins it; gives its turn and what that costs, in nanoseconds. `None`: there is none.
    fn begin(&mut self, whose: &Whose, thing: T) -> Option<(Self::Turn, u64)>;
}

/// What is done next.
#[derive(Debug)]
pub(crate) struct Round<U> {
    /// Turns that are taken together; they are charged.
    pub(crate) turns: Vec<U>,
    /// Why there are no more.
    pub(crate) awaited: Option<Awaited>,
}

/// Those who would come next and should ask in a moment.
#[derive(Debug)]
pub(crate) struct Awaited {
    whose: Vec<Whose>,
    since: Instant,
    /// Until when they are waited for.
    pub(crate) until: Instant,
}

/// Takes what is done next, in the order of a queue.
pub(crate) fn next_round<T, B: Begin<T>>(
    waiting: &mut FairQueue<T>,
    askers: &PromptAskers,
    begin: &mut B,
    now: Instant,
) -> Round<B::Turn> {
    let (mut turns, mut sum) = (Vec::new(), 0);
    while turns.len() < TOGETHER_MAX {
        let Some(next) = waiting.next(|tenant, thing| begin.can_begin(tenant, thing)) else {
            break;
        };
        let costs = waiting.front(&next).map_or(0, |thing| begin.cost_of_turn(thing));
        if !turns.is_empty() && sum + costs > TOGETHER_NANOS {
            break;
        }
        if costs > HELD_NANOS {
            let expected = askers.expected(now, |whose| waiting.is_owed(whose, &next));
            if let Some(until) = expected.iter().map(|(_, until)| *until).max() {
                let whose = expected.into_iter().map(|(whose, _)| whose).collect();
                return Round { turns, awaited: Some(Awaited { whose, since: now, until }) };
            }
        }
        let Some((whose, thing)) = waiting.take(next) else { break };
        let Some((turn, estimate)) = begin.begin(&whose, thing) else { continue };
        sum += estimate;
        // What it is in truth is known afterwards.
        waiting.charge(&whose, i64::try_from(estimate).unwrap_or(i64::MAX));
        turns.push(turn);
    }
    Round { turns, awaited: None }
}

impl Awaited {
    /// Has those pay who were waited for while nothing was done: the time was theirs.
    pub(crate) fn settle<T>(self, waiting: &mut FairQueue<T>, now: Instant) {
        let time: Duration = now.saturating_duration_since(self.since);
        let each = time.as_nanos() / self.whose.len().max(1) as u128;
        let each = i64::try_from(each).unwrap_or(i64::MAX);
        for whose in &self.whose {
            waiting.charge(whose, each);
        }
    }
}

#[cfg(test)]
mod tests;
