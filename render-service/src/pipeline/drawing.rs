//! One open device and everything on it; gone with the device.

use std::collections::VecDeque;

use schemas::ImageKind;

use crate::RenderError;
use crate::encode::{Pixels, encode};
use crate::strip::{Drawn, Strip};

use super::batch::{Batch, PlannedPicture, PlannedView};
use super::buffers::{FrameBuffers, ShapeLibrary};
use super::device::{AdapterChoice, Gpu};
use super::pass::{Shared, copy_out};
use super::pipelines::Pipelines;
use super::readback::{InFlight, RING, Ring};
use super::targets::Targets;
use super::towns::TownCache;

/// Samples per pixel on a GPU: smooth edges of lane lines and distant people.
const SAMPLE_COUNT: u32 = 4;
/// On a software adapter four samples make a 640 × 360 picture 2.5 times as dear.
const SAMPLE_COUNT_SOFTWARE: u32 = 1;

/// One open device and everything on it.
pub(crate) struct Drawing {
    pub(crate) gpu: Gpu,
    pipelines: Pipelines,
    shapes: ShapeLibrary,
    frame: FrameBuffers,
    towns: TownCache,
    targets: Targets,
    ring: Ring,
}

impl Drawing {
    /// # Errors
    /// [`RenderError::NoAdapter`], [`RenderError::NoDevice`].
    pub(crate) fn open(choice: &AdapterChoice) -> Result<Self, RenderError> {
        let gpu = Gpu::open(choice)?;
        let sample_count = if gpu.software { SAMPLE_COUNT_SOFTWARE } else { SAMPLE_COUNT };
        let pipelines = Pipelines::new(&gpu, sample_count);
        let drawing = Self {
            shapes: ShapeLibrary::new(&gpu),
            frame: FrameBuffers::new(&gpu, &pipelines.view_layout),
            towns: TownCache::default(),
            targets: Targets::new(sample_count),
            ring: Ring::default(),
            pipelines,
            gpu,
        };
        match drawing.gpu.fault() {
            None => Ok(drawing),
            Some(cause) => {
                Err(RenderError::NoDevice { adapter: drawing.gpu.adapter_name.clone(), cause })
            }
        }
    }

    /// Draws strips in as few submissions as fit, one drawn while the one before is encoded. Gives
    /// what came of each strip's cameras, in order.
    ///
    /// # Errors
    /// What happened to the device; it is of no use afterwards.
    pub(crate) fn draw(&mut self, strips: &[Strip<'_>]) -> Result<Vec<Drawn>, String> {
        let mut pictures = Vec::with_capacity(strips.len());
        let mut under_way = VecDeque::new();
        let mut rest = strips;
        while !rest.is_empty() {
            let batch = Batch::of(rest, self.gpu.software);
            rest = rest.get(batch.planned.len()..).unwrap_or_default();
            let flight = self.submit(&batch);
            under_way.push_back((flight, batch));
            if under_way.len() >= RING
                && let Some((flight, batch)) = under_way.pop_front()
            {
                pictures.extend(self.collect(flight, &batch)?);
            }
        }
        for (flight, batch) in under_way {
            pictures.extend(self.collect(flight, &batch)?);
        }
        Ok(pictures)
    }

    fn submit(&mut self, batch: &Batch<'_>) -> InFlight {
        let gpu = &self.gpu;
        self.frame.write(gpu, &batch.views, &batch.instances);
        let buffer = self.ring.take(gpu, batch.readback_bytes);
        let mut encoder =
            gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let shared =
            Shared { pipelines: &self.pipelines, shapes: &self.shapes, frame: &self.frame };
        for (number, planned) in batch.planned.iter().enumerate() {
            let town = self.towns.get(gpu, planned.strip.town);
            let camera = planned.strip.camera();
            let size_px = (camera.width_px, camera.height_px);
            if let Some(shadows) = &planned.shadows {
                let wanted = (shadows.side_px, planned.strip.shadows_of);
                let (map, is_drawn) = self.targets.shadow(gpu, &self.pipelines, wanted);
                let target = self.targets.picture(gpu, size_px);
                if !is_drawn {
                    shared.shadow_pass(&mut encoder, number, shadows, &town, &map);
                }
                shared.colour_pass(&mut encoder, number, planned, &town, (&map, target));
                copy_all(&mut encoder, planned, &buffer, |_| &target.result);
            } else {
                let target = self.targets.geometry(gpu, size_px);
                shared.geometry_pass(&mut encoder, number, planned, &town, target);
                let [depth, labels, normals] = &target.results;
                copy_all(&mut encoder, planned, &buffer, |kind| match kind {
                    ImageKind::Depth => depth,
                    ImageKind::Normals => normals,
                    ImageKind::Rgb | ImageKind::Semantic | ImageKind::Instance => labels,
                });
            }
        }
        InFlight::submit(gpu, encoder, buffer)
    }

    fn collect(&mut self, flight: InFlight, batch: &Batch<'_>) -> Result<Vec<Drawn>, String> {
        self.ring.finish(&self.gpu, flight, |bytes| encode_all(batch, bytes))
    }
}

/// Records the copies of all pictures of a view from what holds each kind.
fn copy_all<'t>(
    encoder: &mut wgpu::CommandEncoder,
    planned: &PlannedView<'_>,
    buffer: &wgpu::Buffer,
    result_of: impl Fn(ImageKind) -> &'t wgpu::Texture,
) {
    for picture in &planned.pictures {
        let result = result_of(picture.camera.kind);
        copy_out(encoder, (result, planned.strip.rows.start), buffer, picture);
    }
}

/// Encodes pictures on as many threads as there are processors and pictures, in the strips' order.
fn encode_all(batch: &Batch<'_>, bytes: &[u8]) -> Vec<Drawn> {
    let pictures: Vec<PlannedPicture<'_>> =
        batch.planned.iter().flat_map(|planned| planned.pictures.iter().copied()).collect();
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let per_thread = pictures.len().div_ceil(processors).max(1);
    let take_some = |pictures: &[PlannedPicture<'_>]| -> Vec<Drawn> {
        pictures.iter().map(|picture| take_one(picture, bytes)).collect()
    };
    if pictures.len() == 1 {
        return take_some(&pictures);
    }
    std::thread::scope(|scope| {
        let threads: Vec<_> =
            pictures.chunks(per_thread).map(|some| scope.spawn(move || take_some(some))).collect();
        let joined =
            threads.into_iter().map(|thread| thread.join().expect("encoding does not panic"));
        joined.flatten().collect()
    })
}

fn take_one(picture: &PlannedPicture<'_>, bytes: &[u8]) -> Drawn {
    let row_pitch_bytes = picture.row_pitch_bytes as usize;
    let start = picture.offset_bytes as usize;
    let end = start + row_pitch_bytes * picture.row_count as usize;
    let bytes = bytes.get(start..end).unwrap_or_default();
    if picture.is_whole {
        Drawn::Picture(encode(picture.camera, &Pixels { bytes, row_pitch_bytes }))
    } else {
        Drawn::Rows(bytes.to_vec())
    }
}
