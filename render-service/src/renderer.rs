//! Jobs in, pictures out.

use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use schemas::{Error, Images, PictureQuality, RenderJob};

use crate::RenderError;
use crate::cpu::CpuDrawing;
use crate::gpu::adapter::{AdapterChoice, one_at_a_time};
use crate::gpu::drawing::Drawing;
use crate::gpu::room::Room;
use crate::parallel::{in_parallel, threads};
use crate::scene::coat::Textures;
use crate::scene::town::TownScene;
use crate::sliced::{Portion, SlicedJob};
use crate::strip::{Drawn, Strip};

/// Devices that may be lost in a row before the jobs are given up.
const LOSSES_MAX: u32 = 3;

/// So many jobs are worth several threads before they are drawn and after.
const MANY_JOBS: usize = 64;

/// A job and the town it takes place in.
pub type TownJob<'a> = (Arc<TownScene>, &'a RenderJob);

/// Draws. Keeps nothing between jobs but caches.
///
/// **Determinism:** equal jobs give equal bytes on one adapter, whatever is drawn beside them.
pub struct Renderer {
    choice: AdapterChoice,
    /// Of a GPU's memory; less than the whole once there was not enough.
    room: Room,
    adapter_name: String,
    is_software: bool,
    backend: Backend,
    /// Beside a device, once there was something that it does not draw.
    processors: Option<CpuDrawing>,
    /// Of cameras that do not say theirs.
    quality: PictureQuality,
}

/// What draws.
#[allow(clippy::large_enum_variant, reason = "there is one of them in a process")]
enum Backend {
    /// Our own rasteriser.
    Cpu(CpuDrawing),
    /// A Vulkan device; `None` after a loss, until it is opened anew.
    Device(Option<Drawing>),
}

impl Backend {
    fn open(choice: &AdapterChoice, room: Room) -> Result<Self, RenderError> {
        if *choice == AdapterChoice::Software {
            return Ok(Self::Cpu(CpuDrawing::new()));
        }
        match Drawing::open(choice, room) {
            Ok(drawing) => Ok(Self::Device(Some(drawing))),
            Err(error) if *choice == AdapterChoice::Best => {
                if !matches!(error, RenderError::NoAdapter { .. }) {
                    tracing::warn!(%error, "the GPU does not draw; processors do");
                }
                Ok(Self::Cpu(CpuDrawing::new()))
            }
            Err(error) => Err(error),
        }
    }

    /// Closes the device, if there is one.
    fn close(&mut self) {
        if let Self::Device(drawing) = self {
            let _one = one_at_a_time();
            *drawing = None;
        }
    }
}

impl Drop for Backend {
    fn drop(&mut self) {
        self.close();
    }
}

impl Renderer {
    /// Opens an adapter and compiles everything.
    ///
    /// **Cost:** 80 to 400 ms.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] when none fits the choice, [`RenderError::NoDevice`] when it does
    /// not open.
    pub fn new(choice: AdapterChoice) -> Result<Self, RenderError> {
        Self::within(choice, Room::WHOLE)
    }

    /// As [`Self::new`], with so much room on a GPU.
    fn within(choice: AdapterChoice, room: Room) -> Result<Self, RenderError> {
        let backend = Backend::open(&choice, room)?;
        let (adapter_name, is_software) = match &backend {
            Backend::Cpu(drawing) => (drawing.description(), true),
            Backend::Device(drawing) => drawing.as_ref().map_or_else(Default::default, |drawing| {
                (drawing.gpu.description(), drawing.gpu.software)
            }),
        };
        let quality = PictureQuality::High;
        Ok(Self { choice, room, adapter_name, is_software, backend, processors: None, quality })
    }

    /// With another quality for cameras that do not say theirs than the high one.
    pub fn with_quality(self, quality: PictureQuality) -> Self {
        Self { quality, ..self }
    }

    /// What draws, e.g. `causeway-raster 1 (AVX2), software`.
    pub fn adapter_name(&self) -> &str {
        &self.adapter_name
    }

    /// What the kernels of the device took since it was opened, by name; empty if it does not tell.
    pub fn kernel_times(&self) -> Vec<(&'static str, Duration)> {
        let times = match &self.backend {
            Backend::Device(Some(drawing)) => drawing.kernel_times(),
            Backend::Device(None) | Backend::Cpu(_) => None,
        };
        times.into_iter().flatten().collect()
    }

    /// Whether processors draw.
    pub fn is_software(&self) -> bool {
        self.is_software
    }

    /// Draws all cameras of all jobs, in as few submissions as fit. Results are in the order of the
    /// jobs; one wrong job does not touch the others. A lost device is rebuilt and all is drawn
    /// again, by processors if it does not come back and the choice leaves them.
    ///
    /// # Errors
    /// Per job: [`InvalidArgument`](schemas::ErrorCode::InvalidArgument) or
    /// [`UnknownActor`](schemas::ErrorCode::UnknownActor) for a camera that cannot be,
    /// [`TooLarge`](schemas::ErrorCode::TooLarge),
    /// [`UnknownMap`](schemas::ErrorCode::UnknownMap) for another town than the frame's,
    /// [`RendererUnavailable`](schemas::ErrorCode::RendererUnavailable) when the device is lost
    /// for good.
    pub fn render(&mut self, jobs: &[TownJob<'_>]) -> Vec<Result<Images, Error>> {
        self.render_painted(jobs, &Textures::default())
    }

    /// As [`Self::render`]; things of towns show these textures where the jobs' frames say so.
    ///
    /// # Errors
    /// As for [`Self::render`].
    pub fn render_painted(
        &mut self,
        jobs: &[TownJob<'_>],
        textures: &Textures,
    ) -> Vec<Result<Images, Error>> {
        // One job takes some microseconds before it is drawn and after: many are shared out.
        let mut threads = vec![(); if jobs.len() < MANY_JOBS { 1 } else { threads() }];
        let mut sliced: Vec<Result<SlicedJob<&RenderJob>, Error>> =
            in_parallel(&mut threads, jobs.iter().collect(), |(), (town, job)| {
                SlicedJob::new(Arc::clone(town), *job, textures)
            });
        let whole = sliced.iter_mut().flatten().map(|job| {
            let rest = job.rest();
            (job, rest)
        });
        let drawn = self.draw_portions(whole.collect()).map_err(Error::from);
        in_parallel(&mut threads, sliced, |(), job| drawn.clone().and(job)?.finish())
    }

    /// Draws portions of jobs, each the next of its job, in as few submissions as fit. The bytes of
    /// a picture are the same in however many portions it is drawn.
    ///
    /// # Errors
    /// [`RenderError`] when the device is lost for good; no job has got further then.
    pub(crate) fn draw_portions<J: Deref<Target = RenderJob>>(
        &mut self,
        portions: Vec<(&mut SlicedJob<J>, Portion)>,
    ) -> Result<(), RenderError> {
        let strips: Vec<Strip<'_>> =
            portions.iter().flat_map(|(job, portion)| job.strips(portion)).collect();
        let mut drawn = self.draw(&strips)?.into_iter();
        drop(strips);
        for (job, portion) in portions {
            job.take(&portion, &mut drawn);
        }
        Ok(())
    }

    /// Draws strips and gives what came of each one's cameras, in order. Colours of textures are
    /// drawn by processors, whatever draws the rest.
    fn draw(&mut self, strips: &[Strip<'_>]) -> Result<Vec<Drawn>, RenderError> {
        let is_coated = |strip: &&Strip<'_>| !strip.coats.is_empty() && strip.has_colour();
        if matches!(self.backend, Backend::Cpu(_)) || !strips.iter().any(|it| is_coated(&it)) {
            return self.draw_alike(strips);
        }
        let plain: Vec<Strip<'_>> = strips.iter().filter(|it| !is_coated(it)).cloned().collect();
        let coated: Vec<Strip<'_>> = strips.iter().filter(is_coated).cloned().collect();
        let mut plain = self.draw_alike(&plain)?.into_iter();
        let processors = self.processors.get_or_insert_with(CpuDrawing::new);
        let mut coated = processors.draw(&coated, self.quality).into_iter();
        let mut drawn = Vec::new();
        for strip in strips {
            let from = if is_coated(&strip) { &mut coated } else { &mut plain };
            drawn.extend(from.take(strip.cameras.len()));
        }
        Ok(drawn)
    }

    /// Draws strips by one back end.
    fn draw_alike(&mut self, strips: &[Strip<'_>]) -> Result<Vec<Drawn>, RenderError> {
        let mut losses = 0;
        loop {
            if matches!(self.backend, Backend::Device(None)) {
                // A GPU that does not come back leaves the processors, if they may draw.
                *self = Self::within(self.choice.clone(), self.room)?.with_quality(self.quality);
                tracing::warn!(adapter = self.adapter_name, "pictures are drawn by this adapter");
            }
            let drawing = match &mut self.backend {
                Backend::Cpu(drawing) => return Ok(drawing.draw(strips, self.quality)),
                Backend::Device(Some(drawing)) => drawing,
                Backend::Device(None) => continue,
            };
            let cause = match drawing.draw(strips, self.quality) {
                Ok(drawn) => return Ok(drawn),
                Err(fault) => fault,
            };
            let lacks_memory = drawing.gpu.lacks_memory();
            self.backend.close();
            match self.room.halved().filter(|_| lacks_memory) {
                Some(half) => self.take_less(half, &cause),
                None => {
                    let adapter = &self.adapter_name;
                    tracing::warn!(adapter, cause, "the device was lost; opening it anew");
                    losses += 1;
                    if losses == LOSSES_MAX && lacks_memory && self.choice == AdapterChoice::Best {
                        self.choice = AdapterChoice::Software;
                    } else if losses == LOSSES_MAX {
                        return Err(RenderError::DeviceLost { times: losses, cause });
                    }
                }
            }
        }
    }

    /// Uses less of the device's memory from here on.
    fn take_less(&mut self, half: Room, cause: &str) {
        self.room = half;
        tracing::warn!(
            adapter = self.adapter_name,
            cause,
            room = ?half,
            "the device has too little memory; it is opened anew and less of it is used"
        );
    }
}

#[cfg(test)]
mod tests;
