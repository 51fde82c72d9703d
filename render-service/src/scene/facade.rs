//! Where on its wall every corner of a wall is, so that windows fit between the corners of houses.

use std::collections::BTreeMap;

use bodies::quantised;
use schemas::Vec3;

use super::town::Surface;

/// Width of one window and the wall around it, in metres; a facade holds a whole number of them.
const BAY_M: f32 = 3.0;
/// What is lower than this is a wall or a block, not a house, and has no windows.
const HOUSE_HEIGHT_M: f32 = 4.5;
/// Height on a facade that tells the shader that there are no windows.
const NO_WINDOWS_M: f32 = -1_000.0;

/// A corner's place on its wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FacadePoint {
    /// Metres along the wall, stretched to whole bays, and metres above its foot; far below it
    /// where there are no windows.
    pub(crate) along_up_m: [f32; 2],
    /// Kind of wall × 32, and which of 32 tones; equal for all walls of one house.
    pub(crate) variant: u8,
}

/// The place of every corner of a surface of walls.
///
/// A wall is a set of connected triangles with one normal; a house is a set of connected walls.
pub(crate) fn facade_coordinates(surface: &Surface) -> Vec<FacadePoint> {
    let count = surface.positions_m.len();
    let (mut walls, mut houses) = (Sets::new(count), Sets::new(count));
    let mut first_at: BTreeMap<[i32; 3], usize> = BTreeMap::new();
    let mut first_with: BTreeMap<([i32; 3], [i32; 3]), usize> = BTreeMap::new();
    for (at, position) in surface.positions_m.iter().enumerate() {
        let place = quantised(position);
        let normal =
            surface.normals.get(at).map(|normal| quantised(&(normal * 0.01))).unwrap_or_default();
        houses.join(at, *first_at.entry(place).or_insert(at));
        walls.join(at, *first_with.entry((place, normal)).or_insert(at));
    }
    for [a, b, c] in surface.triangles.iter().map(|triangle| triangle.map(|corner| corner as usize))
    {
        for sets in [&mut walls, &mut houses] {
            sets.join(a, b);
            sets.join(b, c);
        }
    }
    place_on_walls(surface, &mut walls, &mut houses)
}

fn place_on_walls(surface: &Surface, walls: &mut Sets, houses: &mut Sets) -> Vec<FacadePoint> {
    let along: Vec<f32> = surface
        .positions_m
        .iter()
        .enumerate()
        .map(|(at, position)| {
            let normal = surface.normals.get(at).copied().unwrap_or_else(Vec3::x);
            position.dot(&Vec3::z().cross(&normal))
        })
        .collect();
    // Per wall: least and greatest place along it; per house: its least corner and its top.
    let mut span: BTreeMap<usize, (f32, f32)> = BTreeMap::new();
    let mut foot: BTreeMap<usize, (Vec3, f32)> = BTreeMap::new();
    for (at, (position, along)) in surface.positions_m.iter().zip(&along).enumerate() {
        let (least, greatest) = span.entry(walls.root(at)).or_insert((*along, *along));
        (*least, *greatest) = (least.min(*along), greatest.max(*along));
        let (lowest, top_z) = foot.entry(houses.root(at)).or_insert((*position, position.z));
        (*lowest, *top_z) = (lowest.inf(position), top_z.max(position.z));
    }
    surface
        .positions_m
        .iter()
        .zip(&along)
        .enumerate()
        .map(|(at, (position, along))| {
            let (least, greatest) = span.get(&walls.root(at)).copied().unwrap_or_default();
            let (foot, top_z) = foot.get(&houses.root(at)).copied().unwrap_or_default();
            let width = (greatest - least).max(1e-3);
            let bays = (width / BAY_M).round().max(1.0);
            let is_house = top_z - foot.z > HOUSE_HEIGHT_M;
            let up_m = position.z - foot.z + if is_house { 0.0 } else { NO_WINDOWS_M };
            FacadePoint {
                along_up_m: [(along - least) / width * bays * BAY_M, up_m],
                variant: surface.wall as u8 * 32 + tone_of(&foot),
            }
        })
        .collect()
}

/// A number from 0 to 31 that neighbours rarely share.
fn tone_of(foot: &Vec3) -> u8 {
    let [x, y, _] = foot.map(|part| part.floor() as i32 as u32).into();
    let mixed = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    (mixed >> 27) as u8
}

/// Disjoint sets of the numbers 0 to n.
struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).collect() }
    }

    fn root(&mut self, mut at: usize) -> usize {
        while let Some(parent) = self.parent.get(at).copied()
            && parent != at
        {
            let grandparent = self.parent.get(parent).copied().unwrap_or(parent);
            if let Some(slot) = self.parent.get_mut(at) {
                *slot = grandparent;
            }
            at = grandparent;
        }
        at
    }

    /// Joins the sets of two numbers; numbers outside are ignored.
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        if high < self.parent.len()
            && let Some(slot) = self.parent.get_mut(high)
        {
            *slot = low;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bodies::Material;

    #[test]
    fn a_wall_holds_whole_bays_and_counts_height_from_its_foot() {
        // A wall 10 m long that faces south, on ground at 5 m.
        let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
        let surface = Surface {
            material: Material::Wall,
            wall: crate::scene::town::WallKind::Brick,
            positions_m: vec![
                corner(20.0, 5.0),
                corner(30.0, 5.0),
                corner(30.0, 14.0),
                corner(20.0, 14.0),
            ],
            normals: vec![-Vec3::y(); 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            labels: Vec::new(),
        };
        let points = facade_coordinates(&surface);
        assert_eq!(points[0].along_up_m, [0.0, 0.0]);
        assert_eq!(points[2].along_up_m, [9.0, 9.0]);
        assert!(points.iter().all(|point| point.variant == points[0].variant));
    }
}
