//! Pictures of cameras that somebody listens to.

mod attributes;

pub(crate) use attributes::check_camera;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use schemas::limits::{CAMERAS_PER_JOB_MAX, LIMBS_MAX, PIXELS_PER_JOB_MAX};
use schemas::{
    ActorId, ActorKind, Camera, Frame, Image, ImageEncoding, ImageKind, Pose, SharedFrame, Staging,
    TagId,
};
use tokio::time::Instant;

use super::Endpoint;
use crate::allowance::Allowance;
use crate::episode::Episode;
use crate::pictures::{
    Film, LightEvent, Memory, Movement, Optics, Photo, Picture, Reaction, Shape, Sheet,
};
use crate::pictures::{encode_events, encode_flow, encode_picture, flow_of, sketch};
use crate::rpc::Refusal;
use crate::site::Site;
use crate::skeleton;
use crate::stream::{Hub, StreamId};
use attributes::camera;

/// How long the spawn of a camera waits for a renderer.
const RENDERER_WAIT: Duration = Duration::from_secs(3);
/// Between two looks whether one is up.
const RENDERER_POLL: Duration = Duration::from_millis(50);

/// A camera of which pictures were asked for.
struct Ordered {
    world_from_camera: Pose,
    /// In the frame before.
    world_from_camera_before: Pose,
    horizontal_fov_rad: f32,
    /// Of the picture of each kind among those of the request.
    images: Vec<(ImageKind, usize)>,
    /// What is made of them, and where it goes.
    outputs: Vec<Output>,
    optics: Optics,
}

struct Output {
    stream: StreamId,
    film: Film,
    /// Of a camera of events.
    reaction: Option<Reaction>,
}

/// All pictures of one frame.
struct Order {
    hub: Arc<Hub>,
    site: Arc<dyn Site>,
    allowance: Allowance,
    darkroom: Arc<Darkroom>,
    cameras: Vec<Ordered>,
    movement: Movement,
    shapes: Arc<Vec<Shape>>,
    frame_number: u64,
    sim_secs: f64,
    is_night: bool,
    waits: bool,
}

/// In the place of a picture that is being finished.
const NO_IMAGE: Image = Image {
    camera: 0,
    width_px: 0,
    height_px: 0,
    kind: ImageKind::Rgb,
    encoding: ImageEncoding::Rgba8,
    data: Vec::new(),
};

/// What cameras of events remember, by stream.
#[derive(Default)]
pub(crate) struct Darkroom {
    memories: Mutex<BTreeMap<StreamId, Memory>>,
}

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
        if due.is_empty() || busy || self.settings.no_rendering_mode {
            return;
        }
        if !self.site.can_draw() {
            // The world would wait for a renderer, and clients with it.
            tracing::debug!(port = self.port, "no renderer is up: cameras stay without pictures");
            return;
        }
        let Some(episode) = &self.episode else { return };
        let (mut cameras, mut wanted) = (Vec::new(), Vec::new());
        for id in due {
            if let Some(camera) = self.order_of(episode, id, before, &mut wanted) {
                cameras.push(camera);
            }
        }
        let moves_limbs = cameras.iter().any(Ordered::needs_flow);
        let order = Order {
            hub: Arc::clone(&self.hub),
            site: Arc::clone(&self.site),
            allowance: self.config.allowance.clone(),
            darkroom: Arc::clone(&self.darkroom),
            cameras,
            movement: movement(before, episode, moves_limbs),
            shapes: Arc::clone(&self.shapes),
            frame_number: self.frame_number,
            sim_secs: episode.frame.sim_secs,
            is_night: episode.frame.weather.sun_altitude_rad <= 0.0,
            waits: self.settings.synchronous_mode,
        };
        let drawing = order.deliver(episode.frame.clone(), wanted, self.staging(episode));
        self.pictures = Some(self.workers.spawn(drawing));
    }

    /// What one camera has to take, appended to what is wanted already; `None` for what is no
    /// camera, and when no more fit into one request.
    fn order_of(
        &self,
        episode: &Episode,
        id: ActorId,
        before: Option<&Frame>,
        wanted: &mut Vec<Camera>,
    ) -> Option<Ordered> {
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
            // Blur is left out before the pictures of a tick are too many for one request.
            let Camera { width_px, height_px, .. } =
                camera(actor, ImageKind::Rgb, 0, &state.world_from_actor).ok()?;
            let own_px = pixels([width_px, height_px]) * (kinds.len() + optics.needs().len());
            let all_px: usize =
                wanted.iter().map(|other| pixels([other.width_px, other.height_px])).sum();
            if all_px + own_px <= PIXELS_PER_JOB_MAX / 2 {
                kinds.extend(optics.needs());
            }
        }
        kinds.sort_by_key(|kind| *kind as u8);
        kinds.dedup();
        if wanted.len() + kinds.len() > CAMERAS_PER_JOB_MAX {
            return None;
        }
        let mut images = Vec::with_capacity(kinds.len());
        for kind in kinds {
            images.push((kind, wanted.len()));
            let camera = camera(actor, kind, wanted.len() as u32, &state.world_from_actor).ok()?;
            wanted.push(Camera { ignored: episode.ignored(id).to_vec(), ..camera });
        }
        Some(Ordered {
            world_from_camera: state.world_from_actor,
            world_from_camera_before: pose_in(before, id).unwrap_or(state.world_from_actor),
            horizontal_fov_rad: wanted.last()?.horizontal_fov_rad,
            images,
            outputs,
            optics,
        })
    }

    /// What a renderer has to know that no frame tells.
    fn staging(&self, episode: &Episode) -> Staging {
        let walkers = episode.custom_poses().iter();
        let limbs =
            walkers.filter_map(|(id, pose)| Some(skeleton::limbs(episode.state(*id)?, pose)));
        Staging {
            street_lights: self.lamps.unusual(self.is_night()),
            limbs: limbs.flatten().take(LIMBS_MAX).collect(),
        }
    }
}

fn pixels([width_px, height_px]: [u32; 2]) -> usize {
    width_px as usize * height_px as usize
}

impl Ordered {
    /// The place of the picture of a kind among those of the request.
    fn place_of(&self, kind: ImageKind) -> Option<usize> {
        self.images.iter().find(|(other, _)| *other == kind).map(|(_, at)| *at)
    }

    /// Whether something is made of how far everything moved.
    fn needs_flow(&self) -> bool {
        let is_flow = |output: &Output| output.film.kinds().len() > 1;
        self.optics.needs_flow() || self.outputs.iter().any(is_flow)
    }
}

impl Order {
    async fn deliver(self, frame: SharedFrame, wanted: Vec<Camera>, staging: Staging) {
        if !self.allowance.may_draw(&wanted, self.waits).await {
            return;
        }
        let mut images = match self.site.draw(frame, wanted, staging).await {
            Ok(images) => images,
            Err(error) => return tracing::warn!(%error, "cameras stay without pictures"),
        };
        for camera in &self.cameras {
            self.sketch(camera, &mut images);
            self.finish(camera, &mut images);
            for output in &camera.outputs {
                match self.develop(camera, output, &images) {
                    Developed::Payload(payload) => {
                        self.hub.publish(output.stream, payload, self.waits).await;
                    }
                    Developed::Nothing => {}
                    Developed::Damaged => {
                        tracing::warn!(film = ?output.film, "a picture of another size");
                    }
                }
            }
        }
    }

    /// Draws the shapes of clients into the colour picture of a camera.
    fn sketch(&self, camera: &Ordered, images: &mut [Image]) {
        if self.shapes.is_empty() {
            return;
        }
        let places = camera.place_of(ImageKind::Rgb).zip(camera.place_of(ImageKind::Depth));
        let Some((colour, depth)) = places else { return };
        let Ok([colour, depth]) = images.get_disjoint_mut([colour, depth]) else { return };
        let half_width_px = colour.width_px as f32 / 2.0;
        let mut sheet = Sheet {
            pixels: &mut colour.data,
            depths: &depth.data,
            width_px: colour.width_px,
            height_px: colour.height_px,
            focal_px: half_width_px / (camera.horizontal_fov_rad / 2.0).tan(),
        };
        sketch(&mut sheet, &camera.world_from_camera, &self.shapes);
    }

    /// Does to the pictures of a camera what its attributes ask for.
    fn finish(&self, camera: &Ordered, images: &mut [Image]) {
        let place = |kind| camera.place_of(kind);
        if let Some(colour) = place(ImageKind::Rgb) {
            let geometry = place(ImageKind::Depth).zip(place(ImageKind::Instance));
            let flow = geometry.filter(|_| camera.optics.needs_flow()).and_then(|(depth, ids)| {
                let pair = [images.get(depth)?, images.get(ids)?];
                let before = &camera.world_from_camera_before;
                Some(flow_of(&self.picture(camera), pair, before, &self.movement))
            });
            // The colours leave their place for a moment, so that the depth may be read.
            let taken = images.get_mut(colour).map(|image| std::mem::replace(image, NO_IMAGE));
            if let Some(mut image) = taken {
                let depths = place(ImageKind::Depth).and_then(|at| images.get(at));
                camera.optics.finish(&mut Photo {
                    image: &mut image,
                    depths,
                    flow: flow.as_deref(),
                    horizontal_fov_rad: camera.horizontal_fov_rad,
                    is_night: self.is_night,
                });
                images[colour] = image;
            }
        }
        // What moved is told of a picture that is not bent.
        let single = |output: &Output| match output.film.kinds() {
            [kind] => Some(*kind),
            _ => None,
        };
        let mut kinds: Vec<ImageKind> = camera.outputs.iter().filter_map(single).collect();
        kinds.sort_by_key(|kind| *kind as u8);
        kinds.dedup();
        for at in kinds.into_iter().filter_map(place) {
            if let Some(image) = images.get_mut(at) {
                camera.optics.bend(image);
            }
        }
    }

    fn picture<'a>(&self, camera: &'a Ordered) -> Picture<'a> {
        Picture {
            frame_number: self.frame_number,
            sim_secs: self.sim_secs,
            world_from_camera: &camera.world_from_camera,
            horizontal_fov_rad: camera.horizontal_fov_rad,
        }
    }

    fn develop(&self, camera: &Ordered, output: &Output, images: &[Image]) -> Developed {
        let picture = self.picture(camera);
        let image = |kind: &ImageKind| images.get(camera.place_of(*kind)?);
        let payload = match output.film.kinds() {
            [depth, ids] => image(depth).zip(image(ids)).and_then(|(depth, ids)| {
                let before = &camera.world_from_camera_before;
                encode_flow(&picture, output.film, [depth, ids], before, &self.movement)
            }),
            [kind, ..] if output.film == Film::Events => {
                let Some((image, reaction)) = image(kind).zip(output.reaction) else {
                    return Developed::Damaged;
                };
                let events = self.darkroom.look(output.stream, reaction, image, self.sim_secs);
                if events.is_empty() {
                    return Developed::Nothing;
                }
                Some(encode_events(&picture, image, &events))
            }
            [kind, ..] => {
                image(kind).and_then(|image| encode_picture(&picture, output.film, image))
            }
            [] => None,
        };
        payload.map_or(Developed::Damaged, Developed::Payload)
    }
}

/// What came of one output of a camera.
enum Developed {
    Payload(Vec<u8>),
    /// Nothing happened that it could tell.
    Nothing,
    /// The renderer sent something else than was asked for.
    Damaged,
}

impl Darkroom {
    fn look(
        &self,
        stream: StreamId,
        reaction: Reaction,
        image: &Image,
        sim_secs: f64,
    ) -> Vec<LightEvent> {
        // Nothing panics while it holds the lock.
        let mut memories = self.memories.lock().unwrap_or_else(PoisonError::into_inner);
        let memory = memories.entry(stream).or_default();
        memory.look(reaction, image.width_px, &image.data, sim_secs)
    }

    /// Forgets what a camera saw.
    pub(super) fn forget(&self, stream: StreamId) {
        self.memories.lock().unwrap_or_else(PoisonError::into_inner).remove(&stream);
    }
}

fn pose_in(frame: Option<&Frame>, id: ActorId) -> Option<Pose> {
    frame?.actor(id).map(|actor| actor.world_from_actor)
}

/// What moved since an earlier frame; limbs only where somebody wants to know.
fn movement(before: Option<&Frame>, episode: &Episode, moves_limbs: bool) -> Movement {
    let frame = &episode.frame;
    let moved = frame.actors.iter().filter_map(|actor| {
        let before = pose_in(before, actor.id).filter(|pose| *pose != actor.world_from_actor)?;
        Some((actor.id.get() % TagId::SCENERY, before * actor.world_from_actor.inverse()))
    });
    let is_walker = |actor: &&schemas::ActorState| actor.kind == ActorKind::Walker;
    let walkers = frame.actors.iter().filter(is_walker).filter(|_| moves_limbs);
    let limbs = walkers.filter_map(|walker| {
        let then = before?.actor(walker.id)?;
        let moved = skeleton::moved([then, walker], episode.custom_pose(walker.id));
        Some((walker.id.get() % TagId::SCENERY, moved))
    });
    Movement { before_from_now: moved.collect(), limbs: limbs.collect() }
}
