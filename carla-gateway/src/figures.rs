//! What the gateway counts. Relaxed atomics: no call waits for any of it.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use monitoring::{Counter, Histogram, Metrics};

/// What endpoints count, all of a gateway together. Cheap to clone.
#[derive(Clone)]
pub(crate) struct Figures {
    /// Clients that are served.
    pub(crate) clients: Clients,
    /// Calls that were answered with what they asked for.
    answered: Counter,
    /// Calls that were refused.
    refused: Counter,
    /// Time of what an endpoint does at once: a call, or a tick.
    pub(crate) job_seconds: Histogram,
    /// What streams send.
    pub(crate) streams: StreamFigures,
    /// What becomes of worlds.
    pub(crate) worlds: WorldFigures,
    /// What tenants were refused.
    pub(crate) quotas: QuotaFigures,
}

/// What tenants were refused, by quota.
#[derive(Clone, Default)]
pub(crate) struct QuotaFigures {
    /// Spawns.
    pub(crate) actors: Counter,
    /// Spawns of cameras.
    pub(crate) cameras: Counter,
    /// Requests of pictures that were left out or came later.
    pub(crate) pixels: Counter,
    /// Recordings.
    pub(crate) recordings: Counter,
}

/// What becomes of worlds.
#[derive(Clone)]
pub(crate) struct WorldFigures {
    /// Those that were lost and made again.
    pub(crate) recovered: Counter,
    /// Those that were lost for good.
    pub(crate) lost: Counter,
    /// How long clients waited while theirs moved.
    pub(crate) move_seconds: Histogram,
}

/// What streams send.
#[derive(Clone, Default)]
pub(crate) struct StreamFigures {
    /// Messages for listeners.
    pub(crate) messages: Counter,
    /// Of them.
    pub(crate) bytes: Counter,
    /// Messages that listeners were too slow for.
    pub(crate) dropped: Counter,
}

/// How many clients are served.
#[derive(Clone, Default)]
pub(crate) struct Clients(Arc<AtomicUsize>);

impl Clients {
    /// Now.
    pub(crate) fn count(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    /// One endpoint has so many now, and had so many before.
    pub(crate) fn change(&self, now: usize, before: usize) {
        self.0.fetch_add(now, Ordering::Relaxed);
        self.0.fetch_sub(before, Ordering::Relaxed);
    }
}

impl StreamFigures {
    /// A message goes to so many listeners.
    pub(crate) fn note_sent(&self, listeners: usize, bytes: usize) {
        self.messages.inc_by(listeners as u64);
        self.bytes.inc_by((listeners * bytes) as u64);
    }
}

impl WorldFigures {
    /// New figures.
    pub(crate) fn new(metrics: &Metrics) -> Self {
        Self {
            recovered: metrics.counter(
                "causeway_gateway_worlds_recovered",
                "Worlds that were lost and made again",
            ),
            lost: metrics.counter("causeway_gateway_worlds_lost", "Worlds that were lost for good"),
            move_seconds: metrics.histogram(
                "causeway_gateway_move_seconds",
                "Time in which a world moved to another service",
            ),
        }
    }
}

impl QuotaFigures {
    /// New figures.
    pub(crate) fn new(metrics: &Metrics) -> Self {
        let quotas =
            ["actors_per_world", "cameras_per_world", "pixels_per_second", "recordings_mib"];
        let [actors, cameras, pixels, recordings] = metrics.counters(
            "causeway_gateway_quota_refused",
            "What tenants were refused, by quota",
            ("quota", quotas),
        );
        Self { actors, cameras, pixels, recordings }
    }
}

impl Figures {
    /// New figures.
    pub(crate) fn new(metrics: &Metrics) -> Self {
        let clients = Clients::default();
        let now = clients.clone();
        metrics.read_gauge("causeway_gateway_clients", "Clients", move || now.count() as f64);
        let label = ("outcome", ["answered", "refused"]);
        let [answered, refused] =
            metrics.counters("causeway_gateway_calls", "Calls by what came of them", label);
        Self {
            clients,
            answered,
            refused,
            job_seconds: metrics.histogram(
                "causeway_gateway_job_seconds",
                "Time of a call or tick at its endpoint",
            ),
            worlds: WorldFigures::new(metrics),
            quotas: QuotaFigures::new(metrics),
            streams: StreamFigures {
                messages: metrics.counter(
                    "causeway_gateway_stream_messages",
                    "Messages for listeners of streams",
                ),
                bytes: metrics.counter("causeway_gateway_stream_bytes", "Bytes of these messages"),
                dropped: metrics.counter(
                    "causeway_gateway_stream_dropped",
                    "Messages that listeners were too slow for",
                ),
            },
        }
    }

    /// A call is answered.
    pub(crate) fn note_answer<T, E>(&self, answer: &Result<T, E>) {
        let counter = if answer.is_ok() { &self.answered } else { &self.refused };
        counter.inc();
    }
}
