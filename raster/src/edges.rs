//! Softer edges: where a side of a triangle passes between two pixels, the one that it cuts takes
//! on some of the other's colour, as much as lies beyond the side.
//!
//! A pixel's colour follows from itself and its four neighbours: a picture is the same in whatever
//! parts it is drawn.

mod outline;

use std::ops::Range;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x8};

use crate::draw::Seen;
use crate::pixels::PIXEL_BYTES;
use crate::scene::Scene;
use crate::target::Target;
use crate::vector::LANES;
use crate::view::Projection;

use outline::{Beyond, Outline, across, joined_end};

/// Edges between colours that differ by no more than this in any channel are soft enough.
const ALIKE: u8 = 6;
/// From the middle of a pixel to its border.
const HALF_PX: f32 = 0.5;
/// Shares of a neighbour's colour are counted in so many parts.
const PARTS: f32 = 256.0;

/// Room that is used again from one picture to the next.
#[derive(Debug, Default)]
pub(crate) struct Room {
    /// Colours before edges are softened.
    colours: Vec<u8>,
    /// By id, 1 less: of triangles that somebody asked for.
    outlines: Vec<Option<Outline>>,
    /// Of each pixel that is wanted.
    mixes: Vec<Mix>,
    /// Pixels that get something of a neighbour.
    mixed: Vec<u32>,
}

/// What a pixel gets of which neighbour.
#[derive(Clone, Copy, Debug, Default)]
struct Mix {
    parts: u8,
    /// Steps to the right and downwards.
    from: (i8, i8),
}

/// What is seen where.
pub(crate) struct Edges<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) projection: Projection,
    pub(crate) target: &'a Target,
    pub(crate) seen: &'a [Seen],
    /// That are wanted.
    pub(crate) rows: Range<u32>,
}

impl Room {
    /// Room for the colours of so many rows.
    pub(crate) fn colours(&mut self, width_px: u32, rows: usize) -> (&mut [u8], usize) {
        let pitch_bytes = width_px as usize * PIXEL_BYTES;
        self.colours.resize(pitch_bytes * rows, 0);
        (&mut self.colours, pitch_bytes)
    }
}

impl Edges<'_> {
    /// The rows to be painted: those that are wanted and their neighbours.
    pub(crate) fn rows_around(wanted: &Range<u32>, height_px: u32) -> Range<u32> {
        wanted.start.saturating_sub(1)..(wanted.end + 1).min(height_px)
    }

    /// Writes the rows that are wanted. In the room are the colours of these and of the rows beside
    /// them, from `first_row` on.
    #[inline(always)]
    pub(crate) fn soften<S: Simd>(
        &self,
        simd: S,
        room: &mut Room,
        first_row: u32,
        (out, pitch_bytes): (&mut [u8], usize),
    ) {
        let width = self.target.width_px as usize;
        let Room { colours, outlines, mixes, mixed } = room;
        outlines.clear();
        outlines.resize(self.seen.len(), None);
        mixes.clear();
        mixes.resize(width * self.rows.len(), Mix::default());
        mixed.clear();
        let colours = Colours { pixels: colours.as_chunks().0, width, first_row };
        let local = (u32::MAX, self.projection);
        let mut found = Found { edges: self, colours, local, outlines, mixes, mixed };
        let end = first_row + (colours.pixels.len() / width.max(1)) as u32;
        for row in first_row..end {
            if self.rows.contains(&row) {
                found.beside(simd, row, row, 1);
            }
            if row + 1 < end {
                found.beside(simd, row, row + 1, 0);
            }
        }
        let lines = out.chunks_mut(pitch_bytes).zip(self.rows.clone());
        for (line, row) in lines {
            let pixels = line.as_chunks_mut::<PIXEL_BYTES>().0.iter_mut();
            pixels.zip(colours.row(row)).for_each(|(pixel, colour)| *pixel = *colour);
        }
        for at in &*mixed {
            let at = *at as usize;
            let (column, line) = (at % width, at / width);
            let Some(Mix { parts, from: (right, down) }) = mixes.get(at).copied() else { continue };
            let row = self.rows.start + line as u32;
            let other = column.wrapping_add_signed(isize::from(right));
            let other = (other, row.wrapping_add_signed(i32::from(down)));
            let start = line * pitch_bytes + column * PIXEL_BYTES;
            if let Some(pixel) = out.get_mut(start..).and_then(<[u8]>::first_chunk_mut) {
                let [own, other] = [(column, row), other].map(|place| colours.at(place));
                *pixel = mixture(own, other, f32::from(parts) / PARTS);
            }
        }
    }
}

/// Colours of some rows.
#[derive(Clone, Copy)]
struct Colours<'a> {
    pixels: &'a [[u8; PIXEL_BYTES]],
    width: usize,
    first_row: u32,
}

impl Colours<'_> {
    fn row(&self, row: u32) -> &[[u8; PIXEL_BYTES]] {
        let first = row.saturating_sub(self.first_row) as usize * self.width;
        self.pixels.get(first..first + self.width).unwrap_or_default()
    }

    fn at(&self, (column, row): (usize, u32)) -> [u8; PIXEL_BYTES] {
        self.row(row).get(column).copied().unwrap_or_default()
    }
}

/// A pixel and what it shows.
type Shown = ((usize, u32), u32);

/// Edges as they are found.
struct Found<'a> {
    edges: &'a Edges<'a>,
    colours: Colours<'a>,
    /// The model that was asked for last, by its place in the scene, as it is seen.
    local: (u32, Projection),
    outlines: &'a mut [Option<Outline>],
    mixes: &'a mut [Mix],
    mixed: &'a mut Vec<u32>,
}

impl Found<'_> {
    /// Holds each pixel of a row against that of another one, so many columns to the right.
    #[inline(always)]
    fn beside<S: Simd>(&mut self, simd: S, row: u32, other_row: u32, right: usize) {
        let edges = self.edges;
        let (_, own) = edges.target.row(row);
        let (_, other) = edges.target.row(other_row);
        let count = (edges.target.width_px as usize).saturating_sub(right);
        let other = other.get(right..).unwrap_or_default();
        let mut column = 0;
        while column < count {
            let (Some(one), Some(two)) =
                (own.get(column..column + LANES), other.get(column..column + LANES))
            else {
                break;
            };
            let alike = u32x8::from_slice(simd, one).simd_eq(u32x8::from_slice(simd, two));
            let mut differing = !alike.to_bitmask() as u8;
            while differing != 0 {
                let at = column + differing.trailing_zeros() as usize;
                differing &= differing - 1;
                if at < count {
                    self.between((at, row), (at + right, other_row));
                }
            }
            column += LANES;
        }
        for at in column..count {
            if own.get(at) != other.get(at) {
                self.between((at, row), (at + right, other_row));
            }
        }
    }

    /// Two neighbours that show different triangles.
    fn between(&mut self, one: (usize, u32), two: (usize, u32)) {
        let (own, other) = (self.colours.at(one), self.colours.at(two));
        if own.iter().zip(other).all(|(own, other)| own.abs_diff(other) <= ALIKE) {
            return;
        }
        let shown = |(column, row): (usize, u32)| {
            let (nearness, ids) = self.edges.target.row(row);
            Some((*nearness.get(column)?, *ids.get(column)?))
        };
        let (Some((near_one, id_one)), Some((near_two, id_two))) = (shown(one), shown(two)) else {
            return;
        };
        // What is nearer ends there; or, where it goes on below the other, that one does.
        let (nearer, farther) = if near_one >= near_two {
            ((one, id_one), (two, id_two))
        } else {
            ((two, id_two), (one, id_one))
        };
        let share = self.ends(nearer, farther);
        let share = share.or_else(|| Some(1.0 - self.ends(farther, nearer)?));
        match share {
            Some(share) if share < HALF_PX => self.mix(nearer.0, farther.0, HALF_PX - share),
            Some(share) => self.mix(farther.0, nearer.0, share - HALF_PX),
            None => {}
        }
    }

    /// The share of the way from the middle of one pixel to that of another one at which what the
    /// first one shows ends; `None` if it does not.
    fn ends(&mut self, (from, id): Shown, (to, other): Shown) -> Option<f32> {
        let middle = |(column, row): (usize, u32)| [column as f32 + HALF_PX, row as f32 + HALF_PX];
        let way = [middle(from), middle(to)];
        let at = self.know(id)?;
        let seen = self.edges.seen.get(at)?;
        let placed = self.edges.scene.placed.get(seen.placed as usize)?;
        let own = self.outlines.get_mut(at)?.as_mut()?;
        let leaves = own.leaves(way);
        let beyond = leaves.map(|(side, _)| {
            *own.beyond[side].get_or_insert_with(|| across(placed.model, seen.triangle, side))
        });
        let own = *own;
        if let Some(Beyond::Triangle(next)) = beyond
            && self.shows(other, (seen.placed, next))
        {
            return leaves.map(|(_, share)| share);
        }
        let other = self.know(other).and_then(|at| Some(self.outlines.get(at)?.as_ref()?.nearness));
        if let Some(met) = own.meets(other, way, (0.0, leaves.map_or(1.0, |(_, ends)| ends))) {
            return Some(met);
        }
        let (_, share) = leaves?;
        let Some(Beyond::Triangle(next)) = beyond else { return Some(share) };
        Some(joined_end(placed, self.local(seen.placed)?, (next, share), other, way))
    }

    /// Whether a triangle that is seen is this one of a model at this place of the scene.
    fn shows(&self, id: u32, triangle: (u32, u32)) -> bool {
        let seen = (id as usize).checked_sub(1).and_then(|at| self.edges.seen.get(at));
        seen.is_some_and(|seen| (seen.placed, seen.triangle) == triangle)
    }

    /// Works out the outline of a triangle if nobody has; its place among them.
    fn know(&mut self, id: u32) -> Option<usize> {
        let at = (id as usize).checked_sub(1)?;
        if self.outlines.get(at)?.is_none() {
            let seen = self.edges.seen.get(at)?;
            let placed = self.edges.scene.placed.get(seen.placed as usize)?;
            let outline = Outline::of(placed, self.local(seen.placed)?, seen.triangle);
            *self.outlines.get_mut(at)? = outline;
        }
        Some(at)
    }

    /// How a model at a place of the scene is seen.
    fn local(&mut self, place: u32) -> Option<&Projection> {
        if self.local.0 != place {
            let placed = self.edges.scene.placed.get(place as usize)?;
            self.local = (place, self.edges.projection.within(&placed.world_from_model));
        }
        Some(&self.local.1)
    }

    /// Has a pixel take this share of a neighbour's colour, unless it takes more of another one's.
    fn mix(&mut self, (column, row): (usize, u32), other: (usize, u32), share: f32) {
        if !self.edges.rows.contains(&row) {
            return;
        }
        let line = (row - self.edges.rows.start) as usize;
        let at = line * self.colours.width + column;
        let parts = (share * PARTS) as u8;
        let Some(mix) = self.mixes.get_mut(at).filter(|mix| mix.parts < parts) else { return };
        if mix.parts == 0 {
            self.mixed.push(at as u32);
        }
        let from = (other.0 as i64 - column as i64, i64::from(other.1) - i64::from(row));
        *mix = Mix { parts, from: (from.0 as i8, from.1 as i8) };
    }
}

/// Some of one colour and a share of another one. Squares stand for the light that they are.
fn mixture(own: [u8; 4], other: [u8; 4], share: f32) -> [u8; 4] {
    let mut mixture = own;
    for (own, other) in mixture.iter_mut().zip(other) {
        let [a, b] = [*own, other].map(f32::from);
        *own = ((a * a * (1.0 - share) + b * b * share).sqrt() + 0.5) as u8;
    }
    mixture
}
