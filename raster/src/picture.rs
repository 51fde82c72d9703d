//! Pictures: what is seen first, then its colour, depth, labels or normals.

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, mask32x8, u32x8};

use crate::draw::{Drawing, Placed, Seen, Work, draw};
use crate::fill::LANES;
use crate::light::{Light, Lit};
use crate::pixels::{PIXEL_BYTES, Rays, signed, store};
use crate::shade::{Rain, Sight, body, facade, ground, sky};
use crate::shadow::ShadowMap;
use crate::surface::{Family, Looks, Material, Surface};
use crate::target::Target;
use crate::vector::{V8, splat};
use crate::view::View;

/// What is in the world.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Models at their places.
    pub placed: &'a [Placed<'a>],
    /// Whether a thing of the models is hidden; `None` if none is.
    pub is_hidden: Option<&'a (dyn Fn(u32) -> bool + Sync)>,
    /// At the places of their numbers.
    pub materials: &'a [Material],
}

/// Some rows of what a view shows, before it is a picture. Kept from one view to the next, it saves
/// memory being fetched anew.
#[derive(Debug, Default)]
pub struct Canvas {
    work: Work,
    target: Target,
    seen: Vec<Seen>,
    /// Of those that are seen: the place of its surface, and 1; 0 for one not asked for yet.
    places: Vec<u32>,
    surfaces: Vec<Surface>,
}

impl Canvas {
    /// Finds out what some rows of a view show.
    pub fn look(&mut self, level: Level, view: &View, rows: Range<u32>, scene: &Scene<'_>) {
        let projection = view.projection(rows.clone());
        self.target.clear(view.width_px, rows, true);
        let drawing = Drawing {
            projection: &projection,
            placed: scene.placed,
            is_hidden: scene.is_hidden,
            slope: 0.0,
        };
        draw(level, &drawing, &mut self.work, &mut self.target, &mut self.seen);
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
        (light, shadow): (&Light, &ShadowMap),
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        let lit = Lit { light, shadow };
        dispatch!(level, simd => self.colour_rows(simd, view, scene, &lit, (out, pitch_bytes)));
    }

    #[inline(always)]
    fn colour_rows<S: Simd>(
        &mut self,
        simd: S,
        view: &View,
        scene: &Scene<'_>,
        lit: &Lit<'_>,
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        let rain = Rain::of(simd, lit.light);
        let first = self.target.first_row;
        for (line, row) in out.chunks_mut(pitch_bytes).zip(first..first + self.target.row_count) {
            let rays = Rays::of_row(view, row);
            for (at, pixels) in line.chunks_mut(LANES * PIXEL_BYTES).enumerate() {
                let at = at * LANES;
                if at >= view.width_px as usize {
                    break;
                }
                let mut shown = self.eight(simd, scene, lit, &rays, (row, at));
                if let Some(rain) = &rain {
                    let across = rays.across(simd, at) * (0.5 / rays.parts.half_height);
                    let down = -rays.down * 0.5;
                    shown = rain.over(simd, shown, across, down);
                }
                store(simd, shown, pixels);
            }
        }
    }

    /// Eight pixels in linear display colour.
    #[inline(always)]
    fn eight<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<'_>,
        lit: &Lit<'_>,
        rays: &Rays<'_>,
        (row, at): (u32, usize),
    ) -> V8<S> {
        let (nearness, ids) = self.load(simd, row, at);
        let ray = rays.ray(simd, at);
        let length = ray.norm();
        let direction = ray.scaled(splat(simd, 1.0) / length);
        let nothing = ids.simd_eq(u32x8::splat(simd, 0));
        let has_sky = nothing.any_true();
        let mut radiance = V8::splat(simd, [0.0; 3]);
        if has_sky {
            radiance = simd.vectorize(
                #[inline(always)]
                || sky(simd, lit.light, direction),
            );
            if nothing.all_true() {
                return lit.light.displayed(simd, radiance);
            }
        }
        let depth_m = splat(simd, 1.0) / nothing.select(splat(simd, 1.0), nearness);
        let place_m = ray.scaled(depth_m).plus(V8::splat(simd, rays.view.eye_m));
        let distance_m = depth_m * length;
        let sight = Sight { place_m, distance_m, direction, pixel: rays.parts.across };
        let (looks, families) = self.looks(simd, scene, ids, place_m);
        for (family, mask) in families {
            if !mask.any_true() {
                continue;
            }
            let colour = simd.vectorize(
                #[inline(always)]
                || match family {
                    Family::Ground => ground(simd, lit, &sight, &looks),
                    Family::Facade => facade(simd, lit, &sight, &looks),
                    Family::Body => body(simd, lit, &sight, &looks),
                },
            );
            let hazed = lit.light.hazed(simd, colour, distance_m);
            radiance = hazed.or(mask, radiance);
        }
        lit.light.displayed(simd, radiance)
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

    /// What eight pixels show, and which of them belong to which family.
    #[inline(always)]
    fn looks<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<'_>,
        ids: u32x8<S>,
        place_m: V8<S>,
    ) -> (Looks<S>, [(Family, mask32x8<S>); 3]) {
        let mut looks = Looks::nothing(simd);
        let none = mask32x8::splat(simd, false);
        let mut families = [Family::Ground, Family::Facade, Family::Body].map(|one| (one, none));
        self.visit(
            simd,
            scene,
            ids,
            #[inline(always)]
            |mask, surface| {
                looks = looks.with(simd, mask, surface, place_m);
                for (family, of_family) in &mut families {
                    if *family == surface.family {
                        *of_family |= mask;
                    }
                }
            },
        );
        (looks, families)
    }

    /// Visits the surfaces that eight pixels show, each with the pixels that show it.
    #[inline(always)]
    fn visit<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene<'_>,
        ids: u32x8<S>,
        mut visit: impl FnMut(mask32x8<S>, &Surface),
    ) {
        let numbers = ids.to_array();
        let mut rest = (!ids.simd_eq(u32x8::splat(simd, 0))).to_bitmask();
        while rest != 0 {
            let id = numbers[rest.trailing_zeros() as usize];
            let mask = ids.simd_eq(u32x8::splat(simd, id));
            rest &= !mask.to_bitmask();
            if let Some(surface) = self.surface(scene, id) {
                visit(mask, surface);
            }
        }
    }

    /// The surface of a triangle that is seen.
    #[inline(always)]
    fn surface(&mut self, scene: &Scene<'_>, id: u32) -> Option<&Surface> {
        let at = id as usize - 1;
        let slot = self.places.get_mut(at)?;
        if *slot == 0 {
            let surface = Surface::of(self.seen.get(at)?, scene.placed, scene.materials)?;
            self.surfaces.push(surface);
            *slot = self.surfaces.len() as u32;
        }
        self.surfaces.get(*slot as usize - 1)
    }

    /// Writes metres along the view as little-endian floats, at most `most_m`, which is also what
    /// the sky has.
    pub fn depth(&self, most_m: f32, (out, pitch_bytes): (&mut [u8], usize)) {
        self.write(out, pitch_bytes, |nearness, _| {
            let depth_m = if nearness > 0.0 { 1.0 / nearness } else { most_m };
            if depth_m < most_m { depth_m.to_le_bytes() } else { most_m.to_le_bytes() }
        });
    }

    /// Writes labels, little-endian; where nothing is, this one.
    pub fn labels(&self, scene: &Scene<'_>, sky: u32, (out, pitch_bytes): (&mut [u8], usize)) {
        let mut last = (0, sky.to_le_bytes());
        self.write(out, pitch_bytes, |_, id| {
            if id != last.0 {
                let label = id.checked_sub(1).and_then(|at| self.label(scene, at as usize));
                last = (id, label.unwrap_or(sky).to_le_bytes());
            }
            last.1
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

    fn write(
        &self,
        out: &mut [u8],
        pitch_bytes: usize,
        mut pixel: impl FnMut(f32, u32) -> [u8; PIXEL_BYTES],
    ) {
        let first = self.target.first_row;
        for (line, row) in out.chunks_mut(pitch_bytes).zip(first..first + self.target.row_count) {
            let (nearness, ids) = self.target.row(row);
            let pixels = line.as_chunks_mut::<PIXEL_BYTES>().0.iter_mut();
            let shown = nearness.iter().zip(ids).take(self.target.width_px as usize);
            for (slot, (nearness, id)) in pixels.zip(shown) {
                *slot = pixel(*nearness, *id);
            }
        }
    }

    /// Writes unit normals in the camera's axes (along the view, left, up) as signed bytes, and a
    /// 0; all 0 where nothing is.
    pub fn normals(
        &mut self,
        level: Level,
        view: &View,
        scene: &Scene<'_>,
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        dispatch!(level, simd => self.normal_rows(simd, view, scene, (out, pitch_bytes)));
    }

    #[inline(always)]
    fn normal_rows<S: Simd>(
        &mut self,
        simd: S,
        view: &View,
        scene: &Scene<'_>,
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        let first = self.target.first_row;
        let ahead = V8::splat(simd, view.forward);
        let (left, up) = (V8::splat(simd, view.left), V8::splat(simd, view.up));
        for (line, row) in out.chunks_mut(pitch_bytes).zip(first..first + self.target.row_count) {
            let rays = Rays::of_row(view, row);
            for (at, pixels) in line.chunks_mut(LANES * PIXEL_BYTES).enumerate() {
                let at = at * LANES;
                if at >= view.width_px as usize {
                    break;
                }
                let (nearness, ids) = self.load(simd, row, at);
                let depth_m = splat(simd, 1.0) / nearness;
                let place_m = rays.ray(simd, at).scaled(depth_m).plus(V8::splat(simd, view.eye_m));
                let mut normal = V8::splat(simd, [0.0; 3]);
                self.visit(
                    simd,
                    scene,
                    ids,
                    #[inline(always)]
                    |mask, surface| {
                        normal = surface.at(simd, place_m).0.or(mask, normal);
                    },
                );
                let bytes = [
                    signed(simd, normal.dot(ahead)),
                    signed(simd, normal.dot(left)),
                    signed(simd, normal.dot(up)),
                ];
                for (lane, pixel) in pixels.as_chunks_mut::<PIXEL_BYTES>().0.iter_mut().enumerate()
                {
                    let part = |axis: usize| bytes[axis][lane] as i8 as u8;
                    *pixel = [part(0), part(1), part(2), 0];
                }
            }
        }
    }
}
