//! Pictures of cameras that somebody listens to.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use schemas::limits::{CAMERAS_PER_JOB_MAX, FIELD_OF_VIEW_DEG_MAX, IMAGE_SIDE_PX_MAX};
use schemas::{ActorId, Camera, Frame, Image, ImageKind, Pose, SharedFrame, TagId};
use tokio::time::Instant;

use super::Endpoint;
use crate::dialect::Actor;
use crate::episode::Episode;
use crate::pictures::{Film, LightEvent, Memory, Movement, Picture, Reaction, Shape, Sheet};
use crate::pictures::{encode_events, encode_flow, encode_picture, encoding_of, sketch};
use crate::rpc::Refusal;
use crate::site::Site;
use crate::stream::{Hub, StreamId};

/// How long the spawn of a camera waits for a renderer.
const RENDERER_WAIT: Duration = Duration::from_secs(3);
/// Between two looks whether one is up.
const RENDERER_POLL: Duration = Duration::from_millis(50);
/// JPEG is never asked for, but the field needs a value in range.
const JPEG_QUALITY: u8 = 90;

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
    darkroom: Arc<Darkroom>,
    cameras: Vec<Ordered>,
    movement: Movement,
    shapes: Arc<Vec<Shape>>,
    frame_number: u64,
    sim_secs: f64,
    waits: bool,
}

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
        let order = Order {
            hub: Arc::clone(&self.hub),
            site: Arc::clone(&self.site),
            darkroom: Arc::clone(&self.darkroom),
            cameras,
            movement: movement(before, &episode.frame),
            shapes: Arc::clone(&self.shapes),
            frame_number: self.frame_number,
            sim_secs: episode.frame.sim_secs,
            waits: self.settings.synchronous_mode,
        };
        let drawing = order.deliver(episode.frame.clone(), wanted);
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
        if kinds.contains(&ImageKind::Rgb) && !self.shapes.is_empty() {
            kinds.push(ImageKind::Depth);
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
        })
    }
}

impl Order {
    async fn deliver(self, frame: SharedFrame, wanted: Vec<Camera>) {
        let mut images = match self.site.draw(frame, wanted).await {
            Ok(images) => images,
            Err(error) => return tracing::warn!(%error, "cameras stay without pictures"),
        };
        for camera in &self.cameras {
            self.sketch(camera, &mut images);
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
        let of = |kind| camera.images.iter().find(|(other, _)| *other == kind).map(|(_, at)| *at);
        let Some((colour, depth)) = of(ImageKind::Rgb).zip(of(ImageKind::Depth)) else { return };
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

    fn develop(&self, camera: &Ordered, output: &Output, images: &[Image]) -> Developed {
        let picture = Picture {
            frame_number: self.frame_number,
            sim_secs: self.sim_secs,
            world_from_camera: &camera.world_from_camera,
            horizontal_fov_rad: camera.horizontal_fov_rad,
        };
        let image = |kind: &ImageKind| {
            let (_, at) = camera.images.iter().find(|(other, _)| other == kind)?;
            images.get(*at)
        };
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

/// What moved since an earlier frame.
fn movement(before: Option<&Frame>, frame: &Frame) -> Movement {
    let moved = frame.actors.iter().filter_map(|actor| {
        let before = pose_in(before, actor.id).filter(|pose| *pose != actor.world_from_actor)?;
        Some((actor.id.get() % TagId::SCENERY, before * actor.world_from_actor.inverse()))
    });
    Movement { before_from_now: moved.collect() }
}

/// The camera that an actor's attributes ask for, with pictures of one kind.
///
/// # Errors
/// What cannot be drawn, in words for whoever spawns it.
pub(crate) fn camera(
    actor: &Actor,
    kind: ImageKind,
    id: u32,
    world_from_camera: &Pose,
) -> Result<Camera, Refusal> {
    let side = |id, default| {
        let pixels = actor.number(id, default)?;
        if (1.0..=IMAGE_SIDE_PX_MAX as f32).contains(&pixels) {
            return Ok(pixels as u32);
        }
        Err(Refusal(format!("{id} must be 1 to {IMAGE_SIDE_PX_MAX}, not {pixels}")))
    };
    let fov_deg = actor.number("fov", 90.0)?;
    if !(fov_deg > 0.0 && fov_deg <= FIELD_OF_VIEW_DEG_MAX) {
        return Err(Refusal(format!(
            "fov must be above 0, at most {FIELD_OF_VIEW_DEG_MAX}, not {fov_deg}"
        )));
    }
    Ok(Camera {
        id,
        carrier: None,
        carrier_from_camera: *world_from_camera,
        width_px: side("image_size_x", 800.0)?,
        height_px: side("image_size_y", 600.0)?,
        horizontal_fov_rad: fov_deg.to_radians(),
        kind,
        encoding: encoding_of(kind),
        jpeg_quality: JPEG_QUALITY,
        ignored: Vec::new(),
    })
}

/// Whether a camera can be as its attributes ask for.
///
/// # Errors
/// As for [`camera`].
pub(crate) fn check_camera(actor: &Actor) -> Result<(), Refusal> {
    let blueprint = &actor.description.type_id;
    let film = Film::of(blueprint)
        .ok_or_else(|| Refusal(format!("{blueprint} cannot be drawn by this server")))?;
    if film == Film::Events {
        Reaction::of(actor)?;
    }
    film.kinds().iter().try_for_each(|kind| camera(actor, *kind, 0, &Pose::identity()).map(drop))
}
