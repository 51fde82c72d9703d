//! Strips drawn on all processors.

use std::ops::Range;

use raster::{Canvas, Level, Material};
use schemas::{Camera, PictureQuality};

use crate::encode::{Encoder, Pixels, is_packed_by};
use crate::models::levels;
use crate::models::strips::materials;
use crate::models::towns::{Models, TownModels, built};
use crate::parallel::{in_parallel, threads};
use crate::strip::{Drawn, Strip};

use super::shadows::{ShadowPool, TownShadows};
use super::sight::{Painter, Sight};

/// Larger pictures are cut into bands, unless there are enough others to keep all threads busy.
const WHOLE_PX_MAX: u32 = 48_000;
/// Even larger ones always are.
const WHOLE_AMONG_OTHERS_PX_MAX: u32 = 1_000_000;
/// Pictures for each thread that keep it busy.
const PICTURES_A_THREAD: usize = 4;
/// Bands for each thread: so many that none waits long for the last one.
const BANDS_A_THREAD: u32 = 4;
/// Rows of a band, at least: every band looks at all clusters that reach it.
const BAND_ROWS_MIN: u32 = 16;

/// Draws on processors. Keeps models, shadows of towns, and memory.
pub(crate) struct CpuDrawing {
    level: Level,
    materials: Vec<Material>,
    towns: TownModels,
    shadows: TownShadows,
    pool: ShadowPool,
    /// One for each thread.
    kept: Vec<Kept>,
}

/// What a thread draws with.
#[derive(Default)]
struct Kept {
    canvas: Canvas,
    encoder: Encoder,
    /// Of a picture before it is encoded.
    pixels: Vec<u8>,
}

/// What one thread does without a pause.
enum Task<'t, 'a> {
    /// The shadows of a strip that is drawn in bands.
    Shadows(&'t Sight<'a>),
    /// Some rows of one, of each of its cameras.
    Band(&'t Sight<'a>, Range<u32>, Vec<&'t mut [u8]>),
    /// A strip, to the end.
    Whole(&'a Strip<'a>, &'a Models),
}

impl CpuDrawing {
    /// **Cost:** 10 to 30 ms, once per process.
    pub(crate) fn new() -> Self {
        levels::prepare();
        let threads = threads();
        Self {
            level: Level::new(),
            materials: materials(),
            towns: TownModels::default(),
            shadows: TownShadows::default(),
            pool: ShadowPool::default(),
            kept: std::iter::repeat_with(Kept::default).take(threads).collect(),
        }
    }

    /// What draws. Pictures are the same whichever instructions are used.
    pub(crate) fn description(&self) -> String {
        format!("causeway-raster 1 ({}), software", raster::level_name(self.level))
    }

    /// Draws strips and gives what came of each one's cameras, in order. Those that do not say
    /// their quality have this one.
    pub(crate) fn draw(&mut self, strips: &[Strip<'_>], quality: PictureQuality) -> Vec<Drawn> {
        let Self { level, materials, towns, shadows, pool, kept } = self;
        let painter = Painter { level: *level, materials, shadows, pool, quality };
        let threads = kept.len();
        let towns: Vec<_> = strips.iter().map(|strip| towns.get(strip.town)).collect();
        let mut sights: Vec<Option<Sight<'_>>> = Vec::with_capacity(strips.len());
        let mut buffers: Vec<Vec<Vec<u8>>> = Vec::with_capacity(strips.len());
        for (strip, town) in strips.iter().zip(&towns) {
            let is_cut = is_cut(strip, strips.len(), threads);
            sights.push(is_cut.then(|| Sight::new(strip, built(town))));
            buffers.push(if is_cut { room_for(strip) } else { Vec::new() });
        }
        let mut tasks = Vec::with_capacity(strips.len());
        for (at, (sight, buffers)) in sights.iter().zip(&mut buffers).enumerate() {
            match (sight, strips.get(at).zip(towns.get(at))) {
                (Some(sight), _) => push_bands(sight, buffers, threads, &mut tasks),
                (None, Some((strip, town))) => tasks.push(Task::Whole(strip, built(town))),
                (None, None) => {}
            }
        }
        let painted = in_parallel(kept, tasks, |kept, task| kept.work(&painter, task));
        let mut rows = Vec::new();
        for (strip, buffers) in strips.iter().zip(buffers) {
            let cameras = strip.cameras.iter().zip(buffers);
            rows.extend(cameras.map(|(camera, rows)| (*camera, strip.is_whole(), rows)));
        }
        let finished = in_parallel(kept, rows, |kept, (camera, is_whole, rows)| {
            if is_whole { kept.picture(camera, rows) } else { Drawn::Rows(rows) }
        });
        let (mut painted, mut finished) = (painted.into_iter().flatten(), finished.into_iter());
        let mut drawn = Vec::with_capacity(strips.len());
        for (strip, sight) in strips.iter().zip(&sights) {
            for _ in &strip.cameras {
                drawn.extend(if sight.is_some() { finished.next() } else { painted.next() });
            }
        }
        sights.into_iter().flatten().for_each(|sight| pool.take_back(sight));
        drawn
    }
}

impl Kept {
    fn work(&mut self, painter: &Painter<'_>, task: Task<'_, '_>) -> Vec<Drawn> {
        match task {
            Task::Shadows(sight) => {
                sight.shadow(painter);
                Vec::new()
            }
            Task::Band(sight, rows, outs) => {
                painter.look(&mut self.canvas, sight, rows);
                for (camera, out) in sight.strip.cameras.iter().zip(outs) {
                    painter.paint(&mut self.canvas, sight, camera, out);
                }
                Vec::new()
            }
            Task::Whole(strip, models) => {
                let sight = Sight::new(strip, models);
                painter.look(&mut self.canvas, &sight, strip.rows.clone());
                let cameras = strip.cameras.iter();
                let drawn = cameras.map(|camera| self.whole(painter, &sight, camera)).collect();
                painter.pool.take_back(sight);
                drawn
            }
        }
    }

    fn whole(&mut self, painter: &Painter<'_>, sight: &Sight<'_>, camera: &Camera) -> Drawn {
        let strip = sight.strip;
        let bytes = strip.pitch_bytes(camera) * strip.rows.len();
        if strip.is_whole() && !is_packed_by(camera) {
            // Every byte is written anew.
            self.pixels.resize(bytes, 0);
            painter.paint(&mut self.canvas, sight, camera, &mut self.pixels);
            let pixels = Pixels { bytes: &self.pixels, row_pitch_bytes: strip.pitch_bytes(camera) };
            return Drawn::Picture(self.encoder.encode(camera, &pixels));
        }
        let mut rows = vec![0; bytes];
        painter.paint(&mut self.canvas, sight, camera, &mut rows);
        if strip.is_whole() { self.picture(camera, rows) } else { Drawn::Rows(rows) }
    }

    /// All rows of a picture, without gaps, as the asker wants them.
    fn picture(&mut self, camera: &Camera, rows: Vec<u8>) -> Drawn {
        if is_packed_by(camera) {
            return Drawn::Picture(Ok(crate::encode::image(camera, rows)));
        }
        let row_pitch_bytes = crate::strip::packed_pitch_bytes(camera);
        let pixels = Pixels { bytes: &rows, row_pitch_bytes };
        Drawn::Picture(self.encoder.encode(camera, &pixels))
    }
}

/// Whether a strip among so many is drawn in bands.
fn is_cut(strip: &Strip<'_>, strips: usize, threads: usize) -> bool {
    let px = strip.rows.len() as u32 * strip.camera().width_px;
    let enough = strips >= threads * PICTURES_A_THREAD;
    threads > 1 && px > if enough { WHOLE_AMONG_OTHERS_PX_MAX } else { WHOLE_PX_MAX }
}

/// Room for the rows of each camera of a strip.
fn room_for(strip: &Strip<'_>) -> Vec<Vec<u8>> {
    let rows = strip.rows.len();
    strip.cameras.iter().map(|camera| vec![0; strip.pitch_bytes(camera) * rows]).collect()
}

/// Cuts a strip into bands, each with its part of the buffers.
fn push_bands<'t, 'a>(
    sight: &'t Sight<'a>,
    buffers: &'t mut [Vec<u8>],
    threads: usize,
    tasks: &mut Vec<Task<'t, 'a>>,
) {
    let strip = sight.strip;
    if strip.has_colour() {
        tasks.push(Task::Shadows(sight));
    }
    let wanted = threads as u32 * BANDS_A_THREAD;
    let height = (strip.rows.len() as u32).div_ceil(wanted).max(BAND_ROWS_MIN);
    let mut parts: Vec<_> = buffers
        .iter_mut()
        .zip(&strip.cameras)
        .map(|(buffer, camera)| buffer.chunks_mut(strip.pitch_bytes(camera) * height as usize))
        .collect();
    for start in strip.rows.clone().step_by(height as usize) {
        let rows = start..(start + height).min(strip.rows.end);
        tasks.push(Task::Band(sight, rows, parts.iter_mut().filter_map(Iterator::next).collect()));
    }
}
