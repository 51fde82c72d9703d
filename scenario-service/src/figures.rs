//! What the service counts. Relaxed atomics: no step waits for any of it.

use monitoring::{Counter, Histogram, Metrics, Monitor};
use tenancy::Refusal;

/// What the service counts.
pub(crate) struct Figures {
    /// Time of a reset that was done.
    pub(crate) reset_seconds: Histogram,
    /// Time of a step that was done, but for pictures.
    pub(crate) step_seconds: Histogram,
    /// Time of a picture, with or without success.
    pub(crate) picture_seconds: Histogram,
    /// Sessions that began.
    pub(crate) opened: Counter,
    /// Sessions for which there was no room.
    pub(crate) full: Counter,
    /// Sessions beyond a tenant's quota.
    pub(crate) quota: Counter,
    /// Sessions that came while no new ones are taken.
    pub(crate) draining: Counter,
    /// Requests without a token.
    pub(crate) no_token: Counter,
    /// Requests with a token that is not valid.
    pub(crate) wrong_token: Counter,
    /// Requests with such a token, after too many of them.
    pub(crate) shut_out: Counter,
    /// Pictures that were beyond a tenant's quota.
    pub(crate) pixels_refused: Counter,
    /// Resets whose world would have had more actors than a tenant's quota.
    pub(crate) actors_refused: Counter,
    /// How long an episode waited while its world moved.
    pub(crate) move_seconds: Histogram,
    /// Worlds that were lost and made again.
    pub(crate) recovered: Counter,
    /// Episodes whose world was lost.
    pub(crate) lost: Counter,
}

impl Figures {
    /// New figures.
    pub(crate) fn new(metrics: &Metrics) -> Self {
        let asked = "Sessions that were asked for, by what came of it";
        let outcomes = ("outcome", ["opened", "capacity", "quota", "draining"]);
        let [opened, full, quota, draining] =
            metrics.counters("causeway_scenario_sessions_asked", asked, outcomes);
        let refused = "Requests that were let in by no token, by why";
        let reasons = ("why", ["no_token", "wrong_token", "too_many"]);
        let [no_token, wrong_token, shut_out] =
            metrics.counters("causeway_scenario_entries_refused", refused, reasons);
        Self {
            reset_seconds: metrics.histogram("causeway_scenario_reset_seconds", "Time of a reset"),
            step_seconds: metrics
                .histogram("causeway_scenario_step_seconds", "Time of a step without a picture"),
            picture_seconds: metrics
                .histogram("causeway_scenario_picture_seconds", "Time of a step for a picture"),
            opened,
            full,
            quota,
            draining,
            no_token,
            wrong_token,
            shut_out,
            pixels_refused: metrics.counter(
                "causeway_scenario_pictures_refused",
                "Pictures that were beyond a tenant's quota",
            ),
            actors_refused: metrics.counter(
                "causeway_scenario_actors_refused",
                "Resets with more actors than a tenant's quota",
            ),
            move_seconds: metrics.histogram(
                "causeway_scenario_move_seconds",
                "Time in which a world moved to another service",
            ),
            recovered: metrics.counter(
                "causeway_scenario_worlds_recovered",
                "Worlds that were lost and made again",
            ),
            lost: metrics
                .counter("causeway_scenario_episodes_lost", "Episodes whose world was lost"),
        }
    }
}

impl Figures {
    /// Somebody was not let in.
    pub(crate) fn note_refusal(&self, why: Refusal) {
        let counter = match why {
            Refusal::NoToken => &self.no_token,
            Refusal::WrongToken => &self.wrong_token,
            Refusal::TooMany => &self.shut_out,
        };
        counter.inc();
    }
}

impl Default for Figures {
    fn default() -> Self {
        Self::new(Monitor::default().metrics())
    }
}
