//! The file CARLA's client steers walkers with, read back by its format and held against the mesh.

#[path = "common/walks.rs"]
mod walks;

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;
use roads::nav::{Area, NavMesh, detour};
use walks::{area_m2, names, town};

/// Reads numbers, little endian.
struct Reader<'b>(&'b [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_at(N);
        self.0 = rest;
        head.try_into().unwrap()
    }

    fn u8(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    fn place(&mut self) -> [f32; 3] {
        [self.f32(), self.f32(), self.f32()]
    }
}

#[derive(Debug)]
struct FilePolygon {
    corners: Vec<u16>,
    beyond: Vec<u16>,
    flags: u16,
    area: u8,
}

struct FileTile {
    reference: u32,
    at: [u32; 2],
    low: [f32; 3],
    steps_per_m: f32,
    /// In our axes.
    vertices: Vec<Point3<f64>>,
    polygons: Vec<FilePolygon>,
    links: u32,
    /// Corners and edge flags of the triangles of each polygon.
    surfaces: Vec<Vec<[u8; 4]>>,
    /// Box and content.
    tree: Vec<([u16; 6], i32)>,
}

struct File {
    origin: [f32; 3],
    sides: [f32; 2],
    tiles_max: u32,
    polygons_max: u32,
    tiles: Vec<FileTile>,
}

fn read(bytes: &[u8]) -> File {
    let mut r = Reader(bytes);
    assert_eq!((r.u32(), r.u32()), (0x4D53_4554, 1));
    let count = r.u32();
    let (origin, sides) = (r.place(), [r.f32(), r.f32()]);
    let (tiles_max, polygons_max) = (r.u32(), r.u32());
    let tiles = (0..count).map(|_| read_tile(&mut r)).collect();
    assert!(r.0.is_empty(), "{} bytes after the last tile", r.0.len());
    File { origin, sides, tiles_max, polygons_max, tiles }
}

fn read_tile(r: &mut Reader<'_>) -> FileTile {
    let (reference, size) = (r.u32(), r.u32() as usize);
    let (data, rest) = r.0.split_at(size);
    r.0 = rest;
    let mut r = Reader(data);
    assert_eq!((r.u32(), r.u32()), (0x444E_4156, 7));
    let at = [r.u32(), r.u32()];
    assert_eq!((r.u32(), r.u32()), (0, 0));
    let (polygons, vertices, links) = (r.u32(), r.u32(), r.u32());
    let (surfaces, extra_vertices, triangles, nodes) = (r.u32(), r.u32(), r.u32(), r.u32());
    assert_eq!((surfaces, extra_vertices), (polygons, 0));
    assert_eq!((r.u32(), r.u32()), (0, polygons), "links off the mesh");
    assert_eq!([r.f32(), r.f32()], [1.8, 0.3]);
    let _climb = r.f32();
    let (low, high, steps_per_m) = (r.place(), r.place(), r.f32());
    assert!((0..3).all(|axis| low[axis] < high[axis]));
    let vertices = (0..vertices).map(|_| {
        let [x, z, y] = r.place().map(f64::from);
        Point3::new(x, -y, z)
    });
    let vertices = vertices.collect();
    let polygons: Vec<FilePolygon> = (0..polygons).map(|_| read_polygon(&mut r)).collect();
    r.0 = &r.0[12 * links as usize..];
    let parts: Vec<(u32, u32, u8)> = (0..surfaces)
        .map(|_| {
            let (_, first) = (r.u32(), r.u32());
            let (own_vertices, count, _) = (r.u8(), r.u8(), r.u16());
            (u32::from(own_vertices), first, count)
        })
        .collect();
    let all: Vec<[u8; 4]> = (0..triangles).map(|_| r.take()).collect();
    let surfaces = parts.iter().map(|(own_vertices, first, count)| {
        assert_eq!(*own_vertices, 0);
        all[*first as usize..*first as usize + usize::from(*count)].to_vec()
    });
    let surfaces = surfaces.collect();
    let tree = (0..nodes).map(|_| {
        let sides = std::array::from_fn(|_| r.u16());
        (sides, i32::from_le_bytes(r.take()))
    });
    let tree = tree.collect();
    assert!(r.0.is_empty(), "{} bytes after the tree", r.0.len());
    FileTile { reference, at, low, steps_per_m, vertices, polygons, links, surfaces, tree }
}

fn read_polygon(r: &mut Reader<'_>) -> FilePolygon {
    assert_eq!(r.u32(), u32::MAX, "the client makes the links");
    let corners: [u16; 6] = std::array::from_fn(|_| r.u16());
    let beyond: [u16; 6] = std::array::from_fn(|_| r.u16());
    let (flags, count, area) = (r.u16(), usize::from(r.u8()), r.u8());
    assert!((3..=6).contains(&count));
    assert!(corners[count..].iter().chain(&beyond[count..]).all(|v| *v == 0));
    FilePolygon {
        corners: corners[..count].to_vec(),
        beyond: beyond[..count].to_vec(),
        flags,
        area,
    }
}

fn outline(tile: &FileTile, polygon: &FilePolygon) -> Vec<Point3<f64>> {
    polygon.corners.iter().map(|corner| tile.vertices[usize::from(*corner)]).collect()
}

/// Area in square metres by the client's number of the kind.
fn areas(file: &File) -> BTreeMap<u8, f64> {
    let mut areas = BTreeMap::new();
    for tile in &file.tiles {
        for polygon in &tile.polygons {
            *areas.entry(polygon.area).or_default() += area_m2(&outline(tile, polygon));
        }
    }
    areas
}

fn mesh_areas(mesh: &NavMesh) -> BTreeMap<u8, f64> {
    let mut areas = BTreeMap::new();
    for (index, polygon) in (0..).zip(mesh.polygons()) {
        let number = match polygon.area {
            Area::Sidewalk => 1,
            Area::Crosswalk => 2,
            Area::Road => 3,
        };
        *areas.entry(number).or_default() += area_m2(&mesh.outline(index));
    }
    areas
}

fn assert_sound(name: &str, file: &File) {
    assert!(file.tiles_max.is_power_of_two() && file.polygons_max.is_power_of_two());
    let bits = file.tiles_max.trailing_zeros() + file.polygons_max.trailing_zeros();
    assert!(bits <= 22, "{name}: the client needs ten bits of a reference");
    assert!(file.tiles.len() <= file.tiles_max as usize);
    let distinct: BTreeSet<u32> = file.tiles.iter().map(|tile| tile.reference).collect();
    assert_eq!(distinct.len(), file.tiles.len());
    for (index, tile) in (0..).zip(&file.tiles) {
        assert_eq!(tile.reference >> bits, 1, "{name}");
        let number = tile.reference >> file.polygons_max.trailing_zeros();
        assert_eq!(number & (file.tiles_max - 1), index, "{name}");
        assert!(tile.polygons.len() <= file.polygons_max as usize);
        assert_tile_sound(name, file, tile);
    }
}

fn assert_tile_sound(name: &str, file: &File, tile: &FileTile) {
    let mut links = 0;
    for (index, polygon) in tile.polygons.iter().enumerate() {
        assert_eq!(polygon.flags, 1 << polygon.area, "{name}: {polygon:?}");
        assert!((1..=3).contains(&polygon.area), "{name}: {polygon:?}");
        let outline = outline(tile, polygon);
        assert!(area_m2(&outline) > -1e-3, "{name}: clockwise {outline:?}");
        for (k, beyond) in polygon.beyond.iter().enumerate() {
            let edge = [polygon.corners[k], polygon.corners[(k + 1) % polygon.corners.len()]];
            if beyond & 0x8000 != 0 {
                links += 1;
                let ends = edge.map(|corner| tile.vertices[usize::from(corner)]);
                assert_on_border(name, file, tile, beyond & 0xFF, ends);
            } else if *beyond != 0 {
                links += 1;
                let other = &tile.polygons[usize::from(*beyond) - 1];
                let count = other.corners.len();
                let back = (0..count).any(|j| {
                    [other.corners[(j + 1) % count], other.corners[j]] == edge
                        && usize::from(other.beyond[j]) == index + 1
                });
                assert!(back, "{name}: {index} and {beyond} share no edge");
            }
        }
    }
    assert!(links <= tile.links, "{name}: no room for {links} links");
    assert_surfaces_sound(name, tile);
    assert_tree_sound(name, tile);
}

/// A border edge lies on its side of the tile, where the grid says that side is.
fn assert_on_border(name: &str, file: &File, tile: &FileTile, side: u16, ends: [Point3<f64>; 2]) {
    let axis = usize::from(side % 4 == 2);
    let step = u32::from(side < 4);
    let origin = [file.origin[0], file.origin[2]][axis];
    let line = f64::from(origin) + f64::from(file.sides[axis]) * f64::from(tile.at[axis] + step);
    for end in ends {
        let place = [end.x, -end.y][axis];
        assert!((place - line).abs() < 5e-3, "{name}: {end} is not on side {side} at {line}");
    }
}

/// The triangles fill the polygon, and exactly its own edges are marked.
fn assert_surfaces_sound(name: &str, tile: &FileTile) {
    for (polygon, triangles) in tile.polygons.iter().zip(&tile.surfaces) {
        let outline = outline(tile, polygon);
        let count = polygon.corners.len();
        let mut filled_m2 = 0.0;
        for [a, b, c, flags] in triangles {
            let corners = [*a, *b, *c].map(usize::from);
            filled_m2 += area_m2(&corners.map(|corner| outline[corner]));
            for k in 0..3 {
                let is_own = (corners[k] + 1) % count == corners[(k + 1) % 3];
                assert_eq!((flags >> (2 * k)) & 3, u8::from(is_own), "{name}: {triangles:?}");
            }
        }
        assert!((filled_m2 - area_m2(&outline)).abs() < 1e-6, "{name}: {triangles:?}");
    }
}

/// Every polygon is found by walking the tree as the client does, and lies within its box.
fn assert_tree_sound(name: &str, tile: &FileTile) {
    let mut seen = BTreeSet::new();
    for (index, (sides, content)) in tile.tree.iter().enumerate() {
        let Ok(polygon) = usize::try_from(*content) else {
            let end = index + usize::try_from(-content).unwrap();
            assert!(end <= tile.tree.len() && end > index + 2, "{name}: escape to {end}");
            for (inner, _) in &tile.tree[index..end] {
                let within = (0..3).all(|k| sides[k] <= inner[k] && sides[k + 3] >= inner[k + 3]);
                assert!(within, "{name}: {inner:?} reaches out of {sides:?}");
            }
            continue;
        };
        assert!(seen.insert(polygon), "{name}: {polygon} twice");
        for corner in outline(tile, &tile.polygons[polygon]) {
            let place = [corner.x, corner.z, -corner.y];
            for axis in 0..3 {
                let steps = (place[axis] - f64::from(tile.low[axis])) * f64::from(tile.steps_per_m);
                let (low, high) = (f64::from(sides[axis]), f64::from(sides[axis + 3]));
                assert!(low <= steps + 0.01 && steps <= high + 0.01, "{name}: {corner}");
            }
        }
    }
    assert_eq!(seen.len(), tile.polygons.len(), "{name}");
}

#[test]
fn the_file_of_every_town_is_one_sound_tile_with_all_of_the_mesh() {
    for name in names() {
        let (_, mesh) = town(name);
        let bytes = detour::file(&mesh).unwrap();
        assert!(bytes.len() < 4_000_000, "{name}: {} bytes", bytes.len());
        let file = read(&bytes);
        assert_eq!(file.tiles.len(), 1, "{name}");
        assert_eq!(file.tiles[0].polygons.len(), mesh.polygons().len(), "{name}");
        assert_sound(name, &file);
        for (one, other) in areas(&file).iter().zip(&mesh_areas(&mesh)) {
            assert!(one.0 == other.0 && (one.1 / other.1 - 1.0).abs() < 1e-3, "{one:?} {other:?}");
        }
    }
}

#[test]
fn a_mesh_in_several_tiles_is_the_same_ground_cut_at_their_borders() {
    for (name, per_side) in [("Town10HD", 4), ("Town03", 3), ("Town02", 16)] {
        let (_, mesh) = town(name);
        let file = read(&detour::file_in_tiles(&mesh, per_side).unwrap());
        assert!(file.tiles.len() > 4, "{name}: {}", file.tiles.len());
        assert_sound(name, &file);
        for (one, other) in areas(&file).iter().zip(&mesh_areas(&mesh)) {
            assert!(one.0 == other.0 && (one.1 / other.1 - 1.0).abs() < 1e-3, "{one:?} {other:?}");
        }
        assert_portals_meet(name, &file);
    }
}

/// What one tile opens onto a border, the tile beyond it opens as well.
fn assert_portals_meet(name: &str, file: &File) {
    let mut opened: BTreeMap<([u32; 2], u16), f64> = BTreeMap::new();
    for tile in &file.tiles {
        for polygon in &tile.polygons {
            let outline = outline(tile, polygon);
            for (k, beyond) in polygon.beyond.iter().enumerate() {
                if beyond & 0x8000 != 0 {
                    let length_m = (outline[(k + 1) % outline.len()] - outline[k]).norm();
                    *opened.entry((tile.at, beyond & 0xFF)).or_default() += length_m;
                }
            }
        }
    }
    assert!(opened.len() > 8, "{name}: {opened:?}");
    for (([x, y], side), length_m) in &opened {
        let (beyond, back) = match side {
            0 => ([x + 1, *y], 4),
            2 => ([*x, y + 1], 6),
            4 => ([x - 1, *y], 0),
            _ => ([*x, y - 1], 2),
        };
        let other_m = opened.get(&(beyond, back)).copied().unwrap_or(0.0);
        assert!((other_m - length_m).abs() < 0.05, "{name}: {x} {y} {side}: {length_m} {other_m}");
    }
}

#[test]
fn the_path_of_a_file_names_its_map_and_changes_with_its_content() {
    let path = detour::file_name("Town10HD", b"one");
    assert!(path.starts_with("Carla/Maps/Nav/Town10HD_") && path.ends_with(".bin"), "{path}");
    assert_eq!(path, detour::file_name("Town10HD", b"one"));
    assert_ne!(path, detour::file_name("Town10HD", b"two"));
    let hostile = detour::file_name("../../etc/x y", b"one");
    assert!(hostile.starts_with("Carla/Maps/Nav/etcxy_"), "{hostile}");
    assert!(!hostile.contains(".."), "{hostile}");
}

#[test]
fn an_empty_mesh_has_no_file() {
    assert!(detour::file(&NavMesh::default()).unwrap().is_empty());
}
