//! What the kernel tells of this process, under the names that Prometheus' own libraries use.

use std::fs;
use std::time::{SystemTime, UNIX_EPOCH};

use monitoring::Metrics;

/// Ticks of the kernel's clock in a second, as user space sees it on every architecture that is
/// built for (`USER_HZ`).
const TICKS_PER_SEC: f64 = 100.0;

/// Figures of the process, looked up whenever somebody asks.
pub(crate) fn export(metrics: &Metrics) {
    let begun = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    metrics.read_gauge(
        "process_start_time_seconds",
        "When the process began to be watched, since 1970",
        move || begun,
    );
    metrics.read_gauge("process_resident_memory_bytes", "Memory in use", || {
        figure("VmRSS:").unwrap_or_default() * 1024.0
    });
    metrics.read_gauge("process_threads", "Threads", || figure("Threads:").unwrap_or_default());
    metrics.read_counter("process_cpu_seconds", "Time of processors that was used", || {
        cpu_secs().unwrap_or_default()
    });
    metrics.read_gauge("process_open_fds", "Open files and sockets", || {
        fs::read_dir("/proc/self/fd").map_or(0.0, |files| files.count() as f64)
    });
}

/// A number of `/proc/self/status`.
fn figure(name: &str) -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

/// In user space and the kernel: the 14th and 15th field of `/proc/self/stat`, of which the second,
/// in parentheses, may hold anything.
fn cpu_secs() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    let (_, rest) = stat.rsplit_once(')')?;
    let mut times = rest.split_whitespace().skip(11).map(str::parse::<f64>);
    Some((times.next()?.ok()? + times.next()?.ok()?) / TICKS_PER_SEC)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_memory_threads_and_has_taken_time() {
        assert!(figure("VmRSS:").unwrap() > 100.0);
        assert!(figure("Threads:").unwrap() >= 1.0);
        let begun = std::time::Instant::now();
        while cpu_secs().unwrap() < 0.02 {
            assert!(begun.elapsed().as_secs() < 30, "no time is counted");
        }
    }
}
