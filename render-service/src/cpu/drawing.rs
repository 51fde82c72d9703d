//! Strips drawn on all processors.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use raster::{Canvas, Level, Material, PIXEL_BYTES, Placed, Scene, ShadowMap};
use schemas::{Camera, DEPTH_MAX_M, ImageKind, SemanticTag};

use crate::encode::{Pixels, encode};
use crate::scene::shadow::{ShadowView, shadow_side_px};
use crate::strip::{Drawn, Strip, row_pitch_bytes};

use super::levels;
use super::shadows::{TownShadows, sun_view};
use super::strips::{light_of, materials, placed_town, seen_bodies, shading_bodies, view_of};
use super::towns::TownModels;

/// Threads that draw, at most.
const THREADS_MAX: usize = 64;
/// Pixels that one thread draws without a pause; larger pictures are cut into bands.
const BAND_PX: u32 = 48_000;
/// Bands have a multiple of so many rows.
const BAND_ROWS: u32 = 8;

/// Draws on processors. Keeps models, shadows of towns, and memory.
pub(crate) struct CpuDrawing {
    level: Level,
    materials: Vec<Material>,
    towns: TownModels,
    shadows: TownShadows,
    /// One for each thread.
    canvases: Vec<Kept>,
}

/// What a thread draws on.
struct Kept {
    canvas: Canvas,
    /// Of the strip that is drawn, if it is one band.
    shadow: ShadowMap,
}

/// Some rows of a strip.
struct Band {
    strip: usize,
    rows: Range<u32>,
}

/// What came of a band: of each camera, at its pitch.
type Rows = Vec<Vec<u8>>;

impl CpuDrawing {
    /// **Cost:** 10 to 30 ms, once per process.
    pub(crate) fn new() -> Self {
        levels::prepare();
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(THREADS_MAX);
        let kept = || Kept { canvas: Canvas::default(), shadow: ShadowMap::empty(NO_SUN) };
        Self {
            level: Level::new(),
            materials: materials(),
            towns: TownModels::default(),
            shadows: TownShadows::default(),
            canvases: std::iter::repeat_with(kept).take(threads).collect(),
        }
    }

    /// What draws. Pictures are the same whichever instructions are used.
    pub(crate) fn description(&self) -> String {
        format!("causeway-raster 1 ({}), software", raster::level_name(self.level))
    }

    /// Draws strips and gives what came of each one's cameras, in order.
    pub(crate) fn draw(&mut self, strips: &[Strip<'_>]) -> Vec<Drawn> {
        let bands = bands_of(strips);
        let shadows: Vec<OnceLock<ShadowMap>> = strips.iter().map(|_| OnceLock::new()).collect();
        let Self { level, materials, towns, shadows: of_towns, canvases } = self;
        let painter =
            Painter { level: *level, materials, towns, of_towns, strips, shadows: &shadows };
        let painted = in_parallel(canvases, &bands, |kept, band| painter.paint(kept, band));
        let mut pictures: Vec<(&Camera, bool, Vec<u8>)> = Vec::with_capacity(painted.len());
        for (band, rows) in bands.iter().zip(painted) {
            let Some(strip) = strips.get(band.strip) else { continue };
            if band.rows.start == strip.rows.start {
                let cameras = strip.cameras.iter().zip(rows);
                pictures.extend(cameras.map(|(camera, rows)| (*camera, strip.is_whole(), rows)));
            } else {
                let first = pictures.len() - strip.cameras.len();
                let begun = pictures.iter_mut().skip(first);
                begun.zip(rows).for_each(|((_, _, begun), rows)| begun.extend(rows));
            }
        }
        let finish = |_: &mut Kept, (camera, is_whole, bytes): &(&Camera, bool, Vec<u8>)| {
            let row_pitch_bytes = row_pitch_bytes(camera.width_px) as usize;
            is_whole.then(|| encode(camera, &Pixels { bytes, row_pitch_bytes }))
        };
        let encoded = in_parallel(canvases, &pictures, finish);
        let drawn = pictures.into_iter().zip(encoded);
        drawn.map(|((_, _, rows), image)| image.map_or(Drawn::Rows(rows), Drawn::Picture)).collect()
    }
}

const NO_SUN: raster::SunView =
    raster::SunView { right: [1.0; 4], up: [1.0; 4], depth: [1.0; 4], side_px: 1 };

/// Bands of all strips, in order. Which there are follows from the sizes alone.
fn bands_of(strips: &[Strip<'_>]) -> Vec<Band> {
    let mut bands = Vec::new();
    for (strip, Strip { rows, .. }) in strips.iter().enumerate() {
        let width_px = strips.get(strip).map_or(1, |strip| strip.camera().width_px);
        let count = rows.len() as u32;
        let bands_wanted = (count * width_px).div_ceil(BAND_PX).max(1);
        let height = count.div_ceil(bands_wanted).next_multiple_of(BAND_ROWS);
        let mut start = rows.start;
        while start < rows.end {
            let end = (start + height).min(rows.end);
            bands.push(Band { strip, rows: start..end });
            start = end;
        }
    }
    bands
}

/// Does something with all items, on as many threads as there are kept things and items; what came
/// of each, in order.
fn in_parallel<K: Send, T: Sync, R: Send>(
    kept: &mut [K],
    items: &[T],
    work: impl Fn(&mut K, &T) -> R + Sync,
) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let run = |kept: &mut K| {
        let mut done: Vec<(usize, R)> = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { return done };
            done.push((at, work(kept, item)));
        }
    };
    let mut kept = kept.iter_mut().take(items.len().max(1));
    let Some(own) = kept.next() else { return Vec::new() };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = kept.map(|kept| scope.spawn(|| run(kept))).collect();
        let mut done = run(own);
        for other in others {
            done.extend(other.join().expect("drawing does not panic"));
        }
        done
    });
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}

/// What all threads that draw share.
struct Painter<'a> {
    level: Level,
    materials: &'a [Material],
    towns: &'a TownModels,
    of_towns: &'a TownShadows,
    strips: &'a [Strip<'a>],
    /// Of strips that are cut into bands.
    shadows: &'a [OnceLock<ShadowMap>],
}

impl Painter<'_> {
    fn paint(&self, kept: &mut Kept, band: &Band) -> Rows {
        let Some(strip) = self.strips.get(band.strip) else { return Rows::new() };
        let slot = self.towns.get(strip.town);
        let Some(models) = slot.get() else { return Rows::new() };
        let [ground, standing] = models.each_ref().map(placed_town);
        let mut placed = vec![ground, standing];
        seen_bodies(strip, &mut placed);
        let hidden = strip.hidden;
        let is_hidden = |thing: u32| hidden.contains(thing);
        let is_hidden: &(dyn Fn(u32) -> bool + Sync) = &is_hidden;
        let scene = Scene {
            placed: &placed,
            is_hidden: (!hidden.is_none()).then_some(is_hidden),
            materials: self.materials,
        };
        let view = view_of(strip);
        let Kept { canvas, shadow } = kept;
        canvas.look(self.level, &view, band.rows.clone(), &scene);
        let pitch_bytes = row_pitch_bytes(view.width_px) as usize;
        debug_assert!(pitch_bytes >= view.width_px as usize * PIXEL_BYTES);
        let mut paint = |camera: &&Camera| {
            let mut rows = vec![0; pitch_bytes * band.rows.len()];
            let out = (rows.as_mut_slice(), pitch_bytes);
            match camera.kind {
                ImageKind::Rgb => {
                    let light = light_of(strip.light);
                    let shadow = self.shadow(strip, band, &standing, shadow);
                    canvas.colour(self.level, &view, &scene, (&light, shadow), out);
                }
                ImageKind::Depth => canvas.depth(DEPTH_MAX_M, out),
                ImageKind::Semantic | ImageKind::Instance => {
                    canvas.labels(&scene, u32::from(SemanticTag::Sky.number()), out);
                }
                ImageKind::Normals => canvas.normals(self.level, &view, &scene, out),
            }
            rows
        };
        strip.cameras.iter().map(&mut paint).collect()
    }

    /// The shadows of a strip: its town's, and those of bodies.
    fn shadow<'m>(
        &'m self,
        strip: &Strip<'_>,
        band: &Band,
        town: &Placed<'_>,
        own: &'m mut ShadowMap,
    ) -> &'m ShadowMap {
        let Camera { width_px, height_px, .. } = *strip.camera();
        let side_px = shadow_side_px(width_px, height_px, true);
        let sun = ShadowView::of(strip.view, &strip.light.to_light);
        let cast = |map: &mut ShadowMap| {
            let of_town = (strip.town.digest(), strip.hidden);
            let view = sun_view(&sun, side_px);
            let slot: Arc<_> = self.of_towns.get(self.level, of_town, town, &view);
            if let Some(of_town) = slot.get() {
                map.copy_from(of_town);
            }
            let mut bodies = Vec::new();
            shading_bodies(strip, &sun, side_px, &mut bodies);
            map.add(self.level, &bodies, None);
        };
        match self.shadows.get(band.strip) {
            Some(shared) if band.rows != strip.rows => shared.get_or_init(|| {
                let mut map = ShadowMap::empty(NO_SUN);
                cast(&mut map);
                map
            }),
            _ => {
                cast(own);
                own
            }
        }
    }
}
