//! What is drawn in one go: rows of the pictures of one camera pose.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use raster::Coat;
use schemas::{Camera, Error, Frame, HiddenScenery, Image, ImageEncoding, ImageKind, Staging};

use crate::scene::instance::{Body, bodies};
use crate::scene::light::Light;
use crate::scene::town::TownScene;
use crate::scene::view::View;

/// Rows of the pictures that one camera pose gives in one pass.
#[derive(Clone)]
pub(crate) struct Strip<'a> {
    pub(crate) town: &'a Arc<TownScene>,
    /// Of the town.
    pub(crate) hidden: &'a HiddenScenery,
    pub(crate) frame: &'a Frame,
    pub(crate) staging: &'a Staging,
    /// On things of the town.
    pub(crate) coats: &'a [Coat],
    /// Of the frame's actors, then of street lamps that are lit, once they are needed.
    pub(crate) of_actors: &'a OnceLock<Vec<Body>>,
    pub(crate) light: &'a Light,
    pub(crate) view: &'a View,
    /// One of colour, one or more of geometry; of one size.
    pub(crate) cameras: Vec<&'a Camera>,
    /// Of each picture, from the top; never empty.
    pub(crate) rows: Range<u32>,
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

    /// What its cameras do not ignore: actors, then street lamps and signals of the town.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = &Body> {
        let ignored = &self.camera().ignored;
        let is_ignored = |id| ignored.contains(&id);
        let of_actors = self.of_actors.get_or_init(|| {
            let mut bodies = bodies(self.frame);
            let hour = (self.hidden, self.frame.weather.sun_altitude_rad <= 0.0);
            bodies.extend(self.town.street_lamps.bodies(hour, &self.staging.street_lights));
            bodies
        });
        let all = of_actors.iter().chain(self.town.signals.bodies(self.frame));
        all.filter(move |body| !body.actor.is_some_and(is_ignored))
    }

    /// Whether any of its cameras wants colours.
    pub(crate) fn has_colour(&self) -> bool {
        self.cameras.iter().any(|camera| camera.kind == ImageKind::Rgb)
    }

    /// Bytes of a pixel of a camera, as processors draw it: what it delivers if all of the picture
    /// is here, else four.
    pub(crate) fn pixel_bytes(&self, camera: &Camera) -> usize {
        if self.is_whole() { packed_pixel_bytes(camera) } else { 4 }
    }

    /// Bytes from one row to the next of a camera, as processors draw it.
    pub(crate) fn pitch_bytes(&self, camera: &Camera) -> usize {
        if self.is_whole() {
            packed_pitch_bytes(camera)
        } else {
            row_pitch_bytes(camera.width_px) as usize
        }
    }
}

/// Bytes of a pixel of what a camera delivers; 4 before it is encoded as JPEG.
fn packed_pixel_bytes(camera: &Camera) -> usize {
    match camera.encoding {
        ImageEncoding::TagU8 => 1,
        ImageEncoding::NormalI8 => 3,
        _ => 4,
    }
}

/// Bytes of a row of what a camera delivers, without gaps.
pub(crate) fn packed_pitch_bytes(camera: &Camera) -> usize {
    camera.width_px as usize * packed_pixel_bytes(camera)
}

/// What came of one camera of a strip.
pub(crate) enum Drawn {
    /// All rows, as the asker wants them.
    Picture(Result<Image, Error>),
    /// The strip's rows, at their pitch.
    Rows(Vec<u8>),
}

/// Bytes from one row to the next of a picture of this width that is not encoded yet.
pub(crate) fn row_pitch_bytes(width_px: u32) -> u32 {
    width_px * 4
}
