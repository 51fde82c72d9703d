//! Ticks of a world whose clock CARLA's clients may share: one at a time, each when all have asked.

use schemas::{ServiceId, TickItem};

use super::world::{Told, Trouble};
use crate::ticker::Ticker;

/// Carries out an item of one tick or more, the commands before the first one.
///
/// # Errors
/// [`Trouble`]; some of the ticks may have been done.
pub(super) async fn tick_together(
    ticker: &Ticker,
    item: TickItem,
    participant: &ServiceId,
) -> Result<Told, Trouble> {
    let (world, ticks) = (item.world, item.tick_count);
    let single = |item: TickItem| async move {
        let participant = Some(participant.clone());
        Ok::<_, Trouble>(Told::of(ticker.tick(TickItem { participant, ..item }).await?)?)
    };
    let mut told = single(TickItem { tick_count: 1, ..item }).await?;
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
