//! Tells faces how much there is to do here, so that they make new worlds where there is room.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use bus::Bus;
use schemas::{Load, ServiceId, ServiceKind};
use tokio::task::AbortHandle;
use tokio::time::MissedTickBehavior;

use crate::service::Seats;

/// Between two loads.
const EVERY: Duration = Duration::from_secs(1);
/// How long ago half of what a load tells was, about.
const MEMORY_SECS: f32 = 5.0;

/// Time that all threads together have spent in ticks. Cheap to clone.
#[derive(Clone, Debug, Default)]
pub(super) struct TickTime(Arc<AtomicU64>);

/// Which share of their time threads spend in ticks.
#[derive(Debug)]
struct Meter {
    spent: TickTime,
    threads: usize,
    before: Duration,
    busy: f32,
}

impl TickTime {
    /// A tick took so long.
    pub(super) fn add(&self, took: Duration) {
        self.0.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    fn all(&self) -> Duration {
        Duration::from_nanos(self.0.load(Ordering::Relaxed))
    }
}

impl Meter {
    fn new(spent: TickTime, threads: usize) -> Self {
        Self { spent, threads, before: Duration::ZERO, busy: 0.0 }
    }

    /// 0 to 1, of the last seconds, when so much time has passed.
    fn read(&mut self, elapsed: Duration) -> f32 {
        let spent = self.spent.all();
        let now = spent - std::mem::replace(&mut self.before, spent);
        let time = elapsed.as_secs_f32() * self.threads.max(1) as f32;
        let busy = if time > 0.0 { (now.as_secs_f32() / time).min(1.0) } else { self.busy };
        let weight = 1.0 - (-elapsed.as_secs_f32() / MEMORY_SECS).exp();
        self.busy += (busy - self.busy) * weight;
        self.busy
    }
}

/// Tells the load of a world service every second.
pub(super) fn tell(
    bus: &Bus,
    id: &ServiceId,
    seats: &Seats,
    (spent, threads): (TickTime, usize),
) -> AbortHandle {
    let (bus, id, seats) = (bus.clone(), id.clone(), seats.clone());
    let telling = async move {
        let mut meter = Meter::new(spent, threads);
        let mut every = tokio::time::interval(EVERY);
        every.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told_at = Instant::now();
        loop {
            every.tick().await;
            let busy = meter.read(told_at.elapsed());
            told_at = Instant::now();
            let (worlds, worlds_max) = (seats.taken() as u32, seats.max() as u32);
            bus.tell_load(ServiceKind::World, &id, &Load { worlds, worlds_max, busy });
        }
    };
    tokio::spawn(telling).abort_handle()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_follows_what_threads_do() {
        let spent = TickTime::default();
        let mut meter = Meter::new(spent.clone(), 2);
        let second = Duration::from_secs(1);
        assert!(meter.read(Duration::ZERO).abs() < 1e-6, "no time has passed");
        for _ in 0..30 {
            spent.add(second);
            meter.read(second);
        }
        let busy = meter.read(Duration::ZERO);
        assert!((busy - 0.5).abs() < 0.01, "one of two threads: {busy}");
        spent.add(10 * second);
        assert!(meter.read(second) <= 1.0);
        for _ in 0..30 {
            meter.read(second);
        }
        assert!(meter.read(second) < 0.01, "nothing was done");
    }
}
