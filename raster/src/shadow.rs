//! How near to the sun the first thing on each of its rays is.

use std::sync::atomic::{AtomicU64, Ordering};

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x8};

use crate::choose::Prospect;
use crate::draw::{Drawing, Screen, draw};
use crate::scene::Placed;
use crate::target::Target;
use crate::view::SunView;

/// What everything is put back by, in its steepest change in a pixel, so that it does not shadow
/// itself.
pub const SHADOW_SLOPE: f32 = 1.5;

/// Things of several levels may be off by so much on the map, in its pixels.
pub const SHADOW_ERROR_PX_MAX: f32 = 1.0;

/// What a line that is copied on its own costs, in pixels of one that is copied with others.
const COPY_PX: u32 = 32;

/// A map of what the sun sees.
#[derive(Debug)]
pub struct ShadowMap {
    pub(crate) view: SunView,
    /// Width of a pixel of the map.
    pub(crate) pixel_m: f32,
    target: Target,
    /// Another one for every map that has a content of its own.
    number: u64,
    /// The map that this one is a copy of, but for what was added since.
    base: Option<u64>,
    /// First and last column, first and last line of what was added since.
    touched: Vec<[u32; 4]>,
}

/// Numbers of maps so far.
static NUMBERS: AtomicU64 = AtomicU64::new(0);

impl ShadowMap {
    /// Nothing on it.
    pub fn empty(view: SunView) -> Self {
        let mut target = Target::default();
        target.clear(view.side_px, 0..view.side_px, false);
        let [x, y, z, _] = view.right;
        let half_m = 1.0 / (x * x + y * y + z * z).sqrt();
        let pixel_m = 2.0 * half_m / view.side_px as f32;
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        Self { view, pixel_m, target, number, base: None, touched: Vec::new() }
    }

    /// Adds what throws shadows, both sides of everything.
    pub fn add(
        &mut self,
        level: Level,
        placed: &[Placed<'_>],
        is_hidden: Option<&(dyn Fn(u32) -> bool + Sync)>,
    ) {
        let prospect = Prospect::new(level, &self.view.projection(), (placed, SHADOW_ERROR_PX_MAX));
        let drawing = Drawing { placed, prospect: &prospect, is_hidden, slope: SHADOW_SLOPE };
        draw(level, &drawing, &mut Screen::default(), &mut self.target, &mut Vec::new());
        self.number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        let boxes = prospect.boxes(placed);
        self.touched.extend(boxes.filter_map(|ends| on_map(ends, self.view.side_px)));
    }

    /// As which the sun sees it.
    pub fn view(&self) -> &SunView {
        &self.view
    }

    /// The same map once more, in the memory of an older one. If that was a copy of the same map,
    /// only what was added is taken off again.
    pub fn copy_from(&mut self, other: &Self) {
        let stride = other.target.stride;
        let px = |[left, right, top, bottom]: &[u32; 4]| {
            (right - left + COPY_PX) as usize * (bottom - top + 1) as usize
        };
        let is_base = self.base == Some(other.number)
            && self.touched.iter().map(px).sum::<usize>() < other.target.nearness.len();
        if is_base {
            for [left, right, top, bottom] in &self.touched {
                for line in *top..=*bottom {
                    let first = line as usize * stride;
                    let range = first + *left as usize..first + *right as usize + 1;
                    if let (Some(own), Some(others)) = (
                        self.target.nearness.get_mut(range.clone()),
                        other.target.nearness.get(range),
                    ) {
                        own.copy_from_slice(others);
                    }
                }
            }
        } else {
            self.view.clone_from(&other.view);
            self.pixel_m = other.pixel_m;
            let mut nearness = std::mem::take(&mut self.target.nearness);
            nearness.clear();
            nearness.extend_from_slice(&other.target.nearness);
            self.target = Target::default();
            self.target.stride = other.target.stride;
            self.target.width_px = other.target.width_px;
            self.target.first_row = other.target.first_row;
            self.target.row_count = other.target.row_count;
            self.target.nearness = nearness;
        }
        self.touched.clear();
        self.base = Some(other.number);
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        self.target.nearness.len() * size_of::<f32>()
    }

    /// What is at columns and lines.
    #[inline(always)]
    pub(crate) fn tap<S: Simd>(&self, simd: S, column: f32x8<S>, line: f32x8<S>) -> f32x8<S> {
        let places = line * self.target.stride as f32 + column;
        let map = &self.target.nearness;
        let tap = |place: f32| map.get(place as usize).copied().unwrap_or(1.0);
        f32x8::load_array(simd, places.to_array().map(tap))
    }

    /// Four neighbours from a column and a line on: left to right, then the line below.
    #[inline(always)]
    pub(crate) fn taps<S: Simd>(&self, simd: S, column: f32x8<S>, line: f32x8<S>) -> [f32x8<S>; 4] {
        let (columns, lines) = (column.to_array(), line.to_array());
        let stride = self.target.stride;
        let mut taps = [[1.0f32; 8]; 4];
        for (lane, (line, column)) in lines.into_iter().zip(columns).enumerate() {
            let at = line as usize * stride + column as usize;
            let map = &self.target.nearness;
            if let (Some(upper), Some(lower)) =
                (map.get(at..at + 2), map.get(at + stride..at + stride + 2))
            {
                taps[0][lane] = upper[0];
                taps[1][lane] = upper[1];
                taps[2][lane] = lower[0];
                taps[3][lane] = lower[1];
            }
        }
        let [a, b, c, d] = taps;
        [
            f32x8::load_array(simd, a),
            f32x8::load_array(simd, b),
            f32x8::load_array(simd, c),
            f32x8::load_array(simd, d),
        ]
    }
}

/// Whole pixels of a map that a box from a first to a last column and line may reach.
fn on_map([left, right, top, bottom]: [f32; 4], side_px: u32) -> Option<[u32; 4]> {
    let last = side_px as f32 - 1.0;
    let ends = [left - 1.0, right + 1.0, top - 1.0, bottom + 1.0];
    // What is no number is all of the map.
    let [left, top] = [ends[0], ends[2]].map(|end| if end > 0.0 { end } else { 0.0 });
    let [right, bottom] = [ends[1], ends[3]].map(|end| if end < last { end } else { last });
    (left <= right && top <= bottom).then_some([left, right, top, bottom].map(|end| end as u32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Corner, Model};

    /// Goal: a map in the memory of another one is as good as a new one. Method: a copy that had
    /// something added is made a copy again, of the same map and of another one.
    #[test]
    fn a_copy_in_old_memory_is_the_same_map() {
        let corner = |x: f32, y: f32| Corner { position: [x, y, 0.0], ..Corner::default() };
        let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)];
        let model = Model::new(corners, &[[0, 1, 2]], &[]);
        let at = |x: f32, y: f32, z: f32| Placed {
            model: &model,
            world_from_model: [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]],
            tints: [[255; 4]; 4],
            label: 0,
        };
        let view = SunView {
            right: [0.1, 0.0, 0.0, 0.0],
            up: [0.0, 0.1, 0.0, 0.0],
            depth: [0.0, 0.0, -0.05, 0.5],
            side_px: 64,
        };
        let of = |placed: &[Placed<'_>]| {
            let mut map = ShadowMap::empty(view.clone());
            map.add(Level::new(), placed, None);
            map
        };
        let base = of(&[at(0.0, 0.0, 0.0)]);
        let other = of(&[at(-8.0, 3.0, 1.0)]);
        let mut copy = ShadowMap::empty(view.clone());
        for (from, added) in [
            (&base, at(4.0, 4.0, 2.0)),
            (&base, at(-9.7, -9.7, 1.0)),
            (&other, at(0.0, 0.3, 5.0)),
            (&base, at(0.0, 0.0, 1.0)),
        ] {
            copy.copy_from(from);
            assert!(copy.target.nearness == from.target.nearness);
            let seen = |map: &ShadowMap| map.target.nearness.iter().filter(|n| **n > 0.0).count();
            assert!(seen(&copy) > 5);
            copy.add(Level::new(), &[added], None);
            assert!(copy.target.nearness != from.target.nearness);
        }
    }
}
