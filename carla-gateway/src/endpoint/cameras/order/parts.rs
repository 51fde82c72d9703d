//! As many pictures at a time as one job of a renderer may have.

use std::ops::Range;

use schemas::limits::{CAMERAS_PER_JOB_MAX, PIXELS_PER_JOB_MAX};
use schemas::{Camera, Error, ErrorCode};

use super::Ordered;

/// How much of a job is taken.
#[derive(Clone, Copy, Default)]
struct Load {
    pictures: usize,
    pixels: usize,
}

impl Load {
    fn of(cameras: &[Camera]) -> Self {
        let pixels = |camera: &Camera| camera.width_px as usize * camera.height_px as usize;
        Self { pictures: cameras.len(), pixels: cameras.iter().map(pixels).sum() }
    }

    /// Takes more, if there is room or nothing was taken before.
    fn takes(&mut self, more: Self) -> bool {
        let (pictures, pixels) = (self.pictures + more.pictures, self.pixels + more.pixels);
        let fits = pictures <= CAMERAS_PER_JOB_MAX && pixels <= PIXELS_PER_JOB_MAX;
        if fits || self.pictures == 0 {
            *self = Self { pictures, pixels };
            return true;
        }
        false
    }
}

/// All cameras, in order, as many together as one job can draw, at least one.
pub(super) fn parts_of(cameras: &[Ordered]) -> Vec<Range<usize>> {
    ranges(cameras.iter().map(|camera| Load::of(&camera.wanted)))
}

/// The jobs for the pictures of a part, the first one last. There is more than one only for a
/// camera whose pictures are together more than one job may have.
pub(super) fn jobs_of(cameras: &[Ordered]) -> Vec<Vec<Camera>> {
    let mut wanted: Vec<Camera> =
        cameras.iter().flat_map(|camera| &camera.wanted).cloned().collect();
    for (id, camera) in (0..).zip(&mut wanted) {
        camera.id = id;
    }
    let alone = wanted.iter().map(|camera| Load::of(std::slice::from_ref(camera)));
    let mut jobs: Vec<Vec<Camera>> =
        ranges(alone).into_iter().map(|range| wanted[range].to_vec()).collect();
    jobs.reverse();
    jobs
}

fn ranges(loads: impl Iterator<Item = Load>) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    let mut taken = Load::default();
    for (at, load) in loads.enumerate() {
        match ranges.last_mut() {
            Some(range) if taken.takes(load) => range.end = at + 1,
            _ => {
                ranges.push(at..at + 1);
                taken = load;
            }
        }
    }
    ranges
}

/// Whether other pictures of the frame would be refused for the same reason.
pub(super) fn is_for_all(error: &Error) -> bool {
    !matches!(
        error.code,
        ErrorCode::InvalidArgument
            | ErrorCode::UnknownActor
            | ErrorCode::TooLarge
            | ErrorCode::Internal
    )
}
