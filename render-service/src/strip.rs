//! What is drawn in one go: rows of the pictures of one camera pose.

use std::ops::Range;
use std::sync::Arc;

use schemas::{Camera, Error, HiddenScenery, Image};

use crate::scene::instance::Body;
use crate::scene::light::Light;
use crate::scene::town::TownScene;
use crate::scene::view::View;

/// Rows are handed over at a multiple of this, as GPUs want it.
const ROW_BYTES_MULTIPLE: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// Rows of the pictures that one camera pose gives in one pass.
pub(crate) struct Strip<'a> {
    pub(crate) town: &'a Arc<TownScene>,
    /// Of the town.
    pub(crate) hidden: &'a HiddenScenery,
    pub(crate) bodies: &'a [Body],
    pub(crate) light: &'a Light,
    pub(crate) view: &'a View,
    /// One of colour, one or more of geometry; of one size.
    pub(crate) cameras: Vec<&'a Camera>,
    /// Of each picture, from the top; never empty.
    pub(crate) rows: Range<u32>,
    /// What the shadows are of: strips of one number have the same.
    pub(crate) shadows_of: u64,
}

impl<'a> Strip<'a> {
    /// The first of its cameras: what holds for it holds for all.
    pub(crate) fn camera(&self) -> &'a Camera {
        self.cameras.first().expect("a strip is of one camera or more")
    }

    /// Whether it has all rows.
    pub(crate) fn is_whole(&self) -> bool {
        self.rows == (0..self.camera().height_px)
    }

    /// What its cameras do not ignore.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = &Body> {
        let ignored = &self.camera().ignored;
        let is_ignored = |id| ignored.contains(&id);
        self.bodies.iter().filter(move |body| !body.actor.is_some_and(is_ignored))
    }
}

/// What came of one camera of a strip.
pub(crate) enum Drawn {
    /// All rows, as the asker wants them.
    Picture(Result<Image, Error>),
    /// The strip's rows, at their pitch.
    Rows(Vec<u8>),
}

/// Bytes from one row to the next, as pictures of this width are read back.
pub(crate) fn row_pitch_bytes(width_px: u32) -> u32 {
    (width_px * 4).next_multiple_of(ROW_BYTES_MULTIPLE)
}
