//! Ticks of a world whose clock CARLA's clients may share: one at a time, each when all have asked.

use std::collections::BTreeSet;

use schemas::{ServiceId, TickItem};

use super::world::{Told, Trouble};
use crate::ticker::Ticker;

/// Carries out an item of one tick or more, the commands before the first one. Notes who else
/// shared the clock in any of them, also where a later one fails.
///
/// # Errors
/// [`Trouble`]; some of the ticks may have been done.
pub(super) async fn tick_together(
    ticker: &Ticker,
    item: TickItem,
    participant: &ServiceId,
    guests: &mut BTreeSet<ServiceId>,
) -> Result<Told, Trouble> {
    let (world, ticks) = (item.world, item.tick_count);
    let single = |item: TickItem| async move {
        let participant = Some(participant.clone());
        let mut outcome = ticker.tick(TickItem { participant, ..item }).await?;
        let guests = std::mem::take(&mut outcome.guests);
        Ok::<_, Trouble>((Told::of(outcome)?, guests))
    };
    let (mut told, first) = single(TickItem { tick_count: 1, ..item }).await?;
    guests.extend(first);
    if ticks > 1 {
        told.collisions.extend(told.frame.collisions.iter().cloned());
    }
    for _ in 1..ticks {
        let expected_tick = Some(told.frame.tick);
        let (next, more) = single(TickItem { expected_tick, ..TickItem::new(world, 1) }).await?;
        guests.extend(more);
        told.collisions.extend(next.frame.collisions.iter().cloned());
        told.frame = next.frame;
    }
    Ok(told)
}
