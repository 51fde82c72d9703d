//! Pictures on their way from a renderer to the streams of cameras.

mod parts;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use schemas::{Camera, Image, ImageEncoding, ImageKind, Pose, SharedFrame, Staging};

use crate::allowance::Allowance;
use crate::pictures::{
    Film, LightEvent, Memory, Movement, Optics, Photo, Picture, Reaction, Shape, Sheet,
};
use crate::pictures::{encode_events, encode_flow, encode_picture, flow_of, sketch};
use crate::site::Site;
use crate::stream::{Hub, StreamId};

/// A camera of which pictures were asked for.
pub(super) struct Ordered {
    pub(super) world_from_camera: Pose,
    /// In the frame before.
    pub(super) world_from_camera_before: Pose,
    pub(super) horizontal_fov_rad: f32,
    /// The pictures that it needs, each of another kind.
    pub(super) wanted: Vec<Camera>,
    /// What is made of them, and where it goes.
    pub(super) outputs: Vec<Output>,
    pub(super) optics: Optics,
}

pub(super) struct Output {
    pub(super) stream: StreamId,
    pub(super) film: Film,
    /// Of a camera of events.
    pub(super) reaction: Option<Reaction>,
}

/// All pictures of one frame.
pub(super) struct Order {
    pub(super) hub: Arc<Hub>,
    pub(super) site: Arc<dyn Site>,
    pub(super) allowance: Allowance,
    pub(super) event_memories: Arc<EventMemories>,
    pub(super) cameras: Vec<Ordered>,
    pub(super) movement: Movement,
    pub(super) shapes: Arc<Vec<Shape>>,
    pub(super) frame_number: u64,
    pub(super) sim_secs: f64,
    pub(super) is_night: bool,
    pub(super) waits: bool,
}

/// Pictures of some of the cameras; `None` for those that cannot have all of theirs.
struct Drawn {
    part: Range<usize>,
    images: Vec<Option<Vec<Image>>>,
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
pub(crate) struct EventMemories {
    memories: Mutex<BTreeMap<StreamId, Memory>>,
}

impl Ordered {
    /// The place of the picture of a kind among those that it needs.
    fn place_of(&self, kind: ImageKind) -> Option<usize> {
        self.wanted.iter().position(|camera| camera.kind == kind)
    }

    /// Whether something is made of how far everything moved.
    pub(super) fn needs_flow(&self) -> bool {
        let is_flow = |output: &Output| output.film.kinds().len() > 1;
        self.optics.needs_flow() || self.outputs.iter().any(is_flow)
    }
}

impl Order {
    /// Has the pictures drawn and sends what cameras make of them: a job's worth at a time, of
    /// which the next is drawn while the last is developed. An endpoint has one order at a time, so
    /// as many threads at most as endpoints are busy with that.
    pub(super) async fn deliver(self, frame: SharedFrame, staging: Staging) {
        let wanted = self.cameras.iter().flat_map(|camera| &camera.wanted);
        if !self.allowance.may_draw(wanted, self.waits).await {
            return;
        }
        let order = Arc::new(self);
        let mut drawn: Option<Drawn> = None;
        for part in parts::parts_of(&order.cameras) {
            let drawing = order.draw(part, &frame, &staging);
            let (next, ()) = tokio::join!(drawing, Arc::clone(&order).develop_all(drawn.take()));
            if next.is_none() {
                return;
            }
            drawn = next;
        }
        order.develop_all(drawn).await;
    }

    /// Has the pictures of some cameras drawn; `None` if nobody can draw.
    async fn draw(
        &self,
        part: Range<usize>,
        frame: &SharedFrame,
        staging: &Staging,
    ) -> Option<Drawn> {
        let cameras = &self.cameras[part.clone()];
        let mut left = parts::jobs_of(cameras);
        let mut images = Vec::new();
        while let Some(mut job) = left.pop() {
            let cameras = job.clone();
            match self.site.draw(frame.clone(), cameras, staging.clone()).await {
                Ok(drawn) if drawn.len() == job.len() => images.extend(drawn.into_iter().map(Some)),
                Ok(drawn) => {
                    let (found, wanted) = (drawn.len(), job.len());
                    tracing::warn!(found, wanted, "the renderer sent another count of pictures");
                    images.extend(job.iter().map(|_| None));
                }
                Err(error) if parts::is_for_all(&error) => {
                    tracing::warn!(%error, "cameras stay without pictures");
                    return None;
                }
                // One that cannot be drawn must not keep the others from coming.
                Err(_) if job.len() > 1 => {
                    let second = job.split_off(job.len() / 2);
                    left.extend([second, job]);
                }
                Err(error) => {
                    tracing::warn!(%error, "a camera stays without its picture");
                    images.push(None);
                }
            }
        }
        let mut images = images.into_iter();
        let mut of_camera = |camera: &Ordered| {
            let own: Vec<Option<Image>> = images.by_ref().take(camera.wanted.len()).collect();
            own.into_iter().collect()
        };
        Some(Drawn { images: cameras.iter().map(&mut of_camera).collect(), part })
    }

    /// Sends what cameras make of their pictures, one after the other.
    async fn develop_all(self: Arc<Self>, drawn: Option<Drawn>) {
        let Some(Drawn { part, images }) = drawn else { return };
        for (index, images) in part.zip(images) {
            let Some(mut images) = images else { continue };
            // What is done to a large picture may take seconds, which no other client waits for.
            let own = Arc::clone(&self);
            let developing =
                tokio::task::spawn_blocking(move || own.payloads(&own.cameras[index], &mut images));
            let payloads = match developing.await {
                Ok(payloads) => payloads,
                Err(error) => {
                    tracing::error!(%error, "pictures of one camera were not sent");
                    continue;
                }
            };
            for (stream, payload) in payloads {
                self.hub.publish(stream, payload, self.waits).await;
            }
        }
    }

    /// What one camera sends to its streams.
    fn payloads(&self, camera: &Ordered, images: &mut [Image]) -> Vec<(StreamId, Vec<u8>)> {
        self.sketch(camera, images);
        self.finish(camera, images);
        let mut payloads = Vec::with_capacity(camera.outputs.len());
        for output in &camera.outputs {
            match self.develop(camera, output, images) {
                Developed::Payload(payload) => payloads.push((output.stream, payload)),
                Developed::Nothing => {}
                Developed::Damaged => {
                    tracing::warn!(film = ?output.film, "a picture of another size");
                }
            }
        }
        payloads
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
                let events =
                    self.event_memories.look(output.stream, reaction, image, self.sim_secs);
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

impl EventMemories {
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
    pub(in crate::endpoint) fn forget(&self, stream: StreamId) {
        self.memories.lock().unwrap_or_else(PoisonError::into_inner).remove(&stream);
    }
}

#[cfg(test)]
mod tests;
