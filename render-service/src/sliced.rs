//! A job that is drawn portion by portion, so that others can be drawn in between.

use std::ops::{Deref, Range};
use std::sync::{Arc, OnceLock};

use raster::Coat;
use schemas::limits::{CAMERAS_PER_JOB_MAX, PIXELS_PER_JOB_MAX};
use schemas::{Camera, Error, ErrorCode, Image, ImageKind, Images, RenderJob};

use crate::encode::{Pixels, encode};
use crate::scene::coat::Textures;
use crate::scene::instance::Body;
use crate::scene::light::Light;
use crate::scene::town::TownScene;
use crate::scene::view::View;
use crate::strip::{Drawn, Strip, row_pitch_bytes};

/// Pictures are cut at multiples of so many rows: software draws in squares of this side.
const ROWS_MULTIPLE: u32 = 64;

/// A job that was checked, and what is drawn of it.
pub(crate) struct SlicedJob<J> {
    town: Arc<TownScene>,
    job: J,
    light: Light,
    coats: Vec<Coat>,
    of_actors: OnceLock<Vec<Body>>,
    passes: Vec<Pass>,
    /// The pass and the row that come next.
    next: (usize, u32),
    /// By camera.
    pictures: Vec<Picture>,
}

/// What one camera pose gives: one picture of colour, or some of geometry.
struct Pass {
    view: View,
    /// Their places in the job.
    cameras: Vec<usize>,
    width_px: u32,
    height_px: u32,
    is_colour: bool,
}

/// How far a picture is.
enum Picture {
    /// The rows that are drawn, at their pitch.
    Rows(Vec<u8>),
    /// It was drawn in one go.
    Whole(Result<Image, Error>),
}

/// What is drawn of a job without a pause: passes with their rows, all rows but for the last one.
pub(crate) type Portion = Vec<(usize, Range<u32>)>;

/// What drawing has to do, in parts of which each has its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Work {
    /// Passes, whole or in part.
    pub(crate) passes: u64,
    pub(crate) colour_px: u64,
    /// Counted once per pass, however many pictures it gives.
    pub(crate) geometry_px: u64,
}

impl std::ops::AddAssign for Work {
    fn add_assign(&mut self, more: Self) {
        self.passes += more.passes;
        self.colour_px += more.colour_px;
        self.geometry_px += more.geometry_px;
    }
}

impl Work {
    /// All passes of a job, if none is shared.
    pub(crate) fn of(job: &RenderJob) -> Self {
        let mut all = Self::default();
        for camera in &job.cameras {
            all += Self::rows(camera.kind == ImageKind::Rgb, camera.width_px, camera.height_px);
        }
        all
    }

    fn rows(is_colour: bool, width_px: u32, rows: u32) -> Self {
        let px = u64::from(width_px) * u64::from(rows);
        let (colour_px, geometry_px) = if is_colour { (px, 0) } else { (0, px) };
        Self { passes: 1, colour_px, geometry_px }
    }
}

impl<J: Deref<Target = RenderJob>> SlicedJob<J> {
    /// Checks a job.
    ///
    /// # Errors
    /// As for [`Renderer::render`](crate::Renderer::render).
    pub(crate) fn new(town: Arc<TownScene>, job: J, textures: &Textures) -> Result<Self, Error> {
        let passes = passes_of(&town, &job)?;
        let light = Light::of(&job.frame.weather, job.frame.tick);
        let pictures = job.cameras.iter().map(|_| Picture::Rows(Vec::new())).collect();
        let of_actors = OnceLock::new();
        let coats = town.boxes.coats(&job.frame.paint, textures);
        Ok(Self { town, job, light, coats, of_actors, passes, next: (0, 0), pictures })
    }

    /// Its job.
    pub(crate) fn job(&self) -> &RenderJob {
        &self.job
    }

    /// All that is left.
    pub(crate) fn rest(&self) -> Portion {
        let (next, row) = self.next;
        let rest = self.passes.iter().enumerate().skip(next);
        rest.map(|(at, pass)| (at, if at == next { row } else { 0 }..pass.height_px)).collect()
    }

    /// What comes next and costs about so much: whole passes, or rows of one.
    pub(crate) fn portion(&self, wanted: u64, cost: impl Fn(&Work) -> u64) -> Portion {
        let mut portion = Portion::new();
        let mut sum = 0;
        for (at, rows) in self.rest() {
            let Some(pass) = self.passes.get(at) else { break };
            let costs = cost(&pass.work(&rows));
            // A rest that is hardly more than what is wanted is not worth another turn.
            let room = if portion.is_empty() { wanted + wanted / 2 } else { wanted - sum };
            if costs <= room {
                sum = (sum + costs).min(wanted);
                portion.push((at, rows));
                continue;
            }
            if portion.is_empty() {
                let fixed = cost(&Work { passes: 1, ..Work::default() });
                let per_pixels = costs.saturating_sub(fixed).max(1);
                // At least as much for pixels as for what is done again for every slice.
                let for_pixels = wanted.saturating_sub(fixed).max(fixed);
                let count = u64::from(rows.end - rows.start) * for_pixels / per_pixels;
                let count = (count as u32 / ROWS_MULTIPLE).max(1) * ROWS_MULTIPLE;
                portion.push((at, rows.start..rows.end.min(rows.start + count)));
            }
            break;
        }
        portion
    }

    /// What there is to do for a portion.
    pub(crate) fn work_of(&self, portion: &Portion) -> Work {
        let mut work = Work::default();
        for (at, rows) in portion {
            if let Some(pass) = self.passes.get(*at) {
                work += pass.work(rows);
            }
        }
        work
    }

    /// What the device draws for a portion.
    pub(crate) fn strips<'a>(&'a self, portion: &'a Portion) -> impl Iterator<Item = Strip<'a>> {
        portion.iter().filter_map(|(at, rows)| {
            let pass = self.passes.get(*at)?;
            let cameras = pass.cameras.iter().filter_map(|at| self.job.cameras.get(*at));
            Some(Strip {
                town: &self.town,
                hidden: &self.job.frame.hidden,
                frame: &self.job.frame,
                staging: &self.job.staging,
                coats: &self.coats,
                of_actors: &self.of_actors,
                light: &self.light,
                view: &pass.view,
                cameras: cameras.collect(),
                rows: rows.clone(),
            })
        })
    }

    /// Takes what was drawn for a portion.
    pub(crate) fn take(&mut self, portion: &Portion, drawn: &mut impl Iterator<Item = Drawn>) {
        for (at, rows) in portion {
            let Some(pass) = self.passes.get(*at) else { continue };
            let cameras = pass.cameras.iter();
            for (camera, drawn) in cameras.zip(drawn.by_ref()) {
                match (self.pictures.get_mut(*camera), drawn) {
                    (Some(picture), Drawn::Picture(image)) => *picture = Picture::Whole(image),
                    (Some(Picture::Rows(all)), Drawn::Rows(some)) => {
                        all.reserve_exact(pass.picture_bytes() - all.len());
                        all.extend_from_slice(&some);
                    }
                    _ => {}
                }
            }
            let is_done = rows.end == pass.height_px;
            self.next = if is_done { (at + 1, 0) } else { (*at, rows.end) };
        }
    }

    /// Whether nothing is left to be drawn.
    pub(crate) fn is_drawn(&self) -> bool {
        self.next.0 == self.passes.len()
    }

    /// Whether pictures are still to be encoded: those that were drawn in slices.
    pub(crate) fn has_rows(&self) -> bool {
        self.pictures.iter().any(|picture| matches!(picture, Picture::Rows(_)))
    }

    /// The pictures of a job that is drawn.
    ///
    /// # Errors
    /// [`ErrorCode::Internal`] when an encoder refuses.
    pub(crate) fn finish(self) -> Result<Images, Error> {
        let frame = &self.job.frame;
        let (tick, state_hash) = (frame.tick, frame.state_hash);
        let finish = |(camera, picture): (&Camera, Picture)| match picture {
            Picture::Whole(image) => image,
            Picture::Rows(bytes) => {
                let row_pitch_bytes = row_pitch_bytes(camera.width_px) as usize;
                encode(camera, &Pixels { bytes: &bytes, row_pitch_bytes })
            }
        };
        let images = self.job.cameras.iter().zip(self.pictures).map(finish);
        Ok(Images { tick, state_hash, images: images.collect::<Result<_, Error>>()? })
    }
}

impl Pass {
    fn work(&self, rows: &Range<u32>) -> Work {
        Work::rows(self.is_colour, self.width_px, rows.end - rows.start)
    }

    /// Of one of its pictures, at its pitch.
    fn picture_bytes(&self) -> usize {
        row_pitch_bytes(self.width_px) as usize * self.height_px as usize
    }
}

/// The passes of a job whose cameras can all be.
fn passes_of(town: &TownScene, job: &RenderJob) -> Result<Vec<Pass>, Error> {
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
    let mut passes: Vec<Pass> = Vec::with_capacity(job.cameras.len());
    let mut pixels = 0;
    for (at, camera) in job.cameras.iter().enumerate() {
        let view = View::of(camera, &job.frame)?;
        let Camera { width_px, height_px, .. } = *camera;
        pixels += width_px as usize * height_px as usize;
        let is_colour = camera.kind == ImageKind::Rgb;
        let shared = passes.iter_mut().find(|pass| {
            let first = pass.cameras.first().and_then(|first| job.cameras.get(*first));
            !is_colour
                && !pass.is_colour
                && (pass.width_px, pass.height_px) == (width_px, height_px)
                && pass.view == view
                && first.is_some_and(|first| first.ignored == camera.ignored)
        });
        match shared {
            Some(pass) => pass.cameras.push(at),
            None => {
                passes.push(Pass { view, cameras: vec![at], width_px, height_px, is_colour });
            }
        }
    }
    if pixels > PIXELS_PER_JOB_MAX {
        return Err(Error::new(ErrorCode::TooLarge, "the job has too many pixels")
            .wanted(format_args!("at most {PIXELS_PER_JOB_MAX}"))
            .found(pixels));
    }
    Ok(passes)
}
