//! When the world ticks by itself, between the calls.

use std::time::Duration;

use tokio::time::Instant;

use crate::dialect::EpisodeSettings;

/// How long calls have their turn after a tick, where ticks take longer than their period. Shorter
/// periods give a quarter of themselves.
const TURN_MAX: Duration = Duration::from_millis(10);
/// Calls that wait at the end of a tick and come before the next one.
const CALLS_PER_TURN: usize = 64;
/// Pause after a tick that failed, before the next one of its own accord.
const PAUSE_AFTER_FAILURE: Duration = Duration::from_millis(500);
/// How long the world stands still after a load: a client that still follows the old episode would
/// not survive a snapshot of the new one while it changes over.
pub(super) const QUIET_AFTER_LOAD: Duration = Duration::from_millis(250);
/// Lost time is summed up over at least so long, and told when it is more than a tenth of that.
const LOSS_SPAN: Duration = Duration::from_secs(1);
/// Between two times that it is told.
const LOSS_PAUSE: Duration = Duration::from_secs(30);

/// How the world keeps time. A tick that comes late makes the next one late, too: time that is lost
/// is not caught up.
#[derive(Debug)]
pub(super) struct Pace {
    /// Between two ticks in asynchronous mode.
    period: Duration,
    /// Leaves synchronous mode when nobody ticked for so long.
    sync_lease: Option<Duration>,
    /// When the last tick began, or a time to count from as if it had.
    last_tick: Instant,
    /// Calls have their turn until then.
    turn_ends: Instant,
    /// Calls that come before the next tick.
    owed: usize,
    /// Since when, and how much.
    lost: (Instant, Duration),
    told: Option<Instant>,
}

/// Time in which the world stood still although it was to advance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Loss {
    pub(crate) lost: Duration,
    /// Of so much time.
    pub(crate) of: Duration,
}

impl Pace {
    pub(super) fn new(period: Duration, sync_lease: Option<Duration>, now: Instant) -> Self {
        let lost = (now, Duration::ZERO);
        Self { period, sync_lease, last_tick: now, turn_ends: now, owed: 0, lost, told: None }
    }

    /// When the next tick is due with these settings.
    pub(super) fn due(&self, settings: &EpisodeSettings) -> Option<Instant> {
        if settings.synchronous_mode {
            return self.sync_lease.map(|lease| self.last_tick + lease);
        }
        Some((self.last_tick + self.period(settings)).max(self.turn_ends))
    }

    /// Whether calls that wait come first.
    pub(super) fn owes_a_call(&self) -> bool {
        self.owed > 0
    }

    /// A call that waited has its turn.
    pub(super) fn note_call(&mut self) {
        self.owed = self.owed.saturating_sub(1);
    }

    /// A tick of its own accord begins; gives the time that was lost, if that is to be told.
    pub(super) fn note_begin(&mut self, settings: &EpisodeSettings, now: Instant) -> Option<Loss> {
        let (since, lost) = self.lost;
        let due = (self.last_tick + self.period(settings)).max(since);
        let lost = lost + now.saturating_duration_since(due);
        self.lost.1 = lost;
        let loss = Loss { lost, of: now.saturating_duration_since(since) };
        if loss.of < LOSS_SPAN {
            return None;
        }
        self.forget_loss(now);
        let was_told = self.told.is_some_and(|told| now < told + LOSS_PAUSE);
        let is_told = loss.lost > loss.of / 10 && !was_told;
        self.told = if is_told { Some(now) } else { self.told };
        is_told.then_some(loss)
    }

    /// Time is no longer counted as it was: other settings, or nobody was here.
    pub(super) fn forget_loss(&mut self, now: Instant) {
        self.lost = (now, Duration::ZERO);
    }

    /// A tick of its own accord is over, and so many calls wait.
    pub(super) fn note_end(&mut self, waiting: usize, succeeded: bool, now: Instant) {
        self.owed = waiting.min(CALLS_PER_TURN);
        self.turn_ends = now + (self.period / 4).min(TURN_MAX);
        if !succeeded {
            self.last_tick = now + PAUSE_AFTER_FAILURE;
        }
    }

    /// The world has ticked, or is to stand still from then on for one period.
    pub(super) fn count_from(&mut self, at: Instant) {
        self.last_tick = self.last_tick.max(at);
    }

    fn period(&self, settings: &EpisodeSettings) -> Duration {
        let fixed = settings.fixed_delta_seconds.0.map(Duration::from_secs_f64);
        self.period.max(fixed.unwrap_or_default())
    }

    /// When the last tick began.
    pub(super) fn last_tick(&self) -> Instant {
        self.last_tick
    }

    /// Half of the time between two frames.
    pub(super) fn half_period(&self) -> Duration {
        self.period / 2
    }
}
