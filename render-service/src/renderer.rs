//! Jobs in, pictures out.

use std::sync::Arc;

use schemas::limits::{CAMERAS_PER_JOB_MAX, PIXELS_PER_JOB_MAX};
use schemas::{Error, ErrorCode, Images, RenderJob};

use crate::RenderError;
use crate::pipeline::batch::Shot;
use crate::pipeline::device::AdapterChoice;
use crate::pipeline::drawing::{Drawing, Pictures};
use crate::scene::instance::{Body, bodies};
use crate::scene::light::Light;
use crate::scene::town::TownScene;
use crate::scene::view::View;

/// Devices that may be lost in a row before the jobs are given up.
const LOSSES_MAX: u32 = 3;

/// A job and the town it takes place in.
pub type TownJob<'a> = (Arc<TownScene>, &'a RenderJob);

/// Draws. Keeps nothing between jobs but caches.
///
/// **Determinism:** equal jobs give equal bytes on one adapter, whatever is drawn beside them.
pub struct Renderer {
    choice: AdapterChoice,
    adapter_name: String,
    /// `None` after a loss, until the next job.
    drawing: Option<Drawing>,
}

/// A job that was checked.
struct Prepared<'a> {
    town: &'a Arc<TownScene>,
    job: &'a RenderJob,
    light: Light,
    bodies: Vec<Body>,
    views: Vec<View>,
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
        let drawing = Drawing::open(&choice)?;
        Ok(Self { choice, adapter_name: drawing.gpu.description(), drawing: Some(drawing) })
    }

    /// What draws, e.g. `llvmpipe (LLVM 15.0.6, 256 bits), software`.
    pub fn adapter_name(&self) -> &str {
        &self.adapter_name
    }

    /// Draws all cameras of all jobs, in as few submissions as fit. Results are in the order of the
    /// jobs; one wrong job does not touch the others. A lost device is rebuilt and all is drawn
    /// again.
    ///
    /// # Errors
    /// Per job: [`ErrorCode::InvalidArgument`] or [`ErrorCode::UnknownActor`] for a camera that
    /// cannot be, [`ErrorCode::TooLarge`], [`ErrorCode::UnknownMap`] for another town than the
    /// frame's,
    /// [`ErrorCode::RendererUnavailable`] when the device is lost for good.
    pub fn render(&mut self, jobs: &[TownJob<'_>]) -> Vec<Result<Images, Error>> {
        let prepared: Vec<Result<Prepared<'_>, Error>> = jobs.iter().map(prepare).collect();
        let shots: Vec<Shot<'_>> = prepared.iter().flatten().flat_map(Prepared::shots).collect();
        let mut pictures = match self.draw(&shots) {
            Ok(pictures) => pictures.into_iter(),
            Err(error) => {
                let refused =
                    |job: Result<Prepared<'_>, Error>| job.and_then(|_| Err(error.clone().into()));
                return prepared.into_iter().map(refused).collect();
            }
        };
        let answer = |job: Result<Prepared<'_>, Error>| {
            let Prepared { job, .. } = job?;
            let images = pictures.by_ref().take(job.cameras.len()).collect::<Result<_, Error>>();
            Ok(Images { tick: job.frame.tick, state_hash: job.frame.state_hash, images: images? })
        };
        prepared.into_iter().map(answer).collect()
    }

    fn draw(&mut self, shots: &[Shot<'_>]) -> Result<Pictures, RenderError> {
        let mut cause = String::new();
        for _ in 0..LOSSES_MAX {
            let drawing = match &mut self.drawing {
                Some(drawing) => drawing,
                None => self.drawing.insert(Drawing::open(&self.choice)?),
            };
            match drawing.draw(shots) {
                Ok(pictures) => return Ok(pictures),
                Err(fault) => {
                    tracing::warn!(
                        adapter = self.adapter_name,
                        fault,
                        "the device was lost; opening it anew"
                    );
                    self.drawing = None;
                    cause = fault;
                }
            }
        }
        Err(RenderError::DeviceLost { times: LOSSES_MAX, cause })
    }
}

impl<'a> Prepared<'a> {
    fn shots(&self) -> impl Iterator<Item = Shot<'_>> {
        self.job.cameras.iter().zip(&self.views).map(|(camera, view)| Shot {
            town: self.town,
            hidden: &self.job.frame.hidden,
            bodies: &self.bodies,
            light: self.light,
            camera,
            view: view.clone(),
        })
    }
}

fn prepare<'a>((town, job): &'a TownJob<'_>) -> Result<Prepared<'a>, Error> {
    if town.digest() != job.frame.map.digest {
        return Err(Error::new(ErrorCode::UnknownMap, "the job is for another map")
            .wanted(town.digest())
            .found(&job.frame.map.digest));
    }
    if job.cameras.len() > CAMERAS_PER_JOB_MAX {
        return Err(Error::new(ErrorCode::TooLarge, "the job has too many cameras")
            .wanted(format_args!("at most {CAMERAS_PER_JOB_MAX}"))
            .found(job.cameras.len()));
    }
    let views: Vec<View> = job
        .cameras
        .iter()
        .map(|camera| View::of(camera, &job.frame))
        .collect::<Result<_, Error>>()?;
    let pixels: usize =
        job.cameras.iter().map(|camera| camera.width_px as usize * camera.height_px as usize).sum();
    if pixels > PIXELS_PER_JOB_MAX {
        return Err(Error::new(ErrorCode::TooLarge, "the job has too many pixels")
            .wanted(format_args!("at most {PIXELS_PER_JOB_MAX}"))
            .found(pixels));
    }
    let light = Light::of(&job.frame.weather, job.frame.tick);
    let mut bodies = bodies(&job.frame);
    bodies.extend(town.signals.bodies(&job.frame));
    Ok(Prepared { town, job, light, bodies, views })
}

#[cfg(test)]
mod tests {
    use schemas::{Camera, Frame, ImageEncoding, ImageKind, MapRef, Pose, WorldId};

    use super::*;

    fn job() -> RenderJob {
        let map = MapRef { name: String::new(), digest: "d".to_owned() };
        let frame = Frame::empty(WorldId::new(1).unwrap(), map);
        let camera = Camera {
            id: 1,
            carrier: None,
            carrier_from_camera: Pose::identity(),
            width_px: 16,
            height_px: 16,
            horizontal_fov_rad: 1.0,
            kind: ImageKind::Rgb,
            encoding: ImageEncoding::Rgba8,
            jpeg_quality: 75,
            ignored: Vec::new(),
        };
        RenderJob { tenant: "local".parse().unwrap(), frame, cameras: vec![camera] }
    }

    /// Reliability F23: the device goes before a job, and twice in a row.
    #[test]
    fn a_lost_device_is_opened_anew_and_the_job_drawn() {
        let Ok(mut renderer) = Renderer::new(AdapterChoice::Best) else {
            eprintln!("skipped: no Vulkan adapter");
            return;
        };
        let (town, job) = (Arc::new(TownScene::new("d", &[])), job());
        let before = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
        for _ in 0..2 {
            renderer.drawing.as_ref().unwrap().gpu.device.destroy();
            let after = renderer.render(&[(Arc::clone(&town), &job)]).remove(0).unwrap();
            assert!(before == after, "the picture from the new device differs");
        }
    }
}
