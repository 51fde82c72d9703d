//! Who can draw, and the way of one job to whoever does.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use bus::Bus;
use schemas::{Error, ErrorCode, RenderJob, ServiceId};
use tokio::sync::watch;
use tokio::time::Instant;

/// How long a job waits for a renderer to come, or to come back.
const RENDERER_WAIT: Duration = Duration::from_secs(5);
/// How long one renderer may take for one job.
const DRAW_DEADLINE: Duration = Duration::from_secs(30);

/// The renderers that are up, each with the count of its coming.
#[derive(Debug, Default)]
pub(crate) struct Renderers {
    live: watch::Sender<BTreeMap<ServiceId, u64>>,
    comings: AtomicUsize,
    turn: AtomicUsize,
}

impl Renderers {
    /// Takes note of a renderer that came or went.
    pub(crate) fn note(&self, id: ServiceId, is_up: bool) {
        let coming = self.comings.fetch_add(1, Ordering::Relaxed) as u64;
        self.live.send_modify(|live| {
            if is_up {
                live.insert(id, coming);
            } else {
                live.remove(&id);
            }
        });
    }

    /// Has one job drawn: by the next renderer in turn, or by another if that one is lost
    /// meanwhile. Gives the renderer's reply as it came.
    ///
    /// # Errors
    /// [`ErrorCode::RendererUnavailable`] when none is there or comes in time, when all that are
    /// there say that they cannot draw, or when one takes too long; other refusals as the renderer
    /// gave them.
    pub(crate) async fn draw(&self, bus: &Bus, job: &RenderJob) -> Result<Vec<u8>, Error> {
        let mut changes = self.live.subscribe();
        let mut tried = BTreeSet::new();
        let mut refusal = None;
        let give_up_at = Instant::now() + RENDERER_WAIT;
        loop {
            let next = self.next_but(&tried);
            let Some((id, coming)) = next else {
                // A renderer that says that it cannot draw is not worth waiting for.
                if let Some(refusal) = refusal {
                    return Err(refusal);
                }
                let changed = tokio::time::timeout_at(give_up_at, changes.changed()).await;
                if !matches!(changed, Ok(Ok(()))) {
                    return Err(none_came(&tried));
                }
                continue;
            };
            match bus.draw(&id, job, DRAW_DEADLINE).await {
                Err(lost) if lost.code == ErrorCode::Unreachable => {
                    tracing::warn!(renderer = %id, "a renderer was lost with a job; trying another");
                }
                Err(slow) if slow.code == ErrorCode::TimedOut => {
                    return Err(Error { code: ErrorCode::RendererUnavailable, ..slow });
                }
                Err(unable) if unable.code == ErrorCode::RendererUnavailable => {
                    refusal = Some(unable)
                }
                drawn_or_refused => return drawn_or_refused,
            }
            tried.insert((id, coming));
        }
    }

    fn next_but(&self, tried: &BTreeSet<(ServiceId, u64)>) -> Option<(ServiceId, u64)> {
        let live = self.live.borrow();
        let untried: Vec<(ServiceId, u64)> = live
            .iter()
            .map(|(id, coming)| (id.clone(), *coming))
            .filter(|renderer| !tried.contains(renderer))
            .collect();
        let turn = self.turn.fetch_add(1, Ordering::Relaxed);
        let at = turn.checked_rem(untried.len())?;
        untried.into_iter().nth(at)
    }
}

fn none_came(tried: &BTreeSet<(ServiceId, u64)>) -> Error {
    let found = if tried.is_empty() { "no renderer is up" } else { "the renderer was lost" };
    Error::new(ErrorCode::RendererUnavailable, "nobody can draw this picture; the world goes on")
        .wanted(format_args!("a render service within {} s", RENDERER_WAIT.as_secs()))
        .found(found)
}
