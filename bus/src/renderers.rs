//! Who can draw, and the way of one job to whoever does.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use schemas::{
    Alive, Error, ErrorCode, FrameBytes, Images, RenderJob, Reply, ServiceId, ServiceKind, keys,
    wire,
};
use tokio::sync::watch;
use tokio::time::Instant;

use crate::shortcut::Shortcut;
use crate::{Bus, Draining, Presence};

/// How long a job waits for a renderer to come, or to come back.
const RENDERER_WAIT: Duration = Duration::from_secs(5);
/// How long one renderer may take for one job.
const DRAW_DEADLINE: Duration = Duration::from_secs(30);

/// The renderers that are up. Whoever has frames to be drawn keeps one.
#[derive(Default)]
pub struct Renderers {
    live: watch::Sender<BTreeMap<ServiceId, Live>>,
    draining: OnceLock<Draining>,
    turn: AtomicUsize,
}

/// A renderer that is up.
#[derive(Clone)]
struct Live {
    bus: Bus,
    /// The count of its coming.
    coming: usize,
    /// Past whoever routes, which large pictures are worth.
    shortcut: Option<Arc<Shortcut>>,
}

impl Renderers {
    /// Follows the renderers of a bus that may still be connecting.
    pub fn follow(bus: watch::Receiver<Option<Bus>>) -> Arc<Self> {
        let renderers = Arc::new(Self::default());
        tokio::spawn(Arc::clone(&renderers).run(bus));
        renderers
    }

    async fn run(self: Arc<Self>, mut bus: watch::Receiver<Option<Bus>>) {
        let Ok(bus) = bus.wait_for(Option::is_some).await.map(|bus| bus.clone()) else { return };
        let Some(bus) = bus else { return };
        let mut presence = match bus.watch(Some(ServiceKind::Render)).await {
            Ok(presence) => presence,
            Err(error) => {
                tracing::error!(%error, "renderers cannot be followed");
                return;
            }
        };
        match bus.follow_draining(ServiceKind::Render).await {
            Ok(draining) => drop(self.draining.set(draining)),
            Err(error) => tracing::error!(%error, "renderers that end cannot be told apart"),
        }
        for coming in 0.. {
            match presence.next().await {
                Presence::Up(Alive { id, .. }) => {
                    let shortcut = bus.shortcut(&keys::render_job(&id)).await.map(Arc::new);
                    tracing::debug!(renderer = %id, found = shortcut.is_some(), "shortcut");
                    let renderer = Live { bus: bus.clone(), coming, shortcut };
                    self.live.send_modify(|live| drop(live.insert(id, renderer)));
                }
                Presence::Down(_, id) => self.live.send_modify(|live| drop(live.remove(&id))),
            }
        }
    }

    /// Whether one is up.
    pub fn is_any_up(&self) -> bool {
        !self.live.borrow().is_empty()
    }

    /// Has one job drawn: by the next renderer in turn, or by another if that one is lost
    /// meanwhile.
    ///
    /// # Errors
    /// [`ErrorCode::RendererUnavailable`] when none is there or comes in time, when all that are
    /// there say that they cannot draw, or when one takes too long; other refusals as the renderer
    /// gave them.
    pub async fn draw<F>(&self, job: &RenderJob<F>) -> Result<Images, Error>
    where
        F: FrameBytes + Sync,
    {
        match wire::decode_reply(&self.drawn(&wire::encode_render_job(job)).await?)? {
            Reply::Images(images) => Ok(images),
            Reply::Error(error) => Err(error),
            _ => Err(Error::new(ErrorCode::InvalidMessage, "the renderer sent no pictures")),
        }
    }

    /// The renderer's reply as it came.
    async fn drawn(&self, job: &[u8]) -> Result<Vec<u8>, Error> {
        let mut changes = self.live.subscribe();
        let mut tried = BTreeSet::new();
        let mut refusal = None;
        let give_up_at = Instant::now() + RENDERER_WAIT;
        loop {
            let next = self.next_but(&tried);
            let Some((id, renderer)) = next else {
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
            match self.ask(&id, &renderer, job).await {
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
            tried.insert((id, renderer.coming));
        }
    }

    /// Asks by the shortcut; where that leads nowhere, on the bus.
    async fn ask(&self, id: &ServiceId, renderer: &Live, job: &[u8]) -> Result<Vec<u8>, Error> {
        if let Some(shortcut) = &renderer.shortcut {
            let asked = async { shortcut.connect().await?.ask(job, DRAW_DEADLINE).await };
            let asked = tokio::select! {
                asked = asked => asked,
                // Of one that stands still only the bus takes notice.
                () = self.until_gone(id, renderer.coming) => Err(std::io::ErrorKind::TimedOut.into()),
            };
            match asked {
                Ok(answer) => return answer,
                Err(cause) => tracing::debug!(renderer = %id, %cause, "asked on the bus instead"),
            }
        }
        renderer.bus.draw_bytes(id, job.to_vec(), DRAW_DEADLINE).await
    }

    async fn until_gone(&self, id: &ServiceId, coming: usize) {
        let is_up = |live: &Live| live.coming == coming;
        let mut live = self.live.subscribe();
        // The sender is not dropped before this value.
        let _ = live.wait_for(|live| !live.get(id).is_some_and(is_up)).await;
    }

    fn next_but(&self, tried: &BTreeSet<(ServiceId, usize)>) -> Option<(ServiceId, Live)> {
        let live = self.live.borrow();
        let mut untried: Vec<(&ServiceId, &Live)> = live
            .iter()
            .filter(|(id, renderer)| !tried.contains(&((*id).clone(), renderer.coming)))
            .collect();
        let ends = |id: &ServiceId| self.draining.get().is_some_and(|draining| draining.has(id));
        if untried.iter().any(|(id, _)| !ends(id)) {
            untried.retain(|(id, _)| !ends(id));
        }
        let turn = self.turn.fetch_add(1, Ordering::Relaxed);
        let (id, renderer) = untried.get(turn.checked_rem(untried.len())?)?;
        Some(((*id).clone(), (*renderer).clone()))
    }
}

fn none_came(tried: &BTreeSet<(ServiceId, usize)>) -> Error {
    let found = if tried.is_empty() { "no renderer is up" } else { "the renderer was lost" };
    Error::new(ErrorCode::RendererUnavailable, "nobody can draw this picture; the world goes on")
        .wanted(format_args!("a render service within {} s", RENDERER_WAIT.as_secs()))
        .found(found)
}
