//! One log for all processes of a site: lines on standard error that name their process.

use std::fmt;

use tracing::{Event, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::time::{FormatTime, SystemTime};
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;

use crate::outlet::Outlet;

/// The transport reports every reconnect as a warning; our services say in their own words who is
/// gone.
const FILTER_DEFAULT: &str = "info,zenoh=error,wgpu=warn,naga=warn";

/// Starts the log of this process. A second call changes nothing.
pub(crate) fn init(process: &'static str) {
    let wanted = std::env::var("RUST_LOG").unwrap_or_default();
    let parsed = if wanted.is_empty() { None } else { Some(EnvFilter::try_new(&wanted)) };
    let refusal = parsed.as_ref().and_then(|parsed| parsed.as_ref().err().map(ToString::to_string));
    let filter = parsed.and_then(Result::ok).unwrap_or_else(|| EnvFilter::new(FILTER_DEFAULT));
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(|| Outlet::Error)
        .with_ansi(false)
        .event_format(Line { process })
        .try_init();
    if let Some(refusal) = refusal {
        tracing::warn!("RUST_LOG is not understood ({refusal}); wanted e.g. info,zenoh=debug");
    }
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
        writeln!(writer)
    }
}
