//! What is seen in each pixel: how near, and which triangle.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::vector::{LANES, splat};

/// Nearness and triangle of every pixel of some rows; rows are filled up to a multiple of eight.
#[derive(Debug, Default)]
pub(crate) struct Target {
    pub(crate) stride: usize,
    pub(crate) width_px: u32,
    pub(crate) first_row: u32,
    pub(crate) row_count: u32,
    pub(crate) nearness: Vec<f32>,
    /// Place of the triangle in the list of those that are seen, and 1; 0 for none.
    pub(crate) ids: Vec<u32>,
    /// Squares of eight pixels a side, in rows; none if there are no ids.
    blocks: Vec<Block>,
}

/// What is known of a square of pixels.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// No pixel is less near than this.
    least: f32,
    /// Whether pixels have become nearer since.
    is_old: bool,
}

/// Nearness where nothing is.
pub(crate) const NOTHING: f32 = 0.0;

impl Target {
    /// Makes it empty, of this size.
    pub(crate) fn clear(&mut self, width_px: u32, rows: std::ops::Range<u32>, has_ids: bool) {
        self.stride = (width_px as usize).next_multiple_of(8);
        self.width_px = width_px;
        (self.first_row, self.row_count) = (rows.start, rows.len() as u32);
        let count = self.stride * rows.len();
        refill(&mut self.nearness, count, NOTHING);
        refill(&mut self.ids, if has_ids { count } else { 0 }, 0);
        let blocks = self.stride / LANES * rows.len().div_ceil(LANES);
        let block = Block { least: NOTHING, is_old: false };
        refill(&mut self.blocks, if has_ids { blocks } else { 0 }, block);
    }

    /// Notes that some of eight neighbours have become nearer.
    #[inline(always)]
    pub(crate) fn touch(&mut self, line: usize, at: usize) {
        let place = self.block(line, at);
        if let Some(block) = self.blocks.get_mut(place) {
            block.is_old = true;
        }
    }

    #[inline(always)]
    fn block(&self, line: usize, at: usize) -> usize {
        line / LANES * (self.stride / LANES) + at / LANES
    }

    /// Whether all pixels of a box, from a first to a last column and row, show what is at least so
    /// near: nothing that is less near is seen there.
    #[inline(always)]
    pub(crate) fn hides<S: Simd>(
        &mut self,
        simd: S,
        [left, right, top, bottom]: [f32; 4],
        nearness: f32,
    ) -> bool {
        let last_row = (self.first_row + self.row_count) as f32 - 1.0;
        let (left, right) = (left.max(0.0), right.min(self.width_px as f32 - 1.0));
        let (top, bottom) = (top.max(self.first_row as f32), bottom.min(last_row));
        if self.blocks.is_empty() || left > right || top > bottom {
            return false;
        }
        let first_row = self.first_row as usize;
        let [top, bottom] = [top as usize, bottom as usize].map(|row| (row - first_row) / LANES);
        for line in top..=bottom {
            for column in left as usize / LANES..=right as usize / LANES {
                if self.least(simd, (line * LANES, column * LANES), nearness) < nearness {
                    return false;
                }
            }
        }
        true
    }

    /// The least nearness in a square, or one that it is no less than if that is enough.
    #[inline(always)]
    fn least<S: Simd>(&mut self, simd: S, (line, at): (usize, usize), enough: f32) -> f32 {
        let place = self.block(line, at);
        let Some(Block { least, is_old }) = self.blocks.get(place).copied() else {
            return NOTHING;
        };
        if least >= enough || !is_old {
            return least;
        }
        let mut lowest = splat(simd, f32::INFINITY);
        for line in line..(line + LANES).min(self.row_count as usize) {
            let first = line * self.stride + at;
            if let Some(eight) = self.nearness.get(first..first + LANES) {
                lowest = lowest.min(f32x8::from_slice(simd, eight));
            }
        }
        let least = lowest.to_array().into_iter().fold(f32::INFINITY, f32::min);
        if let Some(block) = self.blocks.get_mut(place) {
            *block = Block { least, is_old: false };
        }
        least
    }

    /// Nearness and triangles of a row of the picture.
    pub(crate) fn row(&self, row: u32) -> (&[f32], &[u32]) {
        let first = (row - self.first_row) as usize * self.stride;
        let range = first..first + self.stride;
        (
            self.nearness.get(range.clone()).unwrap_or_default(),
            self.ids.get(range).unwrap_or_default(),
        )
    }
}

fn refill<T: Copy>(values: &mut Vec<T>, count: usize, value: T) {
    values.clear();
    values.resize(count, value);
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    const WIDTH: u32 = 20;

    /// Rows 4 to 15, all as near as this.
    fn filled(nearness: f32) -> Target {
        let mut target = Target::default();
        target.clear(WIDTH, 4..16, true);
        for line in 0..12 {
            for at in (0..24).step_by(LANES) {
                target.touch(line, at);
            }
        }
        target.nearness.fill(nearness);
        target
    }

    fn hides(target: &mut Target, ends: [f32; 4], nearness: f32) -> bool {
        dispatch!(Level::new(), simd => target.hides(simd, ends, nearness))
    }

    #[test]
    fn what_is_less_near_than_all_of_its_box_is_hidden_and_nothing_else() {
        let box_of_all = [-3.0, 40.0, 0.0, 99.0];
        assert!(hides(&mut filled(0.5), box_of_all, 0.4));
        assert!(!hides(&mut filled(0.5), box_of_all, 0.6), "it is nearer");
        let mut target = filled(0.5);
        target.nearness[9 * target.stride + 18] = 0.1;
        assert!(!hides(&mut target, [17.0, 19.0, 12.0, 14.0], 0.4), "a hole in its square");
        assert!(hides(&mut target, [0.0, 15.0, 12.0, 14.0], 0.4), "beside the hole");
    }

    #[test]
    fn nothing_is_hidden_where_nothing_is_or_outside_of_the_rows() {
        let mut target = filled(0.5);
        assert!(!hides(&mut target, [0.0, 19.0, 0.0, 2.0], 0.1));
        target.clear(WIDTH, 4..16, true);
        assert!(!hides(&mut target, [0.0, 19.0, 4.0, 15.0], 0.1));
        target.clear(WIDTH, 4..16, false);
        assert!(!hides(&mut target, [0.0, 19.0, 4.0, 15.0], 0.1), "without ids nothing is known");
    }
}
