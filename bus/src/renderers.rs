//! Who can draw, and the way of one job to whoever does.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use schemas::{
    Alive, Error, ErrorCode, FrameBytes, Images, RenderJob, Reply, ServiceId, ServiceKind, keys,
    limits, wire,
};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::Instant;

use crate::{Bus, Channel, Draining, Presence};

/// How long a job waits for a renderer to come, or to come back.
const RENDERER_WAIT: Duration = Duration::from_secs(5);
/// How long one renderer may take for one job.
const DRAW_DEADLINE: Duration = Duration::from_secs(30);
/// What a picture costs beside its pixels, in pixels: about 1 ms of software.
const PICTURE_PIXELS: u64 = 32_000;

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
    /// The count of its coming.
    coming: usize,
    /// By a shortcut past whoever routes, which large pictures are worth.
    channel: Arc<Channel>,
    /// Pixels that this process waits for from it.
    waiting: Arc<AtomicU64>,
}

/// Pixels that are waited for as long as this lives.
struct Waiting(Arc<AtomicU64>, u64);

impl Waiting {
    fn new(of: &Arc<AtomicU64>, pixels: u64) -> Self {
        of.fetch_add(pixels, Ordering::Relaxed);
        Self(Arc::clone(of), pixels)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.fetch_sub(self.1, Ordering::Relaxed);
    }
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
        let (mut comings, mut opening) = (BTreeMap::new(), JoinSet::new());
        for coming in 0.. {
            tokio::select! {
                change = presence.next() => match change {
                    Presence::Up(Alive { id, .. }) => {
                        comings.insert(id.clone(), coming);
                        opening.spawn(open(bus.clone(), id, coming));
                    }
                    Presence::Down(_, id) => {
                        comings.remove(&id);
                        self.live.send_modify(|live| drop(live.remove(&id)));
                    }
                },
                Some(opened) = opening.join_next() => {
                    let Ok(Some((id, renderer))) = opened else { continue };
                    // It may have gone meanwhile, and come again.
                    if comings.get(&id) == Some(&renderer.coming) {
                        self.live.send_modify(|live| drop(live.insert(id, renderer)));
                    }
                }
            }
        }
    }

    /// Whether one is up.
    pub fn is_any_up(&self) -> bool {
        !self.live.borrow().is_empty()
    }

    /// Has one job drawn: by the renderer from which this process waits for least, in turn among
    /// equals, or by another if that one is lost meanwhile.
    ///
    /// # Errors
    /// [`ErrorCode::RendererUnavailable`] when none is there or comes in time, when all that are
    /// there say that they cannot draw, or when one takes too long; other refusals as the renderer
    /// gave them.
    pub async fn draw<F>(&self, job: &RenderJob<F>) -> Result<Images, Error>
    where
        F: FrameBytes + Sync,
    {
        let pixels = job.cameras.iter().map(|camera| {
            PICTURE_PIXELS + u64::from(camera.width_px) * u64::from(camera.height_px)
        });
        let (pixels, job) = (pixels.sum(), wire::encode_render_job(job));
        match wire::decode_reply(&self.drawn(&job, pixels).await?)? {
            Reply::Images(images) => Ok(images),
            Reply::Error(error) => Err(error),
            _ => Err(Error::new(ErrorCode::InvalidMessage, "the renderer sent no pictures")),
        }
    }

    /// The renderer's reply as it came.
    async fn drawn(&self, job: &[u8], pixels: u64) -> Result<Vec<u8>, Error> {
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
            let waiting = Waiting::new(&renderer.waiting, pixels);
            let channel = &renderer.channel;
            let asked = channel.ask(job, limits::REPLY_BYTES_MAX, DRAW_DEADLINE);
            // One that stands still is not waited for where another may draw.
            let asked = channel.while_heard(asked).await;
            drop(waiting);
            match asked {
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
        let waiting: Vec<u64> =
            untried.iter().map(|(_, live)| live.waiting.load(Ordering::Relaxed)).collect();
        let turn = self.turn.fetch_add(1, Ordering::Relaxed);
        let (id, renderer) = untried.get(least(&waiting, turn)?)?;
        Some(((*id).clone(), (*renderer).clone()))
    }
}

/// Opens the way to a renderer that has come up.
async fn open(bus: Bus, id: ServiceId, coming: usize) -> Option<(ServiceId, Live)> {
    match bus.channel(&keys::render_job(&id), (ServiceKind::Render, &id)).await {
        Ok(channel) => {
            tracing::debug!(renderer = %id, found = channel.has_shortcut(), "shortcut");
            let (channel, waiting) = (Arc::new(channel), Arc::default());
            Some((id, Live { coming, channel, waiting }))
        }
        Err(error) => {
            tracing::warn!(renderer = %id, %error, "a renderer cannot be asked");
            None
        }
    }
}

/// The place of the least, in turn among equals.
fn least(waiting: &[u64], turn: usize) -> Option<usize> {
    let first = turn.checked_rem(waiting.len())?;
    (first..waiting.len()).chain(0..first).min_by_key(|place| waiting.get(*place))
}

fn none_came(tried: &BTreeSet<(ServiceId, usize)>) -> Error {
    let found = if tried.is_empty() { "no renderer is up" } else { "the renderer was lost" };
    Error::new(ErrorCode::RendererUnavailable, "nobody can draw this picture; the world goes on")
        .wanted(format_args!("a render service within {} s", RENDERER_WAIT.as_secs()))
        .found(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_take_turns_and_others_wait_until_they_have_least() {
        assert_eq!(least(&[], 3), None);
        assert_eq!([0, 1, 2, 3].map(|turn| least(&[5, 5, 5], turn)), [0, 1, 2, 0].map(Some));
        assert_eq!([0, 1, 2].map(|turn| least(&[9, 5, 5], turn)), [1, 1, 2].map(Some));
    }

    /// Pictures in a second of two renderers, one four times as fast as the other, for eight who
    /// each ask again as soon as they have theirs.
    fn drawn_in_a_second(choose: impl Fn(&[u64], usize) -> usize) -> u32 {
        let cost_micros = [2_000_u64, 8_000];
        let (mut waiting, mut free_at) = ([0_u64; 2], [0_u64; 2]);
        let mut asking: Vec<u64> = vec![0; 8];
        let mut ends: Vec<(u64, usize)> = Vec::new();
        let (mut drawn, mut turn) = (0, 0);
        for now in 0..1_000_000 {
            ends.retain(|(end, renderer)| {
                let is_over = *end <= now;
                if is_over {
                    waiting[*renderer] -= 1;
                    asking.push(now);
                    drawn += 1;
                }
                !is_over
            });
            while asking.pop().is_some() {
                let renderer = choose(&waiting, turn);
                turn += 1;
                waiting[renderer] += 1;
                free_at[renderer] = free_at[renderer].max(now) + cost_micros[renderer];
                ends.push((free_at[renderer], renderer));
            }
        }
        drawn
    }

    #[test]
    fn a_slow_renderer_holds_up_only_what_it_is_given() {
        let (fast_alone, both) = (500, 625);
        let in_turn = drawn_in_a_second(|waiting, turn| turn % waiting.len());
        let by_waiting = drawn_in_a_second(|waiting, turn| least(waiting, turn).unwrap());
        println!("of {both}: {in_turn} in turn, {by_waiting} by what is waited for");
        assert!(in_turn < fast_alone, "{in_turn}: in turn two are slower than the fast one alone");
        assert!(by_waiting > both * 95 / 100, "{by_waiting}");
    }
}
