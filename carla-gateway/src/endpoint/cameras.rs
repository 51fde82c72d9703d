//! Pictures of cameras that somebody listens to.

use std::sync::Arc;
use std::time::Duration;

use schemas::limits::{CAMERAS_PER_JOB_MAX, FIELD_OF_VIEW_DEG_MAX, IMAGE_SIDE_PX_MAX};
use schemas::{ActorId, Camera, Pose, Reply, Request, Tick};
use tokio::time::Instant;

use super::Endpoint;
use crate::dialect::Actor;
use crate::pictures::{Picture, encode_picture, encoding_of, image_kind};
use crate::rpc::Refusal;
use crate::site::Site;
use crate::stream::Hub;

/// How long the spawn of a camera waits for a renderer.
const RENDERER_WAIT: Duration = Duration::from_secs(3);
/// Between two looks whether one is up.
const RENDERER_POLL: Duration = Duration::from_millis(50);
/// JPEG is never asked for, but the field needs a value in range.
const JPEG_QUALITY: u8 = 90;

/// A picture that was asked for, and where it goes.
struct Ordered {
    stream: u32,
    blueprint: String,
    world_from_camera: Pose,
    horizontal_fov_rad: f32,
}

/// All pictures of one frame.
struct Order {
    hub: Arc<Hub>,
    site: Arc<dyn Site>,
    request: Request,
    cameras: Vec<Ordered>,
    tick: Tick,
    frame_number: u64,
    sim_secs: f64,
    waits: bool,
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
    pub(super) fn take_pictures(&mut self, due: Vec<ActorId>) {
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
        let (mut cameras, mut wanted) = (Vec::new(), Vec::new());
        for id in due.into_iter().take(CAMERAS_PER_JOB_MAX) {
            let (Some(actor), Some(state)) = (episode.actor(id.get()), episode.state(id.get()))
            else {
                continue;
            };
            let Some(stream) = episode.stream(id.get()) else { continue };
            let Ok(camera) = camera(actor, wanted.len() as u32, &state.world_from_actor) else {
                continue;
            };
            cameras.push(Ordered {
                stream,
                blueprint: actor.description.type_id.clone(),
                world_from_camera: state.world_from_actor,
                horizontal_fov_rad: camera.horizontal_fov_rad,
            });
            wanted.push(camera);
        }
        let order = Order {
            hub: Arc::clone(&self.hub),
            site: Arc::clone(&self.site),
            request: Request::Capture { world: episode.world, cameras: wanted },
            cameras,
            tick: episode.frame.tick,
            frame_number: self.frame_number,
            sim_secs: episode.frame.sim_secs,
            waits: self.settings.synchronous_mode,
        };
        self.pictures = Some(tokio::spawn(order.deliver()));
    }
}

impl Order {
    async fn deliver(self) {
        let images = match self.site.ask(self.request).await {
            Ok(Reply::Images(images)) => images,
            Ok(_) => return tracing::warn!("the world service answered no pictures"),
            Err(error) => return tracing::warn!(%error, "cameras stay without pictures"),
        };
        if images.tick != self.tick {
            tracing::debug!(wanted = %self.tick, found = %images.tick, "pictures of a later tick");
        }
        for (camera, image) in self.cameras.iter().zip(images.images) {
            let picture = Picture {
                frame_number: self.frame_number,
                sim_secs: self.sim_secs,
                world_from_camera: &camera.world_from_camera,
                horizontal_fov_rad: camera.horizontal_fov_rad,
            };
            match encode_picture(&picture, &image) {
                Some(payload) => self.hub.publish(camera.stream, payload, self.waits).await,
                None => tracing::warn!(camera = camera.blueprint, "a picture of another size"),
            }
        }
    }
}

/// The camera that an actor's attributes ask for.
///
/// # Errors
/// What cannot be drawn, in words for whoever spawns it.
pub(crate) fn camera(actor: &Actor, id: u32, world_from_camera: &Pose) -> Result<Camera, Refusal> {
    let blueprint = &actor.description.type_id;
    let kind = image_kind(blueprint)
        .ok_or_else(|| Refusal(format!("{blueprint} cannot be drawn by this server")))?;
    let number = |id: &str, default: f32| {
        let given = actor.description.attributes.iter().find(|attribute| attribute.id == id);
        given.map_or(Ok(default), |attribute| {
            let refusal = || Refusal(format!("{id} cannot be {:?}", attribute.value));
            attribute.value.parse::<f32>().map_err(|_| refusal())
        })
    };
    let side = |id, default| {
        let pixels = number(id, default)?;
        if (1.0..=IMAGE_SIDE_PX_MAX as f32).contains(&pixels) {
            return Ok(pixels as u32);
        }
        Err(Refusal(format!("{id} must be 1 to {IMAGE_SIDE_PX_MAX}, not {pixels}")))
    };
    let fov_deg = number("fov", 90.0)?;
    if !(fov_deg > 0.0 && fov_deg <= FIELD_OF_VIEW_DEG_MAX) {
        return Err(Refusal(format!("fov must be 0 to {FIELD_OF_VIEW_DEG_MAX}, not {fov_deg}")));
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
    })
}
