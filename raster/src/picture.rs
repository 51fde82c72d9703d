//! Pictures: what is seen first, then its colour, depth, labels or normals.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, u32x8};

use crate::choose::Prospect;
use crate::draw::{Drawing, Screen, Seen, draw};
use crate::edges::{Edges, Room};
use crate::lamp::LAMPS_MAX;
use crate::light::{Light, Lit};
use crate::occluder::OCCLUDERS_MAX;
use crate::paint::Painter;
use crate::pixels::{Rays, signed, signed_of};
use crate::quality::Quality;
use crate::rows::ByRow;
use crate::scene::Scene;
use crate::shade::Rain;
use crate::shadow::ShadowMap;
use crate::surface::{Surface, at_each};
use crate::target::Target;
use crate::vector::{LANES, V8, splat};
use crate::view::View;

/// In the place of a normal's bytes: it is not the same all over its triangle.
const BENT: u32 = u32::MAX;

/// Some rows of what a view shows, before it is a picture. Kept from one view to the next, it saves
/// memory being fetched anew.
#[derive(Debug, Default)]
pub struct Canvas {
    screen: Screen,
    /// That somebody wants.
    rows: Range<u32>,
    /// These rows and those beside them, from an even one on.
    target: Target,
    seen: Vec<Seen>,
    /// Of those that are seen: the place of its surface, and 1; 0 for one not asked for yet.
    places: Vec<u32>,
    surfaces: Vec<Surface>,
    edges: Room,
}

impl Canvas {
    /// Finds out what some rows of a view show. The prospect is the view's of the scene.
    pub fn look(
        &mut self,
        level: Level,
        view: &View,
        rows: Range<u32>,
        (scene, prospect): (&Scene<'_>, &Prospect),
    ) {
        // Rows share colours by twos: the upper one is needed for the lower one.
        let Range { start, end } = Edges::rows_around(&rows, view.height_px);
        self.target.clear(view.width_px, (start & !1)..end, true);
        self.rows = rows;
        let drawing =
            Drawing { placed: scene.placed, prospect, is_hidden: scene.is_hidden, slope: 0.0 };
        draw(level, &drawing, &mut self.screen, &mut self.target, &mut self.seen);
        self.surfaces.clear();
        self.places.clear();
        self.places.resize(self.seen.len(), 0);
    }

    /// Writes the colours of what was seen: red, green, blue, 255, as the display wants them.
    /// Rows begin `pitch_bytes` from each other.
    pub fn colour(
        &mut self,
        level: Level,
        view: &View,
        scene: &Scene<'_>,
        (light, shadow, quality): (&Light, &ShadowMap, Quality),
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        self.find_surfaces(scene, quality);
        let Self { target, places, surfaces, rows: wanted, seen, edges, .. } = self;
        let is_high = quality == Quality::High;
        let rows =
            if is_high { Edges::rows_around(wanted, view.height_px) } else { wanted.clone() };
        // Low quality shades no ground.
        let most = if is_high { OCCLUDERS_MAX } else { 0 };
        let all_rows = target.first_row..target.first_row + target.row_count;
        let lamps = ByRow::of(view, (scene.lamps, LAMPS_MAX), all_rows.clone());
        let occluders = ByRow::of(view, (scene.occluders, most), all_rows);
        let painter = |rain| Painter {
            rays: Rays::of(view),
            lit: Lit { light, shadow, quality, lamps: &[], occluders: &[] },
            lamps: &lamps,
            occluders: &occluders,
            rain,
            target,
            rows: rows.clone(),
            places,
            surfaces,
            coats: scene.coats,
        };
        if !is_high {
            dispatch!(level, simd => painter(Rain::of(simd, light)).paint(simd, (out, pitch_bytes)));
            return;
        }
        let colours = edges.colours(view.width_px, rows.len());
        dispatch!(level, simd => painter(Rain::of(simd, light)).paint(simd, colours));
        let (projection, wanted) = (view.projection(), wanted.clone());
        let soft = Edges { scene, projection, target, seen, rows: wanted };
        let out = (out, pitch_bytes);
        dispatch!(level, simd => soft.soften(simd, edges, rows.start, out));
    }

    /// Makes the surfaces of all triangles that any pixel shows.
    fn find_surfaces(&mut self, scene: &Scene<'_>, quality: Quality) {
        let Self { target, seen, places, surfaces, .. } = self;
        let mut last = 0;
        for id in &target.ids {
            if *id == last {
                continue;
            }
            last = *id;
            let Some(at) = (*id as usize).checked_sub(1) else { continue };
            let Some(place) = places.get_mut(at).filter(|place| **place == 0) else { continue };
            let surface = seen.get(at).and_then(|seen| Surface::of(seen, scene, quality));
            if let Some(surface) = surface {
                surfaces.push(surface);
                *place = surfaces.len() as u32;
            }
        }
    }

    /// Writes metres along the view as little-endian floats, at most `most_m`, which is also what
    /// the sky has.
    pub fn depth(&self, level: Level, most_m: f32, (out, pitch_bytes): (&mut [u8], usize)) {
        dispatch!(level, simd => self.each_eight(
            (out, pitch_bytes),
            4,
            #[inline(always)]
            |row, at| self.eight_depths(simd, most_m, (row, at)),
        ));
    }

    #[inline(always)]
    fn eight_depths<S: Simd>(&self, simd: S, most_m: f32, (row, at): (u32, usize)) -> [u32; LANES] {
        let (nearness, _) = self.load(simd, row, at);
        let depth_m = splat(simd, 1.0) / nearness;
        let most_m = splat(simd, most_m);
        let is_there = nearness.simd_gt(splat(simd, 0.0)) & depth_m.simd_lt(most_m);
        is_there.select(depth_m, most_m).to_array().map(f32::to_bits)
    }

    /// Writes the first so many bytes, 1 or 4, of labels, little-endian; where nothing is, of this
    /// one.
    pub fn labels(
        &self,
        scene: &Scene<'_>,
        sky: u32,
        pixel_bytes: usize,
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        let mut last = (0, sky);
        self.each_eight((out, pitch_bytes), pixel_bytes, |row, at| {
            let (_, ids) = self.target.row(row);
            let Some(ids) = ids.get(at..).and_then(<[u32]>::first_chunk::<LANES>) else {
                return [sky; LANES];
            };
            ids.map(|id| {
                if id != last.0 {
                    let label = id.checked_sub(1).and_then(|at| self.label(scene, at as usize));
                    last = (id, label.unwrap_or(sky));
                }
                last.1
            })
        });
    }

    fn label(&self, scene: &Scene<'_>, at: usize) -> Option<u32> {
        let seen = self.seen.get(at)?;
        let placed = scene.placed.get(seen.placed as usize)?;
        if placed.label != 0 {
            return Some(placed.label);
        }
        let triangle = placed.model.triangles.get(seen.triangle as usize)?;
        let [corner, _, _] = placed.model.corners_of(triangle)?;
        Some(corner.label)
    }

    /// Writes unit normals in the camera's axes (along the view, left, up) as signed bytes, and a
    /// 0 if pixels have 4 bytes and not 3; all 0 where nothing is.
    pub fn normals(
        &mut self,
        level: Level,
        view: &View,
        scene: &Scene<'_>,
        pixel_bytes: usize,
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        self.find_surfaces(scene, Quality::High);
        let this = &*self;
        let whole: Vec<u32> = this.whole_normals(view);
        dispatch!(level, simd => this.each_eight(
            (out, pitch_bytes),
            pixel_bytes,
            #[inline(always)]
            |row, at| this.eight_normals(simd, (view, &whole), (row, at)),
        ));
    }

    /// By id, the bytes of the normal that all of a triangle has, or that it is bent.
    fn whole_normals(&self, view: &View) -> Vec<u32> {
        let of_place = |place: &u32| {
            let surface = self.surfaces.get((*place as usize).wrapping_sub(1))?;
            if !surface.is_flat {
                return Some(BENT);
            }
            let part = |axis: [f32; 3]| signed_of(crate::vector::dot(surface.normals[0], axis));
            Some(bytes_of([part(view.forward), part(view.left), part(view.up)]))
        };
        let of_all = self.places.iter().map(|place| of_place(place).unwrap_or(0));
        std::iter::once(0).chain(of_all).collect()
    }

    #[inline(always)]
    fn eight_normals<S: Simd>(
        &self,
        simd: S,
        (view, whole): (&View, &[u32]),
        (row, at): (u32, usize),
    ) -> [u32; LANES] {
        let (_, ids) = self.load(simd, row, at);
        let ids = ids.to_array();
        let mut pixels = ids.map(
            #[inline(always)]
            |id| whole.get(id as usize).copied().unwrap_or(0),
        );
        let Some(bent) = pixels.iter().position(|pixel| *pixel == BENT) else { return pixels };
        let surface = |id: u32| {
            let place = self.places.get((id as usize).wrapping_sub(1))?;
            self.surfaces.get((*place as usize).wrapping_sub(1))
        };
        let Some(any) = surface(ids[bent]) else { return pixels };
        let places = self.places_of(simd, view, (row, at));
        let normal = if ids.iter().all(|id| *id == ids[0]) {
            any.at(simd, places).0
        } else {
            let is_bent = pixels.map(|pixel| pixel == BENT);
            let mut each = [any; LANES];
            for (lane, slot) in each.iter_mut().enumerate().filter(|(lane, _)| is_bent[*lane]) {
                *slot = surface(ids[lane]).unwrap_or(any);
            }
            at_each(simd, &each, places).0
        };
        let ahead = signed(simd, normal.dot(V8::splat(simd, view.forward)));
        let left = signed(simd, normal.dot(V8::splat(simd, view.left)));
        let up = signed(simd, normal.dot(V8::splat(simd, view.up)));
        for (lane, pixel) in pixels.iter_mut().enumerate() {
            if *pixel == BENT {
                *pixel = bytes_of([ahead[lane], left[lane], up[lane]]);
            }
        }
        pixels
    }

    /// Where eight neighbours show something.
    #[inline(always)]
    fn places_of<S: Simd>(&self, simd: S, view: &View, (row, at): (u32, usize)) -> V8<S> {
        let (nearness, _) = self.load(simd, row, at);
        let ray = Rays::of(view).of_eight(simd, (row, at));
        ray.scaled(splat(simd, 1.0) / nearness).plus(V8::splat(simd, view.eye_m))
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, row: u32, at: usize) -> (f32x8<S>, u32x8<S>) {
        let (nearness, ids) = self.target.row(row);
        match (nearness.get(at..at + LANES), ids.get(at..at + LANES)) {
            (Some(nearness), Some(ids)) => {
                (f32x8::from_slice(simd, nearness), u32x8::from_slice(simd, ids))
            }
            _ => (splat(simd, 0.0), u32x8::splat(simd, 0)),
        }
    }

    /// Writes the first so many bytes of what every pixel gets, eight at a time.
    #[inline(always)]
    fn each_eight(
        &self,
        (out, pitch_bytes): (&mut [u8], usize),
        pixel_bytes: usize,
        mut eight: impl FnMut(u32, usize) -> [u32; LANES],
    ) {
        let width_bytes = self.target.width_px as usize * pixel_bytes;
        for (line, row) in out.chunks_mut(pitch_bytes).zip(self.rows.clone()) {
            let line = line.get_mut(..width_bytes).unwrap_or_default();
            for (at, pixels) in line.chunks_mut(LANES * pixel_bytes).enumerate() {
                let values = eight(row, at * LANES);
                match pixel_bytes {
                    1 => write::<1>(pixels, &values),
                    3 => write::<3>(pixels, &values),
                    _ => write::<4>(pixels, &values),
                }
            }
        }
    }
}

#[inline(always)]
fn write<const BYTES: usize>(pixels: &mut [u8], values: &[u32; LANES]) {
    for (pixel, value) in pixels.as_chunks_mut::<BYTES>().0.iter_mut().zip(values) {
        if let Some(bytes) = value.to_le_bytes().first_chunk::<BYTES>() {
            *pixel = *bytes;
        }
    }
}

/// Three whole numbers from -127 to 127 as signed bytes, and a 0.
#[inline(always)]
fn bytes_of(parts: [f32; 3]) -> u32 {
    let [a, b, c] = parts.map(|part| part as i8 as u8);
    u32::from_le_bytes([a, b, c, 0])
}
