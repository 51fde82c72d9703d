//! Time that goes on while no step is asked for, where a reset asked for `realtime`.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::home::Home;
use super::world::{Trouble, Work};
use super::{Running, Session, SessionContext};
use crate::episode::Episode;
use crate::limits::{IDLE_MAX, PACED_TICKS_MAX, TICKS_PER_STEP_MAX};
use crate::world_port::DT_SECS;

/// How far the time of an episode is behind that of the wall.
pub(super) struct WallClock {
    /// When a reset or step was answered last.
    answered: Instant,
    /// What has passed and makes no whole tick yet.
    rest: Duration,
    /// Ticks since the last step, and what the driver should know of them, in sentences.
    passed: (u32, Vec<String>),
}

impl WallClock {
    pub(super) fn start(now: Instant) -> Self {
        Self { answered: now, rest: Duration::ZERO, passed: (0, Vec::new()) }
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

    /// Ticks that have passed while no step is asked for; what guests cannot be shown in time is
    /// left out.
    fn ticks_meanwhile(&mut self, now: Instant) -> u32 {
        let most = (IDLE_MAX.as_secs_f64() / DT_SECS) as u32;
        let left = most.saturating_sub(self.passed.0);
        self.ticks_before(0, now).min(PACED_TICKS_MAX).min(left)
    }

    /// What the driver should know of the time since the last step, told once.
    pub(super) fn take_events(&mut self) -> Vec<String> {
        let (ticks, mut events) = std::mem::take(&mut self.passed);
        if ticks > 0 {
            let secs = f64::from(ticks) * DT_SECS;
            events.insert(0, format!("{secs:.2} s passed before this action"));
        }
        events
    }

    /// Lets ticks pass in which everybody, the ego too, goes on as before.
    ///
    /// # Errors
    /// [`Trouble`]; ticks may have passed.
    pub(super) async fn pass(
        &mut self,
        ticks: u32,
        episode: &mut Episode,
        home: &mut Home,
        context: &Arc<SessionContext>,
    ) -> Result<(), Trouble> {
        let (passed, events) = &mut self.passed;
        *passed += ticks;
        let mut left = ticks;
        while left > 0 {
            let tick_count = left.min(TICKS_PER_STEP_MAX);
            let work = Work { commands: episode.opening().to_vec(), tick_count, is_checked: false };
            let told = home.advance(context, episode.frame(), work).await?;
            events.extend(told.events);
            episode.pass(told.frame, tick_count, &told.collisions, events);
            left -= tick_count;
        }
        Ok(())
    }
}

impl Session {
    /// Whether time has to go on in it while no step is asked for, as guests look on.
    pub(crate) fn is_paced(&self) -> bool {
        match &self.running {
            Running::Episode(episode, home) => episode.is_realtime() && home.is_open(),
            Running::Nothing | Running::Lost(_) => false,
        }
    }

    /// Lets the time pass that has passed outside.
    pub(crate) async fn keep_pace(&mut self, now: Instant) {
        let Ok((episode, home)) = self.running.episode() else { return };
        let ticks = self.clock.ticks_meanwhile(now);
        if let Err(trouble) = self.clock.pass(ticks, episode, home, &self.context).await {
            // Who steps next hears of it.
            let error = self.troubled(trouble);
            tracing::debug!(%error, "time does not go on");
        }
    }
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
    fn guests_see_time_go_on_for_half_a_minute_and_never_in_leaps() {
        let start = Instant::now();
        let mut clock = WallClock::start(start);
        assert_eq!(clock.ticks_meanwhile(start + Duration::from_millis(110)), 2);
        assert_eq!(clock.ticks_meanwhile(start + Duration::from_millis(150)), 1);
        assert_eq!(clock.ticks_meanwhile(start + Duration::from_secs(9)), PACED_TICKS_MAX);
        assert_eq!(clock.ticks_meanwhile(start + Duration::from_millis(9_060)), 1);
        clock.passed.0 = 599;
        assert_eq!(clock.ticks_meanwhile(start + Duration::from_secs(10)), 1);
        clock.passed.0 = 600;
        assert_eq!(clock.ticks_meanwhile(start + Duration::from_secs(11)), 0);
    }

    #[test]
    fn who_goes_away_finds_the_world_half_a_minute_later() {
        let start = Instant::now();
        let mut clock = WallClock::start(start);
        assert_eq!(clock.ticks_before(10, start + Duration::from_secs(3_600)), 590);
        assert_eq!(clock.ticks_before(1, start), 0);
    }
}
