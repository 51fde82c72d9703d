//! Colours of what a canvas shows: pixels of one kind of surface together, eight at a time,
//! wherever they are in the picture.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::fill::LANES;
use crate::lamp::Lamp;
use crate::light::Lit;
use crate::occluder::Occluder;
use crate::pixels::{PIXEL_BYTES, Rays, packed};
use crate::quality::Quality;
use crate::rows::ByRow;
use crate::scene::Family;
use crate::shade::{Rain, Sight, body, facade, ground, sky};
use crate::surface::{Looks, Surface};
use crate::target::Target;
use crate::vector::{V8, splat};

/// Families of surfaces, and the sky.
const KINDS: usize = 4;
const SKY: usize = 0;

/// Eight pixels that are shaded together.
#[derive(Clone, Copy, Debug, Default)]
struct Eight {
    columns: [u32; LANES],
    rows: [u32; LANES],
    nearness: [f32; LANES],
    /// What they show; all of one family.
    surfaces: [u32; LANES],
    /// Whether the pixel on the right gets the same colour.
    is_double: [bool; LANES],
    count: usize,
}

impl Eight {
    fn push(&mut self, (column, row): (u32, u32), nearness: f32, surface: u32, is_double: bool) {
        let at = self.count % LANES;
        self.columns[at] = column;
        self.rows[at] = row;
        self.nearness[at] = nearness;
        self.surfaces[at] = surface;
        self.is_double[at] = is_double;
        self.count += 1;
    }

    /// Those that are missing as copies of the first one.
    fn fill_up(&mut self) {
        for at in self.count..LANES {
            self.columns[at] = self.columns[0];
            self.rows[at] = self.rows[0];
            self.nearness[at] = self.nearness[0];
            self.surfaces[at] = self.surfaces[0];
            self.is_double[at] = self.is_double[0];
        }
    }
}

/// Puts colours on the rows of a target.
pub(crate) struct Painter<'a> {
    pub(crate) rays: Rays<'a>,
    /// All that lights but lamps and what keeps light away.
    pub(crate) lit: Lit<'a>,
    pub(crate) lamps: &'a ByRow<'a, Lamp>,
    pub(crate) occluders: &'a ByRow<'a, Occluder>,
    pub(crate) rain: Option<Rain<'a>>,
    pub(crate) target: &'a Target,
    /// Of every triangle that is seen: the place of its surface, and 1; 0 for none.
    pub(crate) places: &'a [u32],
    pub(crate) surfaces: &'a [Surface],
}

impl Painter<'_> {
    /// Writes all rows, which begin `pitch_bytes` from each other.
    #[inline(always)]
    pub(crate) fn paint<S: Simd>(&self, simd: S, (out, pitch_bytes): (&mut [u8], usize)) {
        let mut waiting = [Eight::default(); KINDS];
        let mut out = Out { bytes: out, pitch_bytes, first_row: self.target.first_row };
        let step = if self.lit.quality == Quality::Low { 2 * LANES } else { LANES };
        for row in self.target.first_row..self.target.first_row + self.target.row_count {
            for at in (0..self.target.width_px as usize).step_by(step) {
                if !self.paint_alike(simd, (row, at), &mut out) {
                    self.paint_mixed(simd, (row, at), &mut waiting, &mut out);
                }
            }
        }
        for (kind, mut eight) in waiting.into_iter().enumerate() {
            if eight.count > 0 {
                eight.fill_up();
                self.finish(simd, kind, &eight, &mut out);
            }
        }
    }

    /// Paints neighbours that all show one triangle; whether they do.
    #[inline(always)]
    fn paint_alike<S: Simd>(&self, simd: S, (row, at): (u32, usize), out: &mut Out<'_>) -> bool {
        let (nearness, ids) = self.target.row(row);
        let is_low = self.lit.quality == Quality::Low;
        let count = if is_low { 2 * LANES } else { LANES };
        let (Some(ids), Some(nearness)) = (ids.get(at..at + count), nearness.get(at..at + count))
        else {
            return false;
        };
        let first = ids[0];
        if at + count > self.target.width_px as usize || ids.iter().any(|id| *id != first) {
            return false;
        }
        let step = if is_low { 2 } else { 1 };
        let mut eight = Eight {
            rows: [row; LANES],
            surfaces: [self.surface(first); LANES],
            is_double: [is_low; LANES],
            ..Eight::default()
        };
        for lane in 0..LANES {
            eight.columns[lane] = (at + lane * step) as u32;
            eight.nearness[lane] = nearness[lane * step];
        }
        self.finish(simd, self.kind(eight.surfaces[0]), &eight, out);
        true
    }

    /// Has pixels wait for others of their kind, and paints those that are eight.
    #[inline(always)]
    fn paint_mixed<S: Simd>(
        &self,
        simd: S,
        (row, at): (u32, usize),
        waiting: &mut [Eight; KINDS],
        out: &mut Out<'_>,
    ) {
        let (nearness, ids) = self.target.row(row);
        let is_low = self.lit.quality == Quality::Low;
        let count = if is_low { 2 * LANES } else { LANES };
        let end = (at + count).min(self.target.width_px as usize);
        let (ids, nearness) = (ids.get(..end), nearness.get(..end));
        let (Some(ids), Some(nearness)) = (ids, nearness) else { return };
        let mut column = at;
        while column < end {
            let id = ids[column];
            let is_double = is_low && ids.get(column + 1) == Some(&id);
            let surface = self.surface(id);
            let kind = self.kind(surface);
            let eight = &mut waiting[kind];
            eight.push((column as u32, row), nearness[column], surface, is_double);
            if eight.count == LANES {
                self.finish(simd, kind, eight, out);
                eight.count = 0;
            }
            column += if is_double { 2 } else { 1 };
        }
    }

    /// Number of the surface that a pixel shows, and 1; 0 for the sky.
    #[inline(always)]
    fn surface(&self, id: u32) -> u32 {
        (id as usize).checked_sub(1).and_then(|at| self.places.get(at)).copied().unwrap_or(0)
    }

    #[inline(always)]
    fn kind(&self, surface: u32) -> usize {
        match self.looked_up(surface).map(|surface| surface.family) {
            None => SKY,
            Some(Family::Ground) => 1,
            Some(Family::Facade) => 2,
            Some(Family::Body) => 3,
        }
    }

    #[inline(always)]
    fn looked_up(&self, surface: u32) -> Option<&Surface> {
        self.surfaces.get((surface as usize).wrapping_sub(1))
    }

    /// Shades eight pixels and writes them.
    #[inline(never)]
    fn finish<S: Simd>(&self, simd: S, kind: usize, eight: &Eight, out: &mut Out<'_>) {
        let colours = match kind {
            SKY => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, None),
            ),
            1 => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, Some(Family::Ground)),
            ),
            2 => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, Some(Family::Facade)),
            ),
            _ => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, Some(Family::Body)),
            ),
        };
        out.put(eight, colours);
    }

    /// Colours of eight pixels as the display wants them, packed.
    #[inline(always)]
    fn shade<S: Simd>(&self, simd: S, eight: &Eight, family: Option<Family>) -> [u32; LANES] {
        let column = f32x8::load_array(simd, eight.columns.map(|column| column as f32)) + 0.5;
        let row = f32x8::load_array(simd, eight.rows.map(|row| row as f32)) + 0.5;
        let (across, up) = (self.rays.across_at(column), self.rays.up_at(simd, row));
        let ray = self.rays.through(simd, across, up);
        let length = ray.norm();
        let direction = ray.scaled(splat(simd, 1.0) / length);
        let lamps = self.lamps.of_rows(&eight.rows);
        let occluders = self.occluders.of_rows(&eight.rows);
        let lit = Lit { lamps, occluders, ..self.lit };
        let radiance = match family {
            None => sky(simd, &lit, direction),
            Some(family) => {
                let depth_m = splat(simd, 1.0) / f32x8::load_array(simd, eight.nearness);
                let eye_m = V8::splat(simd, self.rays.view.eye_m);
                let place_m = ray.scaled(depth_m).plus(eye_m);
                let distance_m = depth_m * length;
                let pixel = self.rays.parts.across;
                let sight = Sight { place_m, distance_m, direction, pixel };
                let looks = self.looks(simd, eight, place_m);
                let colour = match family {
                    Family::Ground => ground(simd, &lit, &sight, &looks),
                    Family::Facade => facade(simd, &lit, &sight, &looks),
                    Family::Body => body(simd, &lit, &sight, &looks),
                };
                let above_m = place_m.z - self.rays.view.eye_m[2];
                lit.light.hazed(simd, colour, distance_m, above_m)
            }
        };
        let mut shown = lit.light.displayed(simd, radiance);
        if let Some(rain) = &self.rain {
            let by = 0.5 / self.rays.parts.half_height;
            shown = rain.over(simd, shown, across * by, up * -by);
        }
        packed(simd, shown)
    }

    #[inline(always)]
    fn looks<S: Simd>(&self, simd: S, eight: &Eight, place_m: V8<S>) -> Looks<S> {
        let Some(first) = self.looked_up(eight.surfaces[0]) else { return Looks::nothing(simd) };
        if eight.surfaces.iter().all(|surface| *surface == eight.surfaces[0]) {
            return Looks::of_one(simd, first, place_m);
        }
        let each = eight.surfaces.map(
            #[inline(always)]
            |surface| self.looked_up(surface).unwrap_or(first),
        );
        Looks::of_each(simd, &each, place_m)
    }
}

/// Where colours go.
struct Out<'a> {
    bytes: &'a mut [u8],
    pitch_bytes: usize,
    first_row: u32,
}

impl Out<'_> {
    fn put(&mut self, eight: &Eight, colours: [u32; LANES]) {
        for (lane, colour) in colours.into_iter().enumerate() {
            let row = (eight.rows[lane] - self.first_row) as usize;
            let at = row * self.pitch_bytes + eight.columns[lane] as usize * PIXEL_BYTES;
            if let Some(slot) = self.bytes.get_mut(at..at + PIXEL_BYTES) {
                slot.copy_from_slice(&colour.to_le_bytes());
            }
            if eight.is_double[lane]
                && let Some(slot) = self.bytes.get_mut(at + PIXEL_BYTES..at + 2 * PIXEL_BYTES)
            {
                slot.copy_from_slice(&colour.to_le_bytes());
            }
        }
    }
}
