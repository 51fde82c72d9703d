//! What is seen in each pixel: how near, and which triangle.

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
