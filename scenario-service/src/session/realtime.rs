//! Time that goes on while no step is asked for, where a reset asked for `realtime`.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::SessionContext;
use super::home::Home;
use super::world::{Trouble, Work};
use crate::episode::Episode;
use crate::limits::{IDLE_MAX, TICKS_PER_STEP_MAX};
use crate::world_port::DT_SECS;

/// How far the time of an episode is behind that of the wall.
pub(super) struct WallClock {
    /// When a reset or step was answered last.
    answered: Instant,
    /// What has passed and makes no whole tick yet.
    rest: Duration,
}

impl WallClock {
    pub(super) fn start(now: Instant) -> Self {
        Self { answered: now, rest: Duration::ZERO }
    }

    /// From now on time goes on without a step.
    pub(super) fn answer(&mut self, now: Instant) {
        self.answered = now;
    }

    /// Ticks that have passed before a step of `own` ticks, which count among them: a driver who
    /// steps at least once a tick is not hurried.
    pub(super) fn ticks_before(&mut self, own: u32, now: Instant) -> u32 {
        let tick = Duration::from_secs_f64(DT_SECS);
        let idle = now.saturating_duration_since(self.answered).min(IDLE_MAX);
        self.answered = now;
        let passed = self.rest + idle;
        let whole = (passed.as_nanos() / tick.as_nanos()) as u32;
        self.rest = passed.saturating_sub(tick * whole.max(own));
        whole.saturating_sub(own)
    }
}

/// Lets ticks pass in which everybody, the ego too, goes on as before; gives what the driver should
/// know of them, in sentences.
///
/// # Errors
/// [`Trouble`]; ticks may have passed.
pub(super) async fn pass(
    ticks: u32,
    episode: &mut Episode,
    home: &mut Home,
    context: &Arc<SessionContext>,
) -> Result<Vec<String>, Trouble> {
    let mut events = Vec::new();
    if ticks > 0 {
        let secs = f64::from(ticks) * DT_SECS;
        events.push(format!("{secs:.2} s passed before this action"));
    }
    let mut left = ticks;
    while left > 0 {
        let tick_count = left.min(TICKS_PER_STEP_MAX);
        let work = Work { commands: episode.opening().to_vec(), tick_count, is_checked: false };
        let told = home.advance(context, episode.frame(), work).await?;
        events.extend(told.events);
        episode.pass(told.frame, tick_count, &told.collisions, &mut events);
        left -= tick_count;
    }
    Ok(events)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_ticks_pass_and_the_rest_is_kept() {
        let start = Instant::now();
        let after = |millis| start + Duration::from_millis(millis);
        let mut clock = WallClock::start(start);
        assert_eq!(clock.ticks_before(1, after(2_030)), 39);
        clock.answer(after(2_100));
        assert_eq!(clock.ticks_before(1, after(2_120)), 0);
        clock.answer(after(2_120));
        // What a step took ahead of the wall is not made good.
        assert_eq!(clock.ticks_before(1, after(2_219)), 0);
        assert_eq!(clock.ticks_before(0, after(2_270)), 2);
    }

    #[test]
    fn who_goes_away_finds_the_world_half_a_minute_later() {
        let start = Instant::now();
        let mut clock = WallClock::start(start);
        assert_eq!(clock.ticks_before(10, start + Duration::from_secs(3_600)), 590);
        assert_eq!(clock.ticks_before(1, start), 0);
    }
}
