//! How a process is connected, as figures: a service that lost its router waits for it in silence.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;

use monitoring::Metrics;
use zenoh::Wait;
use zenoh::config::ZenohId;

use crate::Bus;
use crate::publishing::Publishing;

/// Between two looks. A router that is started again is another one, and a silent one is given up
/// only after seconds; a link that ends and is back at the same router by the next look is not
/// seen.
const LOOK_EVERY: Duration = Duration::from_millis(500);

impl Bus {
    /// Exports to how many routers the process is connected, and how many it has lost.
    ///
    /// Whoever reads them does so outside of a runtime, or on one with threads.
    pub fn export(&self, metrics: &Metrics) {
        // The place on the bus is not kept for the sake of figures.
        let place = Arc::downgrade(&self.publishing);
        let lost = Arc::new(AtomicU64::new(0));
        tokio::spawn(count_losses(place.clone(), Arc::clone(&lost)));
        metrics.read_gauge("causeway_bus_routers", "Routers it is connected to", move || {
            routers(&place).map_or(0.0, |found| found.len() as f64)
        });
        metrics.read_counter(
            "causeway_bus_routers_lost",
            "Routers it was connected to and is no more",
            move || lost.load(Ordering::Relaxed) as f64,
        );
    }
}

async fn count_losses(place: Weak<Publishing>, lost: Arc<AtomicU64>) {
    let mut before = Vec::new();
    while let Some(now) = routers(&place) {
        let gone = before.iter().filter(|router| !now.contains(router)).count();
        lost.fetch_add(gone as u64, Ordering::Relaxed);
        before = now;
        tokio::time::sleep(LOOK_EVERY).await;
    }
}

/// `None` once the place on the bus is given up.
fn routers(place: &Weak<Publishing>) -> Option<Vec<ZenohId>> {
    Some(place.upgrade()?.session().info().routers_zid().wait().collect())
}
