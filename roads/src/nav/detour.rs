//! The mesh as the file CARLA's client library steers walkers with: a Detour tile set.
//!
//! Little endian throughout: a header, then per tile its reference, size and data (version 7 of
//! the tile format, references of 32 bits). The client turns the height axis: its x is ours, its
//! second coordinate our z, its third our -y.
//!
//! The client draws random places tile by tile and not by area, so there are as few tiles as the
//! format's 16-bit numbers allow; for most towns that is one.

mod tile;
mod tiles;

use nalgebra::Point3;

use super::NavMesh;
use tile::Tile;

const SET_MAGIC: u32 = 0x4D53_4554;
const SET_VERSION: u32 = 1;
/// Bits of a reference that are left for tile and polygon: the client wants ten for itself.
const REFERENCE_BITS: u32 = 22;
/// Most tiles along each side.
const TILES_PER_SIDE_MAX: u32 = 16;

/// Why a mesh does not fit into the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DetourError {
    /// Even the smallest tiles hold too much.
    #[error("wanted at most {limit} polygons and corners in a tile, found {found}")]
    TooDense {
        /// Polygons or corners of the fullest tile.
        found: usize,
        /// What a tile can hold.
        limit: usize,
    },
}

/// The bytes of the file; a mesh without polygons gives no bytes, for there is no such file.
///
/// **Determinism:** the same mesh gives the same bytes.
///
/// # Errors
/// [`DetourError::TooDense`] for a mesh with tens of thousands of polygons at one place.
pub fn file(mesh: &NavMesh) -> Result<Vec<u8>, DetourError> {
    let mut per_side = 1;
    loop {
        match file_in_tiles(mesh, per_side) {
            Err(DetourError::TooDense { .. }) if per_side < TILES_PER_SIDE_MAX => per_side *= 2,
            result => return result,
        }
    }
}

/// As [`file()`], cut into a square of this many tiles along each side.
///
/// **Domain:** `per_side` is taken as 1 when less and as 16 when more.
///
/// # Errors
/// As [`file()`], for this number of tiles.
pub fn file_in_tiles(mesh: &NavMesh, per_side: u32) -> Result<Vec<u8>, DetourError> {
    let per_side = per_side.clamp(1, TILES_PER_SIDE_MAX);
    if mesh.is_empty() {
        return Ok(Vec::new());
    }
    let grid = tiles::Grid::new(mesh, per_side);
    let tiles: Vec<Tile> = tiles::cut(mesh, &grid).into_iter().filter(Tile::has_polygons).collect();
    let polygons = tiles.iter().map(Tile::len).max().unwrap_or(0);
    let polygon_bits = bits(polygons).max(1);
    let tile_bits = bits(tiles.len());
    let fullest = tiles.iter().map(Tile::fullness).max().unwrap_or(0);
    let limit = tile::FULLNESS_MAX;
    if fullest > limit || polygon_bits + tile_bits > REFERENCE_BITS {
        return Err(DetourError::TooDense { found: fullest, limit });
    }
    let mut bytes = Vec::new();
    let mut header = Writer(&mut bytes);
    header.u32s(&[SET_MAGIC, SET_VERSION, count(tiles.len())]);
    header.f32s(&grid.origin());
    header.f32s(&grid.tile_sides());
    header.u32s(&[1 << tile_bits, 1 << polygon_bits]);
    for (index, tile) in (0..).zip(&tiles) {
        let data = tile.data();
        let reference = (1 << (tile_bits + polygon_bits)) | (index << polygon_bits);
        let mut writer = Writer(&mut bytes);
        writer.u32s(&[reference, count(data.len())]);
        bytes.extend(data);
    }
    Ok(bytes)
}

/// The path under which a client asks for the file of a map. It changes with the content, because
/// clients never fetch a path twice.
#[must_use]
pub fn file_name(map_name: &str, bytes: &[u8]) -> String {
    const DIGITS: usize = 16;
    let name: String =
        map_name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    let hash = blake3::hash(bytes).to_hex();
    format!("Carla/Maps/Nav/{name}_{}.bin", hash.get(..DIGITS).unwrap_or_default())
}

/// How many bits number this many things.
fn bits(things: usize) -> u32 {
    things.next_power_of_two().trailing_zeros()
}

#[allow(clippy::cast_possible_truncation, reason = "tiles are limited well below 32 bits")]
fn count(things: usize) -> u32 {
    things as u32
}

/// A place in the client's mesh axes.
#[allow(clippy::cast_possible_truncation, reason = "the format is single precision")]
fn axes(point: &Point3<f64>) -> [f32; 3] {
    [point.x as f32, point.z as f32, -point.y as f32]
}

/// Appends numbers, little endian.
struct Writer<'b>(&'b mut Vec<u8>);

impl Writer<'_> {
    fn u8s(&mut self, values: &[u8]) {
        self.0.extend_from_slice(values);
    }

    fn u16s(&mut self, values: &[u16]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn u32s(&mut self, values: &[u32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn f32s(&mut self, values: &[f32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
}
