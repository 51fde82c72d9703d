//! Seconds by names that come from outside, of which there may be any number.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;

/// Names with a count of their own; those that come later are counted together.
const NAMES_MAX: usize = 64;
/// As whom.
const OTHER: &str = "other";

pub(crate) type Seconds = Family<[(&'static str, String); 1], Counter<f64, AtomicU64>>;

/// Seconds that grow, by name. Cheap to clone; clones count together.
#[derive(Clone, Debug)]
pub struct SecondsByName {
    label: &'static str,
    seconds: Seconds,
    names: Arc<Mutex<BTreeSet<String>>>,
}

impl SecondsByName {
    pub(crate) fn new(label: &'static str, seconds: Seconds) -> Self {
        Self { label, seconds, names: Arc::default() }
    }

    /// Adds what somebody used.
    pub fn add(&self, name: &str, used: Duration) {
        let own = if self.is_counted(name) { name } else { OTHER };
        let labels = [(self.label, own.to_owned())];
        self.seconds.get_or_create(&labels).inc_by(used.as_secs_f64());
    }

    fn is_counted(&self, name: &str) -> bool {
        // Nothing panics while it holds the lock.
        let mut names = self.names.lock().unwrap_or_else(PoisonError::into_inner);
        names.contains(name) || (names.len() < NAMES_MAX && names.insert(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Metrics;

    #[test]
    fn the_first_names_have_their_own_count_and_the_rest_one_together() {
        let metrics = Metrics::default();
        let used = metrics.seconds_by_name("causeway_test_tenant_seconds", "Time", "tenant");
        for number in 0..NAMES_MAX + 10 {
            used.add(&format!("t{number}"), Duration::from_millis(500));
        }
        used.add("t0", Duration::from_secs(1));
        let text = metrics.text();
        let line = |name: &str, secs: &str| {
            format!("causeway_test_tenant_seconds_total{{tenant=\"{name}\"}} {secs}\n")
        };
        assert!(
            text.contains(&line("t0", "1.5")) && text.contains(&line("other", "5.0")),
            "{text}"
        );
        assert_eq!(text.matches("{tenant=").count(), NAMES_MAX + 1);
    }
}
