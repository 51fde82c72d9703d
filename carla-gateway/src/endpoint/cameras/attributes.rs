//! Cameras as their attributes ask for them.

use schemas::limits::{FIELD_OF_VIEW_DEG_MAX, IMAGE_SIDE_PX_MAX, PIXELS_PER_JOB_MAX};
use schemas::{Camera, ImageKind, PictureQuality, Pose};

use crate::dialect::Actor;
use crate::pictures::{Film, Optics, Reaction, encoding_of};
use crate::rpc::Refusal;

/// JPEG is never asked for, but the field needs a value in range.
const JPEG_QUALITY: u8 = 90;

/// The camera that an actor's attributes ask for, with pictures of one kind.
///
/// # Errors
/// What cannot be drawn, in words for whoever spawns it.
pub(crate) fn camera(
    actor: &Actor,
    kind: ImageKind,
    id: u32,
    world_from_camera: &Pose,
) -> Result<Camera, Refusal> {
    let side = |id, default| {
        let pixels = actor.number(id, default)?;
        if (1.0..=IMAGE_SIDE_PX_MAX as f32).contains(&pixels) {
            return Ok(pixels as u32);
        }
        Err(Refusal(format!("{id} must be 1 to {IMAGE_SIDE_PX_MAX}, not {pixels}")))
    };
    let fov_deg = actor.number("fov", 90.0)?;
    if !(fov_deg > 0.0 && fov_deg <= FIELD_OF_VIEW_DEG_MAX) {
        return Err(Refusal(format!(
            "fov must be above 0, at most {FIELD_OF_VIEW_DEG_MAX}, not {fov_deg}"
        )));
    }
    let (width_px, height_px) = (side("image_size_x", 800.0)?, side("image_size_y", 600.0)?);
    if width_px as usize * height_px as usize > PIXELS_PER_JOB_MAX {
        return Err(Refusal(format!(
            "wanted image_size_x times image_size_y of at most {PIXELS_PER_JOB_MAX} pixels, \
             found {width_px} times {height_px}: ask for a smaller picture"
        )));
    }
    Ok(Camera {
        id,
        carrier: None,
        carrier_from_camera: *world_from_camera,
        width_px,
        height_px,
        horizontal_fov_rad: fov_deg.to_radians(),
        kind,
        encoding: encoding_of(kind),
        jpeg_quality: JPEG_QUALITY,
        ignored: Vec::new(),
        quality: quality_of(actor)?,
        exposure: Optics::of(actor)?.exposure(),
    })
}

/// How finely the colours of a camera are drawn; `None` as the renderer was told.
fn quality_of(actor: &Actor) -> Result<Option<PictureQuality>, Refusal> {
    match actor.text("picture_quality") {
        None | Some("site") => Ok(None),
        Some("low") => Ok(Some(PictureQuality::Low)),
        Some("high") => Ok(Some(PictureQuality::High)),
        Some(other) => {
            Err(Refusal(format!("picture_quality must be site, low or high, not {other}")))
        }
    }
}

/// Whether a camera can be as its attributes ask for.
///
/// # Errors
/// As for [`camera`].
pub(crate) fn check_camera(actor: &Actor) -> Result<(), Refusal> {
    let blueprint = &actor.description.type_id;
    let film = Film::of(blueprint)
        .ok_or_else(|| Refusal(format!("{blueprint} cannot be drawn by this server")))?;
    if film == Film::Events {
        Reaction::of(actor)?;
    }
    film.kinds().iter().try_for_each(|kind| camera(actor, *kind, 0, &Pose::identity()).map(drop))
}
