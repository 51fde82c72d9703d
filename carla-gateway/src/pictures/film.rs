//! What a stream of a camera shows, and of which pictures it is made.

use std::fmt;
use std::ops::RangeInclusive;

use schemas::{ActorId, ImageKind};
use serde::Deserialize;

/// CARLA's number of a texture of its G-buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(transparent)]
pub(crate) struct TextureId(u32);

impl TextureId {
    /// All that a camera can have.
    pub(crate) fn of_camera(camera: ActorId) -> RangeInclusive<(ActorId, Self)> {
        (camera, Self(0))..=(camera, Self(u32::MAX))
    }
}

impl fmt::Display for TextureId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What a stream of a camera shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Film {
    /// A picture as it is drawn.
    Plain(ImageKind),
    /// Semantic tags in the colours of Cityscapes.
    Palette,
    /// How far every point moved in the picture since the last frame.
    Flow,
    /// Where the brightness changed, when and how.
    Events,
    /// A texture of CARLA's renderer as eight bits, by what it shows.
    Texture(Texture),
}

/// The part of CARLA's G-buffer that can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Texture {
    Plain(ImageKind),
    Velocity,
    /// As CARLA sends what a scene has not.
    Black,
}

impl Film {
    /// Of a camera's own stream; `None` for what is no camera.
    pub(crate) fn of(blueprint: &str) -> Option<Self> {
        Some(match blueprint.strip_prefix("sensor.camera.")? {
            "rgb" => Self::Plain(ImageKind::Rgb),
            "depth" => Self::Plain(ImageKind::Depth),
            "semantic_segmentation" => Self::Plain(ImageKind::Semantic),
            "instance_segmentation" => Self::Plain(ImageKind::Instance),
            "normals" => Self::Plain(ImageKind::Normals),
            "cosmos_visualization" => Self::Palette,
            "optical_flow" => Self::Flow,
            "dvs" => Self::Events,
            _ => return None,
        })
    }

    /// Of a texture of the G-buffer; `None` for numbers that it has not.
    pub(crate) fn of_texture(texture: TextureId) -> Option<Self> {
        Some(Self::Texture(match texture.0 {
            0 => Texture::Plain(ImageKind::Rgb),
            1 | 11 => Texture::Plain(ImageKind::Depth),
            2 | 12 => Texture::Plain(ImageKind::Semantic),
            3 => Texture::Plain(ImageKind::Normals),
            9 => Texture::Velocity,
            4..=8 | 10 => Texture::Black,
            _ => return None,
        }))
    }

    /// The pictures it is made of; the first one gives the size.
    pub(crate) fn kinds(self) -> &'static [ImageKind] {
        use ImageKind::{Depth, Instance, Normals, Rgb, Semantic};
        match self {
            Self::Plain(kind) | Self::Texture(Texture::Plain(kind)) => match kind {
                Rgb => &[Rgb],
                Depth => &[Depth],
                Semantic => &[Semantic],
                Instance => &[Instance],
                Normals => &[Normals],
            },
            Self::Palette => &[Semantic],
            Self::Flow | Self::Texture(Texture::Velocity) => &[Depth, Instance],
            Self::Events => &[Rgb],
            Self::Texture(Texture::Black) => &[Semantic],
        }
    }

    /// Number of the sensor in the header: its position in a list inside the client.
    pub(crate) fn number(self) -> u64 {
        match self {
            Self::Plain(ImageKind::Depth) => 1,
            Self::Plain(ImageKind::Normals) => 2,
            Self::Events => 3,
            Self::Flow => 8,
            Self::Plain(ImageKind::Rgb) => 13,
            Self::Plain(ImageKind::Semantic) => 14,
            Self::Plain(ImageKind::Instance) => 15,
            Self::Palette => 16,
            Self::Texture(_) => 18,
        }
    }
}

/// The colour of a semantic tag in the Cityscapes data set, as CARLA's client paints it.
pub(crate) fn palette_rgb(tag: u8) -> [u8; 3] {
    const COLOURS: [[u8; 3]; 29] = [
        [0, 0, 0],
        [128, 64, 128],
        [244, 35, 232],
        [70, 70, 70],
        [102, 102, 156],
        [190, 153, 153],
        [153, 153, 153],
        [250, 170, 30],
        [220, 220, 0],
        [107, 142, 35],
        [152, 251, 152],
        [70, 130, 180],
        [220, 20, 60],
        [255, 0, 0],
        [0, 0, 142],
        [0, 0, 70],
        [0, 60, 100],
        [0, 80, 100],
        [0, 0, 230],
        [119, 11, 32],
        [110, 190, 160],
        [170, 120, 50],
        [55, 90, 80],
        [45, 60, 150],
        [157, 234, 50],
        [81, 0, 81],
        [150, 100, 100],
        [230, 150, 140],
        [180, 165, 180],
    ];
    COLOURS.get(usize::from(tag)).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_has_thirteen_textures() {
        let known = |number: u32| Film::of_texture(TextureId(number)).is_some();
        assert!((0..13).all(known) && !known(13) && !known(u32::MAX));
        assert_eq!(Film::of_texture(TextureId(7)), Some(Film::Texture(Texture::Black)));
    }
}
