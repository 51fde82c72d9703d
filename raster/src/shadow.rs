//! How near to the sun the first thing on each of its rays is.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x8};

use crate::draw::{Drawing, Placed, Work, draw};
use crate::target::Target;
use crate::view::SunView;

/// What everything is put back by, in its steepest change in a pixel, so that it does not shadow
/// itself.
const SLOPE: f32 = 1.5;

/// A map of what the sun sees.
#[derive(Debug)]
pub struct ShadowMap {
    pub(crate) view: SunView,
    /// Width of a pixel of the map.
    pub(crate) pixel_m: f32,
    target: Target,
}

impl ShadowMap {
    /// Nothing on it.
    pub fn empty(view: SunView) -> Self {
        let mut target = Target::default();
        target.clear(view.side_px, 0..view.side_px, false);
        let [x, y, z, _] = view.right;
        let half_m = 1.0 / (x * x + y * y + z * z).sqrt();
        let pixel_m = 2.0 * half_m / view.side_px as f32;
        Self { view, pixel_m, target }
    }

    /// Adds what throws shadows, both sides of everything.
    pub fn add(
        &mut self,
        level: Level,
        placed: &[Placed<'_>],
        is_hidden: Option<&(dyn Fn(u32) -> bool + Sync)>,
    ) {
        let projection = self.view.projection();
        let drawing = Drawing { projection: &projection, placed, is_hidden, slope: SLOPE };
        draw(level, &drawing, &mut Work::default(), &mut self.target, &mut Vec::new());
    }

    /// The same map once more, in the memory of an older one.
    pub fn copy_from(&mut self, other: &Self) {
        self.view.clone_from(&other.view);
        self.pixel_m = other.pixel_m;
        let Target { stride, width_px, first_row, row_count, .. } = other.target;
        let mut nearness = std::mem::take(&mut self.target.nearness);
        nearness.clear();
        nearness.extend_from_slice(&other.target.nearness);
        let ids = Vec::new();
        self.target = Target { stride, width_px, first_row, row_count, nearness, ids };
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> usize {
        self.target.nearness.len() * size_of::<f32>()
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
