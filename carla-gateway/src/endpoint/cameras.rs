//! Pictures of cameras that somebody listens to.

mod attributes;
mod order;

pub(crate) use attributes::check_camera;
pub(crate) use order::EventMemories;

use std::sync::Arc;
use std::time::Duration;

use schemas::{ActorId, ActorKind, Camera, Frame, ImageKind, Pose, Staging, TagId};
use tokio::time::Instant;

use super::Endpoint;
use crate::episode::Episode;
use crate::pictures::{Film, Movement, Optics, Reaction};
use crate::rpc::Refusal;
use crate::skeleton;
use attributes::camera;
use order::{Order, Ordered, Output};

/// How long the spawn of a camera waits for a renderer.
const RENDERER_WAIT: Duration = Duration::from_secs(3);
/// Between two looks whether one is up.
const RENDERER_POLL: Duration = Duration::from_millis(50);

impl Endpoint {
    /// Waits a moment for a renderer that is still starting.
    ///
    /// # Errors
    /// None came.
    pub(crate) async fn need_renderer(&self) -> Result<(), Refusal> {
        let until = Instant::now() + RENDERER_WAIT;
        while !self.site.can_draw() {
            if Instant::now() >= until {
                return Err(Refusal("no renderer is up: cameras cannot be drawn".to_owned()));
            }
            tokio::time::sleep(RENDERER_POLL).await;
        }
        Ok(())
    }

    /// In synchronous mode, waits until the pictures of the last frame were taken.
    pub(super) async fn await_pictures(&mut self) {
        if self.settings.synchronous_mode
            && let Some(pictures) = self.pictures.take()
            && let Err(error) = pictures.await
        {
            tracing::error!(%error, "pictures were not sent");
        }
    }

    /// Has the pictures that are due taken, beside everything else. In asynchronous mode a frame is
    /// left out while those of an earlier one are still being drawn.
    pub(super) fn take_pictures(&mut self, due: Vec<ActorId>, before: Option<&Frame>) {
        let busy = self.pictures.as_ref().is_some_and(|pictures| !pictures.is_finished());
        if due.is_empty() || busy {
            return;
        }
        if !self.site.can_draw() {
            // The world would wait for a renderer, and clients with it.
            tracing::debug!(port = self.port, "no renderer is up: cameras stay without pictures");
            return;
        }
        let Some(episode) = &self.episode else { return };
        let cameras: Vec<Ordered> =
            due.into_iter().filter_map(|id| self.order_of(episode, id, before)).collect();
        let moves_limbs = cameras.iter().any(Ordered::needs_flow);
        let staging = Staging { street_lights: self.lamps.unusual(self.is_night()) };
        let order = Order {
            hub: Arc::clone(&self.hub),
            site: Arc::clone(&self.site),
            allowance: self.config.allowance.clone(),
            event_memories: Arc::clone(&self.event_memories),
            cameras,
            movement: movement(before, &episode.frame, moves_limbs),
            shapes: Arc::clone(&self.shapes),
            frame_number: self.frame_number,
            sim_secs: episode.frame.sim_secs,
            is_night: episode.frame.weather.sun_altitude_rad <= 0.0,
            waits: self.settings.synchronous_mode,
        };
        let drawing = order.deliver(episode.frame.clone(), staging);
        self.pictures = Some(self.workers.spawn(drawing));
    }

    /// What one camera has to take; `None` for what is no camera.
    fn order_of(&self, episode: &Episode, id: ActorId, before: Option<&Frame>) -> Option<Ordered> {
        let (actor, state) = (episode.actor(id)?, episode.state(id)?);
        let own = (episode.stream(id)?, Film::of(&actor.description.type_id)?);
        let textures =
            episode.textures(id).filter(|(stream, _)| self.hub.listener_count(*stream) > 0);
        let reaction = Reaction::of(actor).ok();
        let output = |(stream, film)| Output { stream, film, reaction };
        let outputs: Vec<Output> = std::iter::once(own).chain(textures).map(output).collect();
        let mut kinds: Vec<ImageKind> =
            outputs.iter().flat_map(|output| output.film.kinds()).copied().collect();
        let optics = Optics::of(actor).ok()?;
        if kinds.contains(&ImageKind::Rgb) {
            kinds.extend((!self.shapes.is_empty()).then_some(ImageKind::Depth));
            kinds.extend(optics.needs());
        }
        kinds.sort_by_key(|kind| *kind as u8);
        kinds.dedup();
        let mut wanted = Vec::with_capacity(kinds.len());
        for kind in kinds {
            let camera = camera(actor, kind, 0, &state.world_from_actor).ok()?;
            wanted.push(Camera { ignored: episode.ignored(id).to_vec(), ..camera });
        }
        Some(Ordered {
            world_from_camera: state.world_from_actor,
            world_from_camera_before: pose_in(before, id).unwrap_or(state.world_from_actor),
            horizontal_fov_rad: wanted.first()?.horizontal_fov_rad,
            wanted,
            outputs,
            optics,
        })
    }
}

fn pose_in(frame: Option<&Frame>, id: ActorId) -> Option<Pose> {
    frame?.actor(id).map(|actor| actor.world_from_actor)
}

/// What moved since an earlier frame; limbs only where somebody wants to know.
fn movement<'a>(before: Option<&'a Frame>, frame: &'a Frame, moves_limbs: bool) -> Movement {
    let moved = frame.actors.iter().filter_map(|actor| {
        let before = pose_in(before, actor.id).filter(|pose| *pose != actor.world_from_actor)?;
        Some((actor.id.get() % TagId::SCENERY, before * actor.world_from_actor.inverse()))
    });
    let is_walker = |actor: &&schemas::ActorState| actor.kind == ActorKind::Walker;
    let walkers = frame.actors.iter().filter(is_walker).filter(|_| moves_limbs);
    let limbs = walkers.filter_map(|walker| {
        let then = before?.actor(walker.id)?;
        let pose_in = |frame: &'a Frame| frame.walker_pose(walker.id);
        let moved = skeleton::moved([(then, pose_in(before?)), (walker, pose_in(frame))]);
        Some((walker.id.get() % TagId::SCENERY, moved))
    });
    Movement { before_from_now: moved.collect(), limbs: limbs.collect() }
}
