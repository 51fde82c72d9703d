//! Figures of a world service.

use std::sync::Arc;
use std::time::Duration;

use bus::Bus;
use monitoring::{Counter, Histogram, Metrics};
use schemas::EncodedFrame;

use super::load::TickTime;
use crate::service::Seats;

/// What shards count. Relaxed atomics: ticks wait for none of it.
#[derive(Clone)]
pub(super) struct ShardFigures {
    tick_seconds: Histogram,
    /// All of it together.
    pub(super) tick_time: TickTime,
    frames: Counter,
    frame_bytes: Counter,
}

impl ShardFigures {
    /// New figures.
    fn new(metrics: &Metrics) -> Self {
        Self {
            tick_seconds: metrics.histogram("causeway_world_tick_seconds", "Time of a tick"),
            tick_time: TickTime::default(),
            frames: metrics.counter("causeway_world_frames_published", "Frames for subscribers"),
            frame_bytes: metrics
                .counter("causeway_world_frame_bytes", "Bytes of frames for subscribers"),
        }
    }

    /// A tick took so long.
    pub(super) fn note_tick(&self, took: Duration) {
        self.tick_seconds.observe(took);
        self.tick_time.add(took);
    }

    /// A frame goes to subscribers.
    pub(super) fn note_frame(&self, frame: &EncodedFrame) {
        self.frames.inc();
        self.frame_bytes.inc_by(frame.0.len() as u64);
    }
}

/// Exports what others count, and gives what shards do.
pub(super) fn export(metrics: &Metrics, seats: &Seats, bus: &Bus) -> ShardFigures {
    let of = |read: fn(&Seats) -> f64| {
        let seats = seats.clone();
        move || read(&seats)
    };
    metrics.read_gauge("causeway_world_worlds", "Worlds", of(|seats| seats.taken() as f64));
    metrics.read_gauge(
        "causeway_world_worlds_max",
        "Worlds at once",
        of(|seats| seats.max() as f64),
    );
    metrics.read_counter(
        "causeway_world_created",
        "Worlds that were made, restored and forked",
        of(|seats| seats.begun() as f64),
    );
    metrics.read_counter(
        "causeway_world_quarantined",
        "Worlds that were put aside",
        of(|seats| seats.quarantined() as f64),
    );
    let dropped = bus.dropped_publications();
    metrics.read_counter(
        "causeway_world_frames_dropped",
        "Frames that subscribers were too slow for, before they were sent",
        move || dropped() as f64,
    );
    ShardFigures::new(metrics)
}

/// Counts what goes to journals.
pub(super) fn journal_bytes(metrics: &Metrics) -> Counter {
    metrics.counter("causeway_world_journal_bytes", "Bytes for journals, before they are packed")
}

/// Requests by what came of them.
#[derive(Clone)]
pub(super) struct RequestFigures(Arc<[Counter; OUTCOMES.len()]>);

/// Values of the label.
const OUTCOMES: [&str; 4] = ["done", "capacity", "draining", "refused"];

/// What came of a request.
#[derive(Clone, Copy, Debug)]
pub(super) enum Outcome {
    Done,
    Capacity,
    Draining,
    Refused,
}

impl RequestFigures {
    /// New figures.
    pub(super) fn new(metrics: &Metrics) -> Self {
        let help = "Requests about worlds, by what came of them";
        let label = ("outcome", OUTCOMES);
        Self(Arc::new(metrics.counters("causeway_world_requests", help, label)))
    }

    /// Counts one.
    pub(super) fn note(&self, outcome: Outcome) {
        let [done, capacity, draining, refused] = &*self.0;
        let counter = match outcome {
            Outcome::Done => done,
            Outcome::Capacity => capacity,
            Outcome::Draining => draining,
            Outcome::Refused => refused,
        };
        counter.inc();
    }
}
