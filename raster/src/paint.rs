//! Colours of what a canvas shows: pixels of one kind of surface together, eight at a time,
//! wherever they are in the picture.

mod out;

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use crate::coat::Coat;
use crate::lamp::Lamp;
use crate::light::Lit;
use crate::occluder::Occluder;
use crate::pixels::{Rays, packed};
use crate::quality::Quality;
use crate::rows::ByRow;
use crate::scene::Family;
use crate::shade::{Coated, Inside, Rain, Sight, body, facade, ground, sky};
use crate::surface::{Looks, Surface};
use crate::target::Target;
use crate::vector::{LANES, V8, splat};

use out::Out;

/// Families of surfaces, those with a coat, and the sky.
const KINDS: usize = 5;
const SKY: usize = 0;
const GROUND: usize = 1;
const FACADE: usize = 2;
const BODY: usize = 3;
const COATED: usize = 4;

/// In the place of what a pixel shows: it was painted with the row above it.
const PAINTED: u32 = u32::MAX;

/// Pixels beside each other that show one triangle.
struct Run {
    row: u32,
    columns: Range<usize>,
    /// Number of the triangle.
    id: u32,
    /// What they show.
    surface: u32,
    kind: usize,
}

/// What a row shows, and the one below it if both share colours.
struct Row<'a> {
    nearness: &'a [f32],
    below: &'a mut [u32],
}

impl Row<'_> {
    /// Whether all of some pixels below show a triangle, too. If so they count as painted.
    #[inline(always)]
    fn takes_below(&mut self, columns: Range<usize>, id: u32) -> bool {
        let Some(below) = self.below.get_mut(columns) else { return false };
        let is_alike = below.iter().fold(true, |is_alike, other| is_alike & (*other == id));
        if is_alike {
            below.fill(PAINTED);
        }
        is_alike
    }
}

/// Eight pixels that are shaded together.
#[derive(Clone, Copy, Debug, Default)]
struct Eight {
    /// Whole numbers.
    columns: [f32; LANES],
    /// Whole numbers.
    rows: [f32; LANES],
    nearness: [f32; LANES],
    /// What they show; all of one family.
    surfaces: [u32; LANES],
    /// How many pixels from each to the right get its colour.
    widths: [usize; LANES],
    /// How many rows from each downwards do.
    heights: [u32; LANES],
    count: usize,
}

impl Eight {
    #[inline(always)]
    fn push(
        &mut self,
        (column, row): (usize, u32),
        (nearness, surface): (f32, u32),
        (width, height): (usize, u32),
    ) {
        let at = self.count % LANES;
        self.columns[at] = column as f32;
        self.rows[at] = row as f32;
        self.nearness[at] = nearness;
        self.surfaces[at] = surface;
        self.widths[at] = width;
        self.heights[at] = height;
        self.count += 1;
    }

    /// Those that are missing as copies of the first one.
    fn fill_up(&mut self) {
        for at in self.count..LANES {
            self.columns[at] = self.columns[0];
            self.rows[at] = self.rows[0];
            self.nearness[at] = self.nearness[0];
            self.surfaces[at] = self.surfaces[0];
            self.widths[at] = self.widths[0];
            self.heights[at] = self.heights[0];
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
    /// That are wanted.
    pub(crate) rows: Range<u32>,
    /// Of every triangle that is seen: the place of its surface, and 1; 0 for none.
    pub(crate) places: &'a [u32],
    pub(crate) surfaces: &'a [Surface],
    pub(crate) coats: &'a [Coat],
}

impl Painter<'_> {
    /// Writes all rows that are wanted, which begin `pitch_bytes` from each other. Rows of low
    /// quality share colours by twos, the first of which are even.
    #[inline(always)]
    pub(crate) fn paint<S: Simd>(&self, simd: S, (out, pitch_bytes): (&mut [u8], usize)) {
        let mut waiting = [Eight::default(); KINDS];
        let mut out = Out { bytes: out, pitch_bytes, first_row: self.rows.start };
        let is_low = self.lit.quality == Quality::Low;
        let Range { start, end } = self.rows;
        let first = if is_low { start & !1 } else { start };
        let (mut own, mut below) = (Vec::new(), Vec::new());
        for row in first..end {
            let (nearness, ids) = self.target.row(row);
            std::mem::swap(&mut own, &mut below);
            below.clear();
            if is_low && row.is_multiple_of(2) && row + 1 < end {
                below.extend_from_slice(self.target.row(row + 1).1);
            }
            let ids = if own.is_empty() { ids } else { &own };
            let row_of = Row { nearness, below: &mut below };
            self.paint_row(simd, (row, ids), row_of, &mut waiting, &mut out);
        }
        for (kind, mut eight) in waiting.into_iter().enumerate() {
            if eight.count > 0 {
                eight.fill_up();
                let colours = self.finish(simd, kind, &eight);
                out.put(&eight, &colours);
            }
        }
    }

    #[inline(always)]
    fn paint_row<S: Simd>(
        &self,
        simd: S,
        (row, ids): (u32, &[u32]),
        mut shows: Row<'_>,
        waiting: &mut [Eight; KINDS],
        out: &mut Out<'_>,
    ) {
        let width = self.target.width_px as usize;
        let mut column = 0;
        while let Some(id) = ids.get(column).copied().filter(|_| column < width) {
            let end = (column + alike(simd, id, &ids[column..])).min(width);
            if id != PAINTED {
                let surface = self.surface(id);
                let kind = self.kind(surface);
                let run = Run { row, columns: column..end, id, surface, kind };
                self.paint_run(simd, run, &mut shows, waiting, out);
            }
            column = end;
        }
    }

    /// Paints pixels of one triangle, eight at a time; has the rest wait for others of their kind,
    /// and paints those that are eight.
    #[inline(always)]
    fn paint_run<S: Simd>(
        &self,
        simd: S,
        Run { row, columns: Range { start, end }, id, surface, kind }: Run,
        shows: &mut Row<'_>,
        waiting: &mut [Eight; KINDS],
        out: &mut Out<'_>,
    ) {
        let step = if self.lit.quality == Quality::Low { 2 } else { 1 };
        // Nothing on them changes with every row.
        let is_smooth = kind == SKY || kind == GROUND;
        let nearness = shows.nearness;
        let mut column = start;
        // Pairs begin at even columns, so that upright edges on a surface stay upright.
        if step == 2
            && start % 2 == 1
            && let Some(nearness) = nearness.get(start)
        {
            self.wait(simd, ((start, row), (1, 1)), (*nearness, surface), (kind, waiting), out);
            column += 1;
        }
        while let Some(nearness) = nearness.get(column..column + LANES * step)
            && column + LANES * step <= end
        {
            let mut eight =
                Eight { rows: [row as f32; LANES], surfaces: [surface; LANES], ..Eight::default() };
            for lane in 0..LANES {
                eight.columns[lane] = column as f32 + (lane * step) as f32;
                eight.nearness[lane] = nearness[lane * step];
            }
            let colours = self.finish(simd, kind, &eight);
            if step == 1 {
                out.put_run::<1>((column, row), &colours);
            } else {
                out.put_run::<2>((column, row), &colours);
                if is_smooth && shows.takes_below(column..column + LANES * step, id) {
                    out.put_run::<2>((column, row + 1), &colours);
                }
            }
            column += LANES * step;
        }
        while let Some(nearness) = nearness.get(column).filter(|_| column < end) {
            let width = step.min(end - column);
            let has_below = is_smooth && width == 2 && shows.takes_below(column..column + 2, id);
            let size = (width, 1 + u32::from(has_below));
            self.wait(simd, ((column, row), size), (*nearness, surface), (kind, waiting), out);
            column += width;
        }
    }

    /// Has a pixel, and those right of and below it that get its colour, wait for others of its
    /// kind; paints them once they are eight.
    #[inline(always)]
    fn wait<S: Simd>(
        &self,
        simd: S,
        (place, size): ((usize, u32), (usize, u32)),
        shows: (f32, u32),
        (kind, waiting): (usize, &mut [Eight; KINDS]),
        out: &mut Out<'_>,
    ) {
        let Some(eight) = waiting.get_mut(kind) else { return };
        eight.push(place, shows, size);
        if eight.count == LANES {
            let colours = self.finish(simd, kind, eight);
            out.put(eight, &colours);
            eight.count = 0;
        }
    }

    /// Number of the surface that a pixel shows, and 1; 0 for the sky.
    #[inline(always)]
    fn surface(&self, id: u32) -> u32 {
        (id as usize).checked_sub(1).and_then(|at| self.places.get(at)).copied().unwrap_or(0)
    }

    #[inline(always)]
    fn kind(&self, surface: u32) -> usize {
        match self.looked_up(surface) {
            None => SKY,
            Some(surface) if surface.coat != 0 => COATED,
            Some(surface) => match surface.family {
                Family::Ground => GROUND,
                Family::Facade => FACADE,
                Family::Body => BODY,
            },
        }
    }

    #[inline(always)]
    fn looked_up(&self, surface: u32) -> Option<&Surface> {
        self.surfaces.get((surface as usize).wrapping_sub(1))
    }

    /// Colours of eight pixels of a kind.
    #[inline(never)]
    fn finish<S: Simd>(&self, simd: S, kind: usize, eight: &Eight) -> [u32; LANES] {
        match kind {
            SKY => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, SKY),
            ),
            GROUND => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, GROUND),
            ),
            FACADE => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, FACADE),
            ),
            BODY => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, BODY),
            ),
            _ => simd.vectorize(
                #[inline(always)]
                || self.shade(simd, eight, COATED),
            ),
        }
    }

    /// Colours of eight pixels as the display wants them, packed.
    #[inline(always)]
    fn shade<S: Simd>(&self, simd: S, eight: &Eight, kind: usize) -> [u32; LANES] {
        let column = f32x8::load_array(simd, eight.columns) + 0.5;
        let row = f32x8::load_array(simd, eight.rows) + 0.5;
        let (across, up) = (self.rays.across_at(column), self.rays.up_at(simd, row));
        let ray = self.rays.through(simd, across, up);
        let length = ray.norm();
        let direction = ray.scaled(splat(simd, 1.0) / length);
        let lamps = self.lamps.of_rows(&eight.rows);
        let occluders = self.occluders.of_rows(&eight.rows);
        let lit = Lit { lamps, occluders, ..self.lit };
        let radiance = match kind {
            SKY => sky(simd, &lit, direction),
            kind => {
                let depth_m = splat(simd, 1.0) / f32x8::load_array(simd, eight.nearness);
                let eye_m = V8::splat(simd, self.rays.view.eye_m);
                let place_m = ray.scaled(depth_m).plus(eye_m);
                let distance_m = depth_m * length;
                let pixel = self.rays.parts.across;
                let sight = Sight { place_m, distance_m, direction, pixel };
                let looks = self.looks(simd, eight, place_m);
                let surfaces = eight.surfaces.map(|surface| self.looked_up(surface));
                let colour = match kind {
                    GROUND => ground(simd, &lit, &sight, &looks),
                    FACADE => facade(simd, &lit, &sight, &looks),
                    BODY => {
                        let inside = Inside::of(simd, surfaces, &sight);
                        body(simd, &lit, (&sight, &looks), inside)
                    }
                    _ => {
                        let coats = surfaces.map(|surface| self.coat(surface?));
                        let coated = Coated { surfaces, coats, view: self.rays.view, depth_m };
                        coated.colour(simd, &lit, &sight, &looks)
                    }
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

    fn coat(&self, surface: &Surface) -> Option<&Coat> {
        self.coats.get(usize::from(surface.coat).checked_sub(1)?)
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

/// How many of some numbers, from the first on, are this one.
#[inline(always)]
fn alike<S: Simd>(simd: S, id: u32, ids: &[u32]) -> usize {
    let mut count = 0;
    while let Some(eight) = ids.get(count..count + LANES) {
        let same = u32x8::from_slice(simd, eight).simd_eq(u32x8::splat(simd, id)).to_bitmask();
        let same = same.trailing_ones() as usize;
        if same < LANES {
            return count + same;
        }
        count += LANES;
    }
    count + ids.iter().skip(count).take_while(|other| **other == id).count()
}
