//! How long answers may take.

use std::time::Duration;

use schemas::TickItem;

/// How long answers may take.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Of anything but ticks.
    pub ask: Duration,
    /// Of a request of ticks, whatever is asked.
    pub ticks: Duration,
    /// What every tick of it adds: a world may be large, and its machine busy.
    pub per_tick: Duration,
    /// Of the largest request of ticks.
    pub ticks_max: Duration,
}

impl Patience {
    /// How long these ticks may take: it grows with what is asked.
    pub(crate) fn of(&self, items: &[TickItem]) -> Duration {
        let ticks = items.iter().fold(0, |sum: u32, item| sum.saturating_add(item.tick_count));
        (self.ticks + self.per_tick.saturating_mul(ticks)).min(self.ticks_max)
    }
}

#[cfg(test)]
mod tests {
    use schemas::WorldId;

    use super::*;

    #[test]
    fn a_step_of_many_ticks_has_more_time_than_one_of_few() {
        let patience = Patience {
            ask: Duration::from_secs(10),
            ticks: Duration::from_secs(10),
            per_tick: Duration::from_millis(250),
            ticks_max: Duration::from_secs(55),
        };
        let deadline = |ticks| patience.of(&[TickItem::new(WorldId::of_host(1, 1), ticks)]);
        assert!(deadline(1) >= patience.ticks && deadline(1) < 2 * patience.ticks);
        assert_eq!(deadline(100), Duration::from_secs(35));
        assert_eq!(deadline(200), Duration::from_secs(55));
        assert_eq!(deadline(u32::MAX), patience.ticks_max);
    }
}
