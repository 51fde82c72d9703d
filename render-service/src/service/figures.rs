//! What the service counts. Relaxed atomics: no picture waits for any of it.

use std::sync::Arc;

use monitoring::{Counter, Histogram, Metrics, Monitor, Pulse, SecondsByName};

/// What the drawing thread counts.
#[derive(Clone)]
pub(crate) struct Figures {
    /// Time of jobs that were drawn together.
    pub(crate) batch_seconds: Histogram,
    /// The same time by tenant: each pays for its part.
    pub(crate) tenant_seconds: SecondsByName,
    /// Jobs that were drawn.
    pub(crate) drawn: Counter,
    /// Jobs that were not.
    pub(crate) refused: Counter,
    /// Jobs whose asker had given up.
    pub(crate) given_up: Counter,
    /// Pictures that were drawn.
    pub(crate) pictures: Counter,
    /// Of them.
    pub(crate) pixels: Counter,
    /// Turns of the drawing thread.
    pub(crate) turns: Arc<Pulse>,
}

impl Figures {
    /// New figures.
    pub(crate) fn new(monitor: &Monitor) -> Self {
        let metrics: &Metrics = monitor.metrics();
        let label = ("outcome", ["drawn", "refused", "given_up"]);
        let [drawn, refused, given_up] =
            metrics.counters("causeway_render_jobs", "Jobs by what came of them", label);
        Self {
            batch_seconds: metrics
                .histogram("causeway_render_batch_seconds", "Time of jobs that are drawn together"),
            tenant_seconds: metrics.seconds_by_name(
                "causeway_render_tenant_seconds",
                "Time of drawing, by tenant",
                "tenant",
            ),
            drawn,
            refused,
            given_up,
            pictures: metrics.counter("causeway_render_pictures", "Pictures that were drawn"),
            pixels: metrics.counter("causeway_render_pixels", "Pixels that were drawn"),
            turns: monitor.pulse("draw"),
        }
    }
}
