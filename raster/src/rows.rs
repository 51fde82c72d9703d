//! What matters in some rows of a picture only.

use std::ops::Range;

use crate::vector::{V3, dot, sub};
use crate::view::View;

/// Something that matters within a ball.
pub(crate) trait Reaching {
    /// Its middle and radius, in metres.
    fn ball(&self) -> (V3, f32);

    /// Rows of a picture that it may matter in, and more.
    fn rows(&self, view: &View) -> Range<u32> {
        let (middle_m, reach_m) = self.ball();
        let from_eye = sub(middle_m, view.eye_m);
        let (ahead, up) = (dot(from_eye, view.forward), dot(from_eye, view.up));
        if ahead + reach_m <= view.near_m {
            return 0..0;
        }
        if ahead - reach_m <= view.near_m {
            return 0..view.height_px;
        }
        let slope = |edge: f32, outer: f32| {
            edge / if edge * outer > 0.0 { ahead - reach_m } else { ahead + reach_m }
        };
        let (highest, lowest) = (slope(up + reach_m, 1.0), slope(up - reach_m, -1.0));
        let height = view.height_px as f32;
        let row = |slope: f32| (0.5 - 0.5 * slope / view.half_extent[1]) * height;
        let first = (row(highest) - 1.0).clamp(0.0, height);
        let last = (row(lowest) + 2.0).clamp(0.0, height);
        first as u32..last as u32
    }
}

/// Those that may matter in rows of a picture. It makes no difference to a row if there are more.
pub(crate) struct ByRow<'a, T> {
    first_row: u32,
    all: Vec<&'a T>,
    by_row: Vec<Vec<&'a T>>,
}

impl<'a, T: Reaching> ByRow<'a, T> {
    /// Of the first so many.
    pub(crate) fn of(view: &View, (things, most): (&'a [T], usize), rows: Range<u32>) -> Self {
        let ranges: Vec<_> =
            things.iter().take(most).map(|thing| (thing.rows(view), thing)).collect();
        let of_row = |row: u32| {
            let there = ranges.iter().filter(|(rows, _)| rows.contains(&row));
            there.map(|(_, thing)| *thing).collect()
        };
        let is_there = |of: &Range<u32>| of.start < rows.end && rows.start < of.end;
        let all = ranges.iter().filter(|(of, _)| is_there(of)).map(|(_, thing)| *thing).collect();
        Self { first_row: rows.start, all, by_row: rows.map(of_row).collect() }
    }

    /// Those that may matter to pixels of these rows, which are whole numbers.
    #[inline(always)]
    pub(crate) fn of_rows(&self, rows: &[f32]) -> &[&'a T] {
        let alike = rows.split_first().filter(|(first, rest)| rest.iter().all(|row| row == *first));
        let of_row =
            alike.and_then(|(row, _)| self.by_row.get((*row as u32 - self.first_row) as usize));
        of_row.unwrap_or(&self.all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Ball(V3, f32);

    impl Reaching for Ball {
        fn ball(&self) -> (V3, f32) {
            (self.0, self.1)
        }
    }

    #[test]
    fn a_ball_matters_in_no_row_but_those_that_it_says() {
        let view = View {
            eye_m: [0.0, 0.0, 1.5],
            forward: [1.0, 0.0, 0.0],
            left: [0.0, 1.0, 0.0],
            up: [0.0, 0.0, 1.0],
            half_extent: [1.0, 0.5],
            width_px: 640,
            height_px: 360,
            near_m: 0.1,
        };
        let at = |x: f32, z: f32, reach_m: f32| Ball([x, 0.0, z], reach_m).rows(&view);
        // A ball of 5 m at 20 m spans 10 m of the 20 m that the picture is high there, and more.
        let middle = at(20.0, 1.5, 5.0);
        assert!(middle.start <= 90 && middle.start > 40, "{middle:?}");
        assert!(middle.end >= 270 && middle.end < 320, "{middle:?}");
        assert_eq!(at(3.0, 1.5, 5.0), 0..360);
        assert!(at(-9.0, 1.5, 5.0).is_empty());
        let high = at(20.0, 16.5, 5.0);
        assert!(high.start == 0 && high.end < 60, "{high:?}");
    }
}
