//! The figures of one process, as OpenMetrics text.
//!
//! Whoever counts keeps the handle; nothing is looked up by name on the way. Label values are known
//! when a figure is made, so that the number of series has a bound.

use std::fmt::{self, Debug};
use std::sync::{Mutex, MutexGuard, PoisonError};

use prometheus_client::encoding::text::encode;
use prometheus_client::encoding::{EncodeMetric, MetricEncoder, NoLabelSet};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::info::Info;
use prometheus_client::registry::{Metric, Registry};

use crate::by_name::Seconds;
use crate::{Histogram, SecondsByName};

/// A count that only grows; a relaxed atomic. Cheap to clone; clones count together.
pub type Counter = prometheus_client::metrics::counter::Counter;
/// A number that comes and goes; a relaxed atomic. Cheap to clone; clones are one number.
pub type Gauge = prometheus_client::metrics::gauge::Gauge;

/// The figures of one process. Names are those of the text, `causeway_SERVICE_WHAT_UNIT`, without
/// the `_total` that ends those of counters; a help text is a sentence without its full stop.
#[derive(Default)]
pub struct Metrics(Mutex<Registry>);

impl Metrics {
    /// A count.
    pub fn counter(&self, name: &str, help: &str) -> Counter {
        self.register(name, help, Counter::default())
    }

    /// A count for each value of a label.
    pub fn counters<const N: usize>(
        &self,
        name: &str,
        help: &str,
        (label, values): (&'static str, [&'static str; N]),
    ) -> [Counter; N] {
        let family = Family::<[(&'static str, &'static str); 1], Counter>::default();
        let counters = values.map(|value| family.get_or_create_owned(&[(label, value)]));
        self.register(name, help, family);
        counters
    }

    /// A number that comes and goes.
    pub fn gauge(&self, name: &str, help: &str) -> Gauge {
        self.register(name, help, Gauge::default())
    }

    /// A number that is looked up when somebody asks; `read` may make no figures.
    pub fn read_gauge(
        &self,
        name: &str,
        help: &str,
        read: impl Fn() -> f64 + Send + Sync + 'static,
    ) {
        self.register_read(name, help, (MetricType::Gauge, Box::new(read)));
    }

    /// A count that is looked up when somebody asks; `read` may make no figures.
    pub fn read_counter(
        &self,
        name: &str,
        help: &str,
        read: impl Fn() -> f64 + Send + Sync + 'static,
    ) {
        self.register_read(name, help, (MetricType::Counter, Box::new(read)));
    }

    /// Times by how long they were.
    pub fn histogram(&self, name: &str, help: &str) -> Histogram {
        self.register(name, help, Histogram::default())
    }

    /// Seconds by names from outside; only the first of many names have a count of their own.
    pub fn seconds_by_name(&self, name: &str, help: &str, label: &'static str) -> SecondsByName {
        SecondsByName::new(label, self.register(name, help, Seconds::default()))
    }

    /// A fact: a name that ends in `_info`, which is left out here, and words.
    pub fn info<const N: usize>(
        &self,
        name: &str,
        help: &str,
        labels: [(&'static str, String); N],
    ) {
        self.lock().register(name, help, Info::new(labels.to_vec()));
    }

    /// All figures as OpenMetrics text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = encode(&mut text, &self.lock());
        text
    }

    fn register<M: Metric + Clone>(&self, name: &str, help: &str, metric: M) -> M {
        self.lock().register(name, help, metric.clone());
        metric
    }

    fn register_read(&self, name: &str, help: &str, (kind, read): (MetricType, Reading)) {
        self.lock().register(name, help, Read { kind, read });
    }

    fn lock(&self) -> MutexGuard<'_, Registry> {
        // What was registered is whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

type Reading = Box<dyn Fn() -> f64 + Send + Sync>;

/// A figure that is looked up.
struct Read {
    kind: MetricType,
    read: Reading,
}

impl EncodeMetric for Read {
    fn encode(&self, mut encoder: MetricEncoder<'_>) -> Result<(), fmt::Error> {
        let value = (self.read)();
        match self.kind {
            MetricType::Counter => encoder.encode_counter::<NoLabelSet, f64, f64>(&value, None),
            _ => encoder.encode_gauge(&value),
        }
    }

    fn metric_type(&self) -> MetricType {
        self.kind
    }
}

impl Debug for Read {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Read").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_is_counted_is_in_the_text() {
        let metrics = Metrics::default();
        let [destroyed, lost] = metrics.counters(
            "causeway_world_ended",
            "Worlds that ended",
            ("reason", ["destroyed", "lost"]),
        );
        destroyed.inc();
        destroyed.clone().inc();
        lost.inc_by(0);
        metrics.gauge("causeway_world_worlds", "Worlds").set(3);
        metrics.read_gauge("causeway_a_ratio", "A number", || 0.5);
        metrics.read_counter("causeway_b_seconds", "Seconds", || 2.5);
        metrics.info("causeway_build", "The program", [("version", "0.1".to_owned())]);
        let text = metrics.text();
        for line in [
            "# TYPE causeway_world_ended counter",
            "causeway_world_ended_total{reason=\"destroyed\"} 2",
            "causeway_world_ended_total{reason=\"lost\"} 0",
            "# HELP causeway_world_worlds Worlds.",
            "causeway_world_worlds 3",
            "causeway_a_ratio 0.5",
            "causeway_b_seconds_total 2.5",
            "causeway_build_info{version=\"0.1\"} 1",
            "# EOF",
        ] {
            assert!(text.lines().any(|found| found == line), "{line} is not in {text}");
        }
    }

    #[test]
    fn times_are_counted_by_the_first_bound_that_holds_them() {
        let metrics = Metrics::default();
        let times = metrics.histogram("causeway_tick_seconds", "Times");
        for micros in [10, 11, 700, 20_000_000] {
            times.observe(Duration::from_micros(micros));
        }
        let text = metrics.text();
        for line in [
            "causeway_tick_seconds_bucket{le=\"0.00001\"} 1",
            "causeway_tick_seconds_bucket{le=\"0.00002\"} 2",
            "causeway_tick_seconds_bucket{le=\"0.0005\"} 2",
            "causeway_tick_seconds_bucket{le=\"0.001\"} 3",
            "causeway_tick_seconds_bucket{le=\"10.0\"} 3",
            "causeway_tick_seconds_bucket{le=\"+Inf\"} 4",
            "causeway_tick_seconds_count 4",
            "causeway_tick_seconds_sum 20.000721",
        ] {
            assert!(text.lines().any(|found| found == line), "{line} is not in {text}");
        }
    }
}
