//! Cameras of an export, and what draws their pictures: a renderer in this process.

use std::str::FromStr;
use std::sync::Arc;

use mcap_export::View;
use render_service::{AdapterChoice, Renderer, Textures, TownScene};
use schemas::limits::{FIELD_OF_VIEW_DEG_MAX, IMAGE_SIDE_PX_MAX, PIXELS_PER_JOB_MAX};
use schemas::{
    ActorDescription, ActorId, Camera, Error, ErrorCode, Frame, Image, ImageEncoding, ImageKind,
    Pose, RenderJob, Tenant, Translation3, UnitQuaternion, Vec3,
};

/// Of pictures that are compressed, 1 to 100.
const JPEG_QUALITY: u8 = 85;
/// Of the cameras that an export brings itself.
const FIELD_OF_VIEW_DEG: f32 = 90.0;

/// A camera that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// Behind and above the ego.
    Chase,
    /// High above the ego, the way it drives upwards.
    Top,
    /// Where the driver of the ego sits.
    Driver,
    /// A camera that is in the world.
    Actor(ActorId),
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "chase" => Ok(Self::Chase),
            "top" => Ok(Self::Top),
            "driver" => Ok(Self::Driver),
            id => id.parse().ok().and_then(ActorId::new).map(Self::Actor).ok_or_else(|| {
                "wanted chase, top, driver, or the id of a camera in the world".to_owned()
            }),
        }
    }
}

/// How large pictures are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    width_px: u32,
    height_px: u32,
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |side: &str| side.parse().ok().filter(|px| (1..=IMAGE_SIDE_PX_MAX).contains(px));
        let both = text.split_once('x').and_then(|(width, height)| {
            Some(Self { width_px: side(width)?, height_px: side(height)? })
        });
        let pixels = |size: &Self| size.width_px as usize * size.height_px as usize;
        both.filter(|size| pixels(size) <= PIXELS_PER_JOB_MAX).ok_or_else(|| {
            format!(
                "wanted two numbers from 1 to {IMAGE_SIDE_PX_MAX} as in 640x360, of at most \
                 {PIXELS_PER_JOB_MAX} pixels, found {text:?}"
            )
        })
    }
}

impl Wanted {
    /// Where a camera of the ego's is on it; `None` for those of the world.
    fn ego_from_camera(self) -> Option<Pose> {
        let (place_m, pitch_deg) = match self {
            Self::Chase => ([-7.5, 0.0, 3.5], -14.0f32),
            Self::Top => ([0.0, 0.0, 40.0], -90.0),
            Self::Driver => ([0.3, 0.35, 1.25], 0.0),
            Self::Actor(_) => return None,
        };
        let place = Translation3::from(Vec3::from(place_m));
        // Turns about y, which points left, are downwards where positive.
        let turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -pitch_deg.to_radians());
        Some(Pose::from_parts(place, turn))
    }

    /// # Errors
    /// An actor that is no camera, or is not among those who are described.
    pub(super) fn view(self, size: Size, described: &[ActorDescription]) -> Result<View, Error> {
        let (name, id) = match self {
            Self::Chase => ("ego/chase".to_owned(), None),
            Self::Top => ("ego/top".to_owned(), None),
            Self::Driver => ("ego/driver".to_owned(), None),
            Self::Actor(id) => (format!("cameras/{}", id.get()), Some(id)),
        };
        let Size { width_px, height_px } = size;
        let of_ego = Camera {
            id: 0,
            carrier: None,
            carrier_from_camera: self.ego_from_camera().unwrap_or_else(Pose::identity),
            width_px,
            height_px,
            horizontal_fov_rad: FIELD_OF_VIEW_DEG.to_radians(),
            kind: ImageKind::Rgb,
            encoding: ImageEncoding::Jpeg,
            jpeg_quality: JPEG_QUALITY,
            quality: None,
            ignored: Vec::new(),
            exposure: schemas::Exposure::PLAIN,
        };
        let camera = match id {
            None => of_ego,
            Some(id) => in_world(id, described, of_ego)?,
        };
        Ok(View { name, camera })
    }
}

/// A camera of the world, as its attributes have it; the rest as given.
fn in_world(id: ActorId, described: &[ActorDescription], rest: Camera) -> Result<Camera, Error> {
    let found = described.iter().find(|actor| actor.id == id);
    let blueprint = found.map_or("nobody", |actor| actor.blueprint.as_str());
    let (kind, encoding) = match blueprint {
        "sensor.camera.rgb" => (ImageKind::Rgb, ImageEncoding::Jpeg),
        "sensor.camera.depth" => (ImageKind::Depth, ImageEncoding::DepthF32),
        "sensor.camera.semantic_segmentation" => (ImageKind::Semantic, ImageEncoding::TagU8),
        "sensor.camera.instance_segmentation" => (ImageKind::Instance, ImageEncoding::TagIdU32),
        "sensor.camera.normals" => (ImageKind::Normals, ImageEncoding::NormalI8),
        _ => {
            return Err(Error::new(ErrorCode::InvalidArgument, "this is no camera to be drawn")
                .wanted("the id of one that is there at the end of the part")
                .found(format_args!("{id}, {blueprint}")));
        }
    };
    let number = |name: &str, default: f32| {
        let attributes = found.map_or(&[][..], |actor| &actor.attributes);
        let told = attributes.iter().find(|attribute| attribute.id == name);
        told.and_then(|attribute| attribute.value.parse().ok()).unwrap_or(default)
    };
    let side = |name, default| number(name, default).clamp(1.0, IMAGE_SIDE_PX_MAX as f32) as u32;
    let fov_deg = number("fov", FIELD_OF_VIEW_DEG).clamp(1.0, FIELD_OF_VIEW_DEG_MAX);
    Ok(Camera {
        carrier: Some(id),
        width_px: side("image_size_x", 800.0),
        height_px: side("image_size_y", 600.0),
        horizontal_fov_rad: fov_deg.to_radians(),
        kind,
        encoding,
        ..rest
    })
}

/// What draws the pictures of one export.
pub(super) struct Studio {
    renderer: Renderer,
    tenant: Tenant,
    town: Arc<TownScene>,
    /// Those of the last frame, and their digests.
    textures: (Textures, Vec<String>),
    views: Vec<View>,
}

impl Studio {
    /// # Errors
    /// Nothing on this machine draws.
    pub(super) fn open(
        adapter: &str,
        tenant: Tenant,
        map: &roads::Map,
        views: Vec<View>,
    ) -> Result<Self, render_service::RenderError> {
        let renderer = Renderer::new(AdapterChoice::parse(adapter))?;
        let town = Arc::new(TownScene::of_map(map));
        Ok(Self { renderer, tenant, town, textures: Default::default(), views })
    }

    /// What draws.
    pub(super) fn adapter_name(&self) -> &str {
        self.renderer.adapter_name()
    }

    /// The pictures of a frame, of the cameras whose carriers are in it.
    ///
    /// # Errors
    /// What the renderer refuses.
    pub(super) fn draw(
        &mut self,
        frame: &Frame,
        ego: Option<ActorId>,
    ) -> Result<Vec<(View, Image)>, Error> {
        let mut views = Vec::new();
        for view in &self.views {
            let carrier = view.camera.carrier.or(ego);
            if let Some(carrier) = carrier.filter(|id| frame.actor(*id).is_some()) {
                let camera = Camera { carrier: Some(carrier), ..view.camera.clone() };
                views.push(View { name: view.name.clone(), camera });
            }
        }
        // A job has a limit of pixels, which several large views would be beyond.
        let job = |view: &View| RenderJob {
            tenant: self.tenant.clone(),
            frame: frame.clone(),
            cameras: vec![view.camera.clone()],
            staging: schemas::Staging::default(),
        };
        let jobs: Vec<RenderJob> = views.iter().map(job).collect();
        let jobs: Vec<_> = jobs.iter().map(|job| (Arc::clone(&self.town), job)).collect();
        if self.textures.1 != frame.paint.textures {
            let mut textures = Textures::default();
            // The world that the journal makes again is in this process.
            for texture in frame.paint.textures.iter().filter_map(|it| world_service::texture(it)) {
                textures.keep(&texture);
            }
            self.textures = (textures, frame.paint.textures.clone());
        }
        let mut images = Vec::with_capacity(views.len());
        for drawn in self.renderer.render_painted(&jobs, &self.textures.0) {
            images.extend(drawn?.images);
        }
        Ok(views.into_iter().zip(images).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_and_sizes_are_named_in_words() {
        assert_eq!("top".parse(), Ok(Wanted::Top));
        assert_eq!("12".parse(), Ok(Wanted::Actor(ActorId::new(12).unwrap())));
        assert!("0".parse::<Wanted>().is_err() && "side".parse::<Wanted>().is_err());
        assert_eq!("640x360".parse(), Ok(Size { width_px: 640, height_px: 360 }));
        for wrong in ["640", "0x1", "640x", "9999x1", "4096x4096"] {
            assert!(wrong.parse::<Size>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_top_camera_looks_down_and_the_chase_camera_ahead_and_down() {
        let view = |wanted: Wanted| wanted.ego_from_camera().unwrap().rotation * Vec3::x();
        assert!((view(Wanted::Top) + Vec3::z()).norm() < 1e-6);
        let chase = view(Wanted::Chase);
        assert!(chase.x > 0.9 && chase.z < -0.1, "{chase}");
    }
}
