//! What a process says of itself.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;

use crate::{Drain, Metrics, Pulse};

/// What a process says of itself. Cheap to clone; clones are one.
#[derive(Clone)]
pub struct Monitor(Arc<Inner>);

struct Inner {
    service: &'static str,
    window: Duration,
    epoch: Instant,
    is_started: AtomicBool,
    drain: watch::Sender<Drain>,
    conditions: Mutex<Vec<Arc<State>>>,
    pulses: Mutex<Vec<Arc<Pulse>>>,
    metrics: Metrics,
}

/// Something that must hold before the process can serve anybody.
#[derive(Clone)]
pub struct Condition(Arc<State>);

struct State {
    name: &'static str,
    /// Why it does not hold.
    failure: Mutex<Option<String>>,
}

impl Monitor {
    /// Of a process that runs this service, and may take `window` to end after it was told to.
    pub fn new(service: &'static str, version: &str, window: Duration) -> Self {
        let monitor = Self(Arc::new(Inner {
            service,
            window,
            epoch: Instant::now(),
            is_started: AtomicBool::new(false),
            drain: watch::Sender::new(Drain::No),
            conditions: Mutex::default(),
            pulses: Mutex::default(),
            metrics: Metrics::default(),
        }));
        let metrics = monitor.metrics();
        let labels = [("service", service.to_owned()), ("version", version.to_owned())];
        metrics.info("causeway_build", "The program", labels);
        monitor.export("causeway_ready", "Whether new work is taken", |monitor| {
            monitor.why_not_ready().is_none()
        });
        monitor.export("causeway_draining", "Whether it was told to take no new work", |monitor| {
            monitor.is_draining()
        });
        monitor
    }

    /// A yes or no; weak, as the monitor owns its figures.
    fn export(&self, name: &str, help: &str, read: fn(&Self) -> bool) {
        let weak = Arc::downgrade(&self.0);
        self.metrics().read_gauge(name, help, move || {
            let is_so = weak.upgrade().is_some_and(|inner| read(&Self(inner)));
            f64::from(u8::from(is_so))
        });
    }

    /// The subcommand that runs it.
    pub fn service(&self) -> &'static str {
        self.0.service
    }

    /// How long it may take to end after it was told to; zero: nothing is waited for.
    pub fn window(&self) -> Duration {
        self.0.window
    }

    /// Its figures.
    pub fn metrics(&self) -> &Metrics {
        &self.0.metrics
    }

    /// It has done what it does once, and its ports are open.
    pub fn set_started(&self) {
        self.0.is_started.store(true, Ordering::Release);
    }

    /// Whether it has started.
    pub fn is_started(&self) -> bool {
        self.0.is_started.load(Ordering::Acquire)
    }

    /// Something that must hold before it can serve anybody, and does not yet.
    pub fn condition(&self, name: &'static str, failure: &str) -> Condition {
        let state = Arc::new(State { name, failure: Mutex::new(Some(failure.to_owned())) });
        lock(&self.0.conditions).push(Arc::clone(&state));
        Condition(state)
    }

    /// A loop whose turns are followed.
    pub fn pulse(&self, name: &str) -> Arc<Pulse> {
        let pulse = Arc::new(Pulse::new(name, self.0.epoch));
        lock(&self.0.pulses).push(Arc::clone(&pulse));
        pulse
    }

    /// The first loop that is stuck. Says nothing of the bus, of other processes or of disks: to
    /// start this process anew mends none of them.
    pub fn why_not_live(&self) -> Option<String> {
        let now = Instant::now();
        lock(&self.0.pulses).iter().find_map(|pulse| pulse.why_stuck(now))
    }

    /// The first reason why new work should go elsewhere.
    pub fn why_not_ready(&self) -> Option<String> {
        if self.is_draining() {
            return Some("drain: it takes no new work".to_owned());
        }
        let failed = |state: &Arc<State>| {
            lock(&state.failure).as_ref().map(|why| format!("{}: {why}", state.name))
        };
        let failure = lock(&self.0.conditions).iter().find_map(failed);
        let starting = || (!self.is_started()).then(|| "start: it has not started yet".to_owned());
        failure.or_else(starting).or_else(|| self.why_not_live())
    }

    /// Takes no new work until [`undrain`](Self::undrain); what it has goes on.
    pub fn drain(&self) {
        self.0.drain.send_if_modified(|drain| {
            let is_new = *drain == Drain::No;
            if is_new {
                *drain = Drain::Asked;
            }
            is_new
        });
    }

    /// Takes new work again; whether it does, which one that is ending does not.
    pub fn undrain(&self) -> bool {
        self.0.drain.send_if_modified(|drain| {
            let is_asked = *drain == Drain::Asked;
            if is_asked {
                *drain = Drain::No;
            }
            is_asked
        });
        !self.is_draining()
    }

    /// Takes no new work any more, and ends after its [window](Self::window) at the latest.
    pub fn begin_end(&self) {
        let since = Instant::now();
        self.0.drain.send_replace(Drain::Ending { since, until: since + self.window() });
    }

    /// Whether it takes new work.
    pub fn drain_now(&self) -> Drain {
        *self.0.drain.borrow()
    }

    /// Whether it takes no new work.
    pub fn is_draining(&self) -> bool {
        self.drain_now().is_on()
    }

    /// Whether it was told to end.
    pub fn is_ending(&self) -> bool {
        matches!(self.drain_now(), Drain::Ending { .. })
    }

    /// Follows whether it takes new work.
    pub fn follow_drain(&self) -> watch::Receiver<Drain> {
        self.0.drain.subscribe()
    }
}

impl Default for Monitor {
    /// For a service that nobody watches over.
    fn default() -> Self {
        Self::new("service", "", Duration::ZERO)
    }
}

impl Condition {
    /// It holds.
    pub fn meet(&self) {
        *lock(&self.0.failure) = None;
    }

    /// It does not hold, for this reason.
    pub fn fail(&self, why: impl Into<String>) {
        *lock(&self.0.failure) = Some(why.into());
    }

    /// Holds or not.
    pub fn set(&self, holds: bool, why: &str) {
        if holds { self.meet() } else { self.fail(why) }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing panics while it holds the lock.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ready_is_who_has_started_and_whose_conditions_hold() {
        let monitor = Monitor::default();
        let why = || monitor.why_not_ready().unwrap_or_default();
        let host = monitor.condition("worlds", "no world service is up");
        assert_eq!(why(), "worlds: no world service is up");
        host.meet();
        assert_eq!(why(), "start: it has not started yet");
        monitor.set_started();
        assert_eq!(monitor.why_not_ready(), None);
        assert!(monitor.metrics().text().contains("causeway_ready 1"));
        host.set(false, "it is gone");
        assert_eq!(why(), "worlds: it is gone");
        assert!(monitor.metrics().text().contains("causeway_ready 0"));
    }

    #[test]
    fn who_drains_may_be_told_otherwise_until_it_ends() {
        let monitor = Monitor::new("world", "", Duration::from_secs(60));
        let mut followed = monitor.follow_drain();
        monitor.set_started();
        monitor.drain();
        assert!(followed.has_changed().unwrap() && followed.borrow_and_update().is_on());
        monitor.drain();
        assert!(!followed.has_changed().unwrap());
        assert_eq!(monitor.why_not_ready().unwrap(), "drain: it takes no new work");
        assert!(monitor.undrain() && monitor.why_not_ready().is_none());
        monitor.begin_end();
        monitor.drain();
        assert!(!monitor.undrain());
        let Drain::Ending { since, until } = monitor.drain_now() else { panic!("it does not end") };
        assert_eq!(until - since, Duration::from_secs(60));
    }
}
