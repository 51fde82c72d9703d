//! Textures that clients put on things of the map.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::limits::TEXTURE_SIDE_PX_MAX;
use crate::{Error, ErrorCode};

/// Width, height and brightness, before the pixels.
const HEADER_BYTES: usize = 12;

/// A picture in colour. It travels as bytes and is known by the BLAKE3 digest of them: width and
/// height in pixels and the brightness as little-endian 32-bit numbers, then red, green and blue of
/// every pixel in sRGB, row by row from the lowest one, each from left to right.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    digest: String,
    bytes: Vec<u8>,
}

/// What of a thing a texture replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MaterialParameter {
    /// Its colour.
    Diffuse,
    /// The light that it gives by itself.
    Emissive,
}

/// Which things of the map have which textures.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Paint {
    /// Digests of the textures that are in use.
    pub textures: Vec<String>,
    /// Ordered by place; at most
    /// [`PAINTED_OBJECTS_MAX`](crate::limits::PAINTED_OBJECTS_MAX).
    pub coats: Vec<Coat>,
}

/// The textures of one thing of the map, by their positions in [`Paint::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Coat {
    /// Of the thing, in the map's scenery.
    pub place: u32,
    /// Its colour; `None`: its own.
    pub diffuse: Option<u16>,
    /// What it gives light by; `None`: it gives none.
    pub emissive: Option<u16>,
}

impl Texture {
    /// A texture of this width and height. `brightness` multiplies its linear colours.
    ///
    /// # Errors
    /// As for [`from_bytes`](Self::from_bytes).
    pub fn new(size_px: [u32; 2], brightness: f32, rgb: &[u8]) -> Result<Self, Error> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES + rgb.len());
        for side in size_px {
            bytes.extend_from_slice(&side.to_le_bytes());
        }
        bytes.extend_from_slice(&brightness.to_le_bytes());
        bytes.extend_from_slice(rgb);
        Self::from_bytes(bytes)
    }

    /// The texture that these bytes are.
    ///
    /// # Errors
    /// `TooLarge` for a side of more than [`TEXTURE_SIDE_PX_MAX`] pixels, `InvalidMessage` for no
    /// side, another count of bytes and a brightness that is negative or no number.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, Error> {
        let (size_px, brightness) = header(&bytes).unwrap_or(([0; 2], 0.0));
        if size_px.iter().any(|side| *side > TEXTURE_SIDE_PX_MAX) {
            return Err(Error::new(ErrorCode::TooLarge, "a texture is too large")
                .wanted(format_args!("at most {TEXTURE_SIDE_PX_MAX} pixels a side"))
                .found(format_args!("{} by {}", size_px[0], size_px[1])));
        }
        let rgb_bytes = size_px[0] as usize * size_px[1] as usize * 3;
        let is_bright = brightness.is_finite() && brightness >= 0.0;
        if rgb_bytes == 0 || bytes.len() != HEADER_BYTES + rgb_bytes || !is_bright {
            return Err(Error::new(ErrorCode::InvalidMessage, "a texture is not one")
                .wanted("a width, a height, a brightness and three bytes for every pixel")
                .found(format_args!("{} bytes", bytes.len())));
        }
        Ok(Self { digest: blake3::hash(&bytes).to_hex().to_string(), bytes })
    }

    /// BLAKE3 of its bytes in lower-case hexadecimal, 64 characters.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// As [`from_bytes`](Self::from_bytes) takes them.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Width and height.
    pub fn size_px(&self) -> [u32; 2] {
        header(&self.bytes).unwrap_or_default().0
    }

    /// What multiplies its linear colours.
    pub fn brightness(&self) -> f32 {
        header(&self.bytes).unwrap_or_default().1
    }

    /// Its pixels in sRGB, from the lowest row on.
    pub fn rgb(&self) -> &[u8] {
        self.bytes.get(HEADER_BYTES..).unwrap_or_default()
    }
}

fn header(bytes: &[u8]) -> Option<([u32; 2], f32)> {
    let (words, _) = bytes.get(..HEADER_BYTES)?.as_chunks::<4>();
    let [width, height, brightness] = *words else { return None };
    Some(([width, height].map(u32::from_le_bytes), f32::from_le_bytes(brightness)))
}

impl fmt::Debug for Texture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.size_px();
        write!(f, "Texture({width} x {height}, {})", self.digest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texture_tells_what_it_was_made_of_and_equal_ones_have_one_digest() {
        let texture = Texture::new([2, 1], 1.5, &[1, 2, 3, 4, 5, 6]).unwrap();
        assert_eq!((texture.size_px(), texture.brightness()), ([2, 1], 1.5));
        assert_eq!(texture.rgb(), [1, 2, 3, 4, 5, 6]);
        let again = Texture::from_bytes(texture.bytes().to_vec()).unwrap();
        assert_eq!(again, texture);
        let brighter = Texture::new([2, 1], 2.0, texture.rgb()).unwrap();
        assert_ne!(brighter.digest(), texture.digest());
    }

    #[test]
    fn what_is_no_texture_is_refused() {
        let code = |size: [u32; 2], brightness: f32, bytes: usize| {
            Texture::new(size, brightness, &vec![0; bytes]).unwrap_err().code
        };
        assert_eq!(code([0, 4], 1.0, 0), ErrorCode::InvalidMessage);
        assert_eq!(code([2, 2], 1.0, 11), ErrorCode::InvalidMessage);
        assert_eq!(code([2, 2], f32::NAN, 12), ErrorCode::InvalidMessage);
        assert_eq!(code([2, 2], -1.0, 12), ErrorCode::InvalidMessage);
        assert_eq!(code([TEXTURE_SIDE_PX_MAX + 1, 1], 1.0, 3), ErrorCode::TooLarge);
        assert_eq!(Texture::from_bytes(vec![1; 5]).unwrap_err().code, ErrorCode::InvalidMessage);
    }
}
