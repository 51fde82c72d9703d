//! One log for all processes of a site: lines on standard error that name their process.
//! Where it is wanted, who did what goes to a file as well.

use std::fmt;
use std::path::Path;
use std::sync::LazyLock;

use tracing::{Event, Level, Subscriber};
use tracing_subscriber::filter::{FilterExt as _, Targets};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime, SystemTime};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer as _};

use crate::audit::{self, AuditEnd, AuditError};
use crate::log_pace::LogPace;
use crate::outlet::Outlet;

/// The transport reports every reconnect as a warning; our services say in their own words who is
/// gone.
const FILTER_DEFAULT: &str = "info,zenoh=error,wgpu=warn,naga=warn";

/// Lasts as long as the log, which is the process's.
static PACE: LazyLock<LogPace> = LazyLock::new(LogPace::default);

/// Starts the log of this process, and what is written down in a folder until the end is dropped.
/// A second call changes nothing.
///
/// # Errors
/// The folder cannot be used.
pub(crate) fn init(
    process: &'static str,
    audit: Option<&Path>,
) -> Result<Option<AuditEnd>, AuditError> {
    let begun = audit.map(|folder| audit::begin(folder, process)).transpose()?;
    let (layer, end) = begun.unzip();
    let wanted = std::env::var("RUST_LOG").unwrap_or_default();
    let parsed = if wanted.is_empty() { None } else { Some(EnvFilter::try_new(&wanted)) };
    let refusal = parsed.as_ref().and_then(|parsed| parsed.as_ref().err().map(ToString::to_string));
    let filter = parsed.and_then(Result::ok).unwrap_or_else(|| EnvFilter::new(FILTER_DEFAULT));
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(|| Outlet::Error)
        .with_ansi(false)
        .event_format(Line { process })
        .with_filter(filter.and(&*PACE));
    let audited = Targets::new().with_target("audit", Level::DEBUG);
    let layer = layer.map(|layer| layer.with_filter(audited));
    let _ = tracing_subscriber::registry().with(lines).with(layer).try_init();
    if let Some(refusal) = refusal {
        tracing::warn!("RUST_LOG is not understood ({refusal}); wanted e.g. info,zenoh=debug");
    }
    Ok(end)
}

/// `time LEVEL process  message field=value`.
struct Line {
    process: &'static str,
}

impl<S, N> FormatEvent<S, N> for Line
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        SystemTime.format_time(&mut writer)?;
        write!(writer, " {:<5} {:<8} ", event.metadata().level(), self.process)?;
        context.format_fields(writer.by_ref(), event)?;
        match PACE.take_left_out(&event.metadata().callsite()) {
            0 => writeln!(writer),
            count => writeln!(writer, " ({count} lines like this left out)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::sync::{Arc, Mutex};
    use std::time::Duration;

    use super::*;

    #[derive(Clone, Default)]
    struct Page(Arc<Mutex<Vec<u8>>>);

    impl Write for Page {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn one_place_fills_no_log_and_the_next_line_tells_what_is_missing() {
        let page = Page::default();
        let writer = page.clone();
        let lines = tracing_subscriber::fmt::layer()
            .with_writer(move || writer.clone())
            .event_format(Line { process: "test" })
            .with_filter(EnvFilter::new("debug").and(&*PACE));
        tracing::subscriber::with_default(tracing_subscriber::registry().with(lines), || {
            for round in [150, 1] {
                (0..round).for_each(|count| tracing::warn!(count, "again"));
                std::thread::sleep(Duration::from_millis(150));
            }
            (0..150).for_each(|_| tracing::debug!("asked for"));
            tracing::info!("from another place");
        });
        let text = String::from_utf8(page.0.lock().unwrap().clone()).unwrap();
        let count = |what: &str| text.lines().filter(|line| line.contains(what)).count();
        // A slow machine lets some more through.
        assert!((101..=130).contains(&count("again")), "{}", count("again"));
        assert_eq!(count("lines like this left out)"), 1);
        assert_eq!((count("asked for"), count("from another place")), (150, 1));
    }
}
