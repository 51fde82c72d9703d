//! Cameras, images and render jobs.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, Vector, WIPOffset};

use super::parts::{
    encoding_in, encoding_out, finite, image_kind_in, image_kind_out, pose_in, pose_out,
    unknown_variant,
};
use super::sensor::{ignored_in, ignored_out};
use super::staging::{exposure_in, exposure_out, staging_in, staging_out};
use super::{Kind, check_count, decode_frame, root};
use crate::generated as fb;
use crate::limits::{CAMERAS_PER_JOB_MAX, REPLY_BYTES_MAX};
use crate::{ActorId, Camera, Error, ErrorCode, FrameBytes, Image, PictureQuality, RenderJob};

const JOB: Kind =
    Kind { name: "render job", identifier: fb::RENDER_JOB_IDENTIFIER, bytes_max: REPLY_BYTES_MAX };

/// A render job as bytes.
pub fn encode_render_job<F: FrameBytes>(job: &RenderJob<F>) -> Vec<u8> {
    let frame = job.frame.frame_bytes();
    let mut builder = FlatBufferBuilder::with_capacity(frame.len() + 1024);
    let tenant = builder.create_string(job.tenant.as_str());
    let frame = builder.create_vector(&frame);
    let cameras = cameras_out(&mut builder, &job.cameras);
    let street_lights = staging_out(&mut builder, &job.staging);
    let root = fb::RenderJob::create(
        &mut builder,
        &fb::RenderJobArgs {
            tenant: Some(tenant),
            frame: Some(frame),
            cameras: Some(cameras),
            street_lights,
        },
    );
    builder.finish(root, Some(JOB.identifier));
    builder.finished_data().to_vec()
}

/// The render job in these bytes.
///
/// # Errors
/// [`ErrorCode::TooLarge`] and [`ErrorCode::InvalidMessage`].
pub fn decode_render_job(bytes: &[u8]) -> Result<RenderJob, Error> {
    let raw = root::<fb::RenderJob>(&JOB, bytes)?;
    let tenant = raw
        .tenant()
        .parse()
        .map_err(|cause| Error::new(ErrorCode::InvalidMessage, format!("tenant: {cause}")))?;
    Ok(RenderJob {
        tenant,
        frame: decode_frame(raw.frame().bytes())?,
        cameras: cameras_in(raw.cameras())?,
        staging: staging_in(&raw)?,
    })
}

fn cameras_out<'a>(
    builder: &mut FlatBufferBuilder<'a>,
    cameras: &[Camera],
) -> WIPOffset<Vector<'a, ForwardsUOffset<fb::Camera<'a>>>> {
    let raw: Vec<_> = cameras
        .iter()
        .map(|camera| {
            let ignored = ignored_out(builder, &camera.ignored);
            fb::Camera::create(
                builder,
                &fb::CameraArgs {
                    id: camera.id,
                    carrier: camera.carrier.map_or(0, ActorId::get),
                    carrier_from_camera: Some(&pose_out(&camera.carrier_from_camera)),
                    width_px: camera.width_px,
                    height_px: camera.height_px,
                    horizontal_fov_rad: camera.horizontal_fov_rad,
                    kind: image_kind_out(camera.kind),
                    encoding: encoding_out(camera.encoding),
                    jpeg_quality: camera.jpeg_quality,
                    ignored,
                    quality: quality_out(camera.quality),
                    exposure: exposure_out(&camera.exposure).as_ref(),
                },
            )
        })
        .collect();
    builder.create_vector(&raw)
}

fn cameras_in(raw: Vector<'_, ForwardsUOffset<fb::Camera<'_>>>) -> Result<Vec<Camera>, Error> {
    check_count("cameras", raw.len(), CAMERAS_PER_JOB_MAX)?;
    raw.iter()
        .map(|raw| {
            Ok(Camera {
                id: raw.id(),
                carrier: ActorId::new(raw.carrier()),
                carrier_from_camera: pose_in(raw.carrier_from_camera(), "carrier_from_camera")?,
                width_px: raw.width_px(),
                height_px: raw.height_px(),
                horizontal_fov_rad: finite(raw.horizontal_fov_rad(), "horizontal_fov_rad")?,
                kind: image_kind_in(raw.kind())?,
                encoding: encoding_in(raw.encoding())?,
                jpeg_quality: raw.jpeg_quality(),
                ignored: ignored_in(raw.ignored())?,
                quality: quality_in(raw.quality())?,
                exposure: exposure_in(raw.exposure())?,
            })
        })
        .collect()
}

fn quality_out(quality: Option<PictureQuality>) -> fb::PictureQuality {
    match quality {
        None => fb::PictureQuality::Site,
        Some(PictureQuality::Low) => fb::PictureQuality::Low,
        Some(PictureQuality::High) => fb::PictureQuality::High,
    }
}

fn quality_in(raw: fb::PictureQuality) -> Result<Option<PictureQuality>, Error> {
    match raw {
        fb::PictureQuality::Site => Ok(None),
        fb::PictureQuality::Low => Ok(Some(PictureQuality::Low)),
        fb::PictureQuality::High => Ok(Some(PictureQuality::High)),
        other => Err(unknown_variant("picture quality", other.0)),
    }
}

pub(super) fn images_out<'a>(
    builder: &mut FlatBufferBuilder<'a>,
    images: &[Image],
) -> WIPOffset<Vector<'a, ForwardsUOffset<fb::Image<'a>>>> {
    let raw: Vec<_> = images
        .iter()
        .map(|image| {
            let data = builder.create_vector(&image.data);
            fb::Image::create(
                builder,
                &fb::ImageArgs {
                    camera: image.camera,
                    width_px: image.width_px,
                    height_px: image.height_px,
                    kind: image_kind_out(image.kind),
                    encoding: encoding_out(image.encoding),
                    data: Some(data),
                },
            )
        })
        .collect();
    builder.create_vector(&raw)
}

pub(super) fn images_in(
    raw: Vector<'_, ForwardsUOffset<fb::Image<'_>>>,
) -> Result<Vec<Image>, Error> {
    check_count("images", raw.len(), CAMERAS_PER_JOB_MAX)?;
    raw.iter()
        .map(|raw| {
            Ok(Image {
                camera: raw.camera(),
                width_px: raw.width_px(),
                height_px: raw.height_px(),
                kind: image_kind_in(raw.kind())?,
                encoding: encoding_in(raw.encoding())?,
                data: raw.data().bytes().to_vec(),
            })
        })
        .collect()
}
