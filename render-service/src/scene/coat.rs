//! Textures that clients put on things of a town, laid on the boxes around these.

use std::collections::BTreeMap;
use std::sync::Arc;

use raster::Coat;
use schemas::{Error, ErrorCode, Paint, Pose, Texture, Vec3};

/// Textures by digest, ready to be drawn.
#[derive(Clone, Debug, Default)]
pub struct Textures(BTreeMap<String, Arc<raster::Texture>>);

/// Boxes around the things of a town, at their places in the scenery.
#[derive(Debug, Default)]
pub(crate) struct ThingBoxes(Vec<Option<ThingBox>>);

#[derive(Clone, Copy, Debug)]
struct ThingBox {
    world_from_box: Pose,
    half_m: Vec3,
}

impl Textures {
    /// Adds one.
    pub fn keep(&mut self, texture: &Texture) {
        if let Ok(ready) = ready(texture) {
            self.0.insert(texture.digest().to_owned(), Arc::new(ready));
        }
    }

    /// Adds one that is ready.
    pub(crate) fn share(&mut self, digest: &str, texture: Arc<raster::Texture>) {
        self.0.insert(digest.to_owned(), texture);
    }

    fn get(&self, digest: &str) -> Option<Arc<raster::Texture>> {
        self.0.get(digest).cloned()
    }
}

/// A texture with all its sizes.
///
/// # Errors
/// `InvalidMessage` for one that is none.
pub(crate) fn ready(texture: &Texture) -> Result<raster::Texture, Error> {
    let size_px = texture.size_px().map(|side| side as usize);
    raster::Texture::new(size_px, texture.brightness(), texture.rgb())
        .ok_or_else(|| Error::new(ErrorCode::InvalidMessage, "the texture is not one"))
}

impl ThingBoxes {
    pub(crate) fn of_map(map: &roads::Map) -> Self {
        let mut boxes = vec![None; map.scenery().len()];
        for object in map.environment_objects() {
            let slot = object.scenery.and_then(|place| boxes.get_mut(place as usize));
            if let Some(slot) = slot {
                let half_m: Vec3 = object.half_extent_m.cast();
                *slot = Some(ThingBox { world_from_box: object.pose.cast(), half_m });
            }
        }
        Self(boxes)
    }

    /// The coats of things; textures that are not at hand are left out.
    pub(crate) fn coats(&self, paint: &Paint, textures: &Textures) -> Vec<Coat> {
        let texture =
            |position: Option<u16>| textures.get(paint.textures.get(usize::from(position?))?);
        let coat = |coat: &schemas::Coat| {
            let around = (*self.0.get(coat.place as usize)?)?;
            let half_m = around.half_m.map(|half_m| half_m.max(1e-3));
            let turn = around.world_from_box.rotation.inverse().to_rotation_matrix();
            let middle = turn * around.world_from_box.translation.vector;
            let row = |at: usize| {
                let turned = [turn[(at, 0)], turn[(at, 1)], turn[(at, 2)], -middle[at]];
                turned.map(|part| part / half_m[at])
            };
            Some(Coat {
                thing: coat.place,
                box_from_world: [row(0), row(1), row(2)],
                half_m: half_m.into(),
                diffuse: texture(coat.diffuse),
                emissive: texture(coat.emissive),
            })
        };
        let coats = paint.coats.iter().filter_map(coat);
        coats.filter(|coat| coat.diffuse.is_some() || coat.emissive.is_some()).collect()
    }
}
