//! Ticks of a world whose clock CARLA's clients may share: one at a time, each when all have asked.

use std::collections::BTreeSet;

use schemas::{ServiceId, TickItem};

use super::world::{Told, Trouble};
use crate::ticker::Ticker;

/// What a session hears of others in its world.
#[derive(Debug, Default)]
pub(super) struct Others {
    /// Who shares the clock.
    pub(super) guests: BTreeSet<ServiceId>,
    /// Whether any of them, or who has gone, had something done.
    pub(super) have_acted: bool,
}

/// Carries out an item, the commands before its first tick. Notes the others of all ticks, also
/// where a later one fails.
///
/// # Errors
/// [`Trouble`]; some of the ticks may have been done.
pub(super) async fn tick_together(
    ticker: &Ticker,
    item: TickItem,
    participant: &ServiceId,
    others: &mut Others,
) -> Result<Told, Trouble> {
    let (world, ticks) = (item.world, item.tick_count);
    let mut single = async |item: TickItem| {
        let participant = Some(participant.clone());
        let mut outcome = ticker.tick(TickItem { participant, ..item }).await?;
        others.guests.extend(std::mem::take(&mut outcome.guests));
        others.have_acted |= outcome.is_changed_by_others;
        Ok::<_, Trouble>(Told::of(outcome)?)
    };
    let mut told = single(TickItem { tick_count: ticks.min(1), ..item }).await?;
    if ticks > 1 {
        told.collisions.extend(told.frame.collisions.iter().cloned());
    }
    for _ in 1..ticks {
        let expected_tick = Some(told.frame.tick);
        let next = single(TickItem { expected_tick, ..TickItem::new(world, 1) }).await?;
        told.collisions.extend(next.frame.collisions.iter().cloned());
        told.frame = next.frame;
    }
    Ok(told)
}
