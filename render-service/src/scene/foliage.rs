//! Crowns of trees at several levels: a ball with sprays of leaves on it, and coarser and coarser
//! ones without.

mod sprays;

use std::collections::BTreeMap;

use bodies::{Vertex, pack};
use schemas::{TagId, Vec3};

use self::sprays::Spread;
use super::town::Surface;

/// How far leaves stand out or back, in metres.
const UNEVEN_M: f32 = 0.22;
/// How much larger than a ball coarse ones without sprays are, so that they cover as many pixels.
const GROWN: [f32; 2] = [1.12, 1.25];
/// How much smaller the ball below sprays is.
const SHRUNK: f32 = 0.86;
/// How far a crown with few sprays is taken to be off, in metres: by eye, as no two have a spray at
/// the same place.
const FEW_SPRAYS_OFF_M: f32 = 0.06;

/// How dark leaves are, as the shaders know it: those inside a crown, and outside on the average.
const INNER: u8 = 0;
const OUTER: u8 = 1;
/// Shades of leaves of one colour, and colours.
const SHADES: u8 = 4;
const COLOURS: u32 = 4;

/// Place and normal.
type Corner = (Vec3, Vec3);

/// The crown of a tree: the coarse ball that the map has for it.
#[derive(Debug)]
pub(crate) struct Crown {
    /// The packed label of its tree.
    pub(crate) label: u32,
    triangles: Vec<[Corner; 3]>,
    middle: Vec3,
}

/// One of several ways to draw a crown.
#[derive(Debug)]
pub(crate) struct CrownLevel {
    pub(crate) corners: Vec<Vertex>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// How far it is off, at most, in metres.
    pub(crate) error_m: f32,
}

/// The crowns of a surface of coarse balls. What belongs to no tree is left out.
pub(crate) fn crowns(balls: &Surface) -> Vec<Crown> {
    let mut of_tree: BTreeMap<u32, Vec<[Corner; 3]>> = BTreeMap::new();
    for triangle in &balls.triangles {
        let corner = |index: u32| -> Option<Corner> {
            let at = index as usize;
            Some((*balls.positions_m.get(at)?, *balls.normals.get(at)?))
        };
        let [a, b, c] = *triangle;
        let label = balls.labels.get(a as usize).filter(|of| TagId::place_of(**of).is_some());
        if let (Some(label), Some(a), Some(b), Some(c)) = (label, corner(a), corner(b), corner(c)) {
            of_tree.entry(*label).or_default().push([a, b, c]);
        }
    }
    let crown = |(label, triangles): (u32, Vec<[Corner; 3]>)| {
        let middle = triangles.iter().flatten().map(|(place, _)| place).sum::<Vec3>();
        let middle = middle / (3 * triangles.len()) as f32;
        Crown { label, triangles, middle }
    };
    of_tree.into_iter().map(crown).collect()
}

impl CrownLevel {
    fn push(&mut self, corners: impl IntoIterator<Item = Vertex>, triangles: &[[u32; 3]]) {
        let first = self.corners.len() as u32;
        self.corners.extend(corners);
        self.triangles.extend(triangles.iter().map(|corners| corners.map(|at| first + at)));
    }
}

impl Crown {
    /// Coarser and coarser ones; the first one is off by nothing.
    pub(crate) fn levels(&self) -> Vec<CrownLevel> {
        let mut levels = vec![
            self.with_sprays(&self.rounded(), &sprays::MANY, 0.0),
            self.with_sprays(&self.triangles, &sprays::FEW, FEW_SPRAYS_OFF_M),
        ];
        for (triangles, error_m) in [self.coarse(), self.double_pyramid()] {
            if levels.last().is_none_or(|last| last.error_m < error_m) {
                levels.push(self.level(&triangles, OUTER, error_m));
            }
        }
        levels
    }

    fn with_sprays(&self, inner: &[[Corner; 3]], spread: &Spread, error_m: f32) -> CrownLevel {
        let shrunk = |(place, normal): Corner| {
            let (place, normal) = uneven_corner((place, normal));
            (self.middle + (place - self.middle) * SHRUNK, normal)
        };
        let inner: Vec<[Corner; 3]> = inner.iter().map(|corners| corners.map(shrunk)).collect();
        let mut level = self.level(&inner, INNER, error_m);
        for (corners, shade) in sprays::on(self, spread) {
            let corners = corners.map(|corner| self.vertex(corner, shade));
            level.push(corners, &sprays::TRIANGLES);
        }
        level
    }

    fn level(&self, triangles: &[[Corner; 3]], shade: u8, error_m: f32) -> CrownLevel {
        let mut level = CrownLevel { corners: Vec::new(), triangles: Vec::new(), error_m };
        for corners in triangles {
            let corners = leafy(*corners).map(|corner| self.vertex(corner, shade));
            level.push(corners, &[[0, 1, 2]]);
        }
        level
    }

    fn vertex(&self, (place, normal): Corner, shade: u8) -> Vertex {
        let colour = (mixed(self.label, 0) % COLOURS) as u8;
        Vertex {
            position: place.into(),
            normal_material: pack(normal, bodies::Material::Foliage, colour * SHADES + shade),
            facade_m: [0.0; 2],
            label: self.label,
        }
    }

    /// Every triangle cut into four that bulge as its corners' normals say.
    fn rounded(&self) -> Vec<[Corner; 3]> {
        let cut = |[a, b, c]: &[Corner; 3]| {
            let (ab, bc, ca) = (middle_of(a, b), middle_of(b, c), middle_of(c, a));
            [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
        };
        self.triangles.iter().flat_map(cut).collect()
    }

    /// The ball, grown, and how far it is from the round one.
    fn coarse(&self) -> (Vec<[Corner; 3]>, f32) {
        let mut error_m = 0.0f32;
        let middle = self.middle;
        let grown = |(place, normal): Corner| (middle + (place - middle) * GROWN[0], normal);
        let triangles = self.triangles.iter().map(|[a, b, c]| {
            let corners = [*a, *b, *c].map(uneven_corner).map(grown);
            let [(first, _), (second, _), (third, _)] = corners;
            let flat = (second - first).cross(&(third - first)).try_normalize(1e-9);
            for (place, _) in [middle_of(a, b), middle_of(b, c), middle_of(c, a)].map(uneven_corner)
            {
                let off = flat.map_or(0.0, |flat| flat.dot(&(place - first)).abs());
                error_m = error_m.max(off);
            }
            for (place, _) in [*a, *b, *c].map(uneven_corner) {
                error_m = error_m.max((place - middle).norm() * (GROWN[0] - 1.0));
            }
            corners
        });
        let triangles = triangles.collect();
        (triangles, error_m)
    }

    /// Eight triangles with a corner at each end of the ball, and how far they are off.
    fn double_pyramid(&self) -> (Vec<[Corner; 3]>, f32) {
        let places: Vec<Vec3> = self
            .triangles
            .iter()
            .flat_map(|[a, b, c]| [*a, *b, *c, middle_of(a, b), middle_of(b, c), middle_of(c, a)])
            .map(|corner| uneven_corner(corner).0 - self.middle)
            .collect();
        let half = places.iter().fold(Vec3::repeat(1e-3), |half, place| half.sup(&place.abs()));
        let tips = half * GROWN[1];
        let error_m = places.iter().fold(tips.max() - half.max(), |error_m, place| {
            // Along the way to the middle it is no nearer.
            let outward = place.component_div(&tips).abs().sum().max(1e-3);
            error_m.max(place.norm() * (1.0 - 1.0 / outward).abs())
        });
        (octahedron(&self.middle, &tips), error_m)
    }
}

/// Eight triangles with corners at the ends of three axes, counter-clockwise seen from outside.
fn octahedron(middle: &Vec3, half: &Vec3) -> Vec<[Corner; 3]> {
    let tip = |axis: usize, side: f32| {
        let mut way = Vec3::zeros();
        way[axis] = side;
        (middle + way.component_mul(half), way)
    };
    let mut triangles = Vec::with_capacity(8);
    for (x, y, z) in [-1.0, 1.0]
        .into_iter()
        .flat_map(|x| [-1.0, 1.0].into_iter().flat_map(move |y| [-1.0f32, 1.0].map(|z| (x, y, z))))
    {
        let [a, b, c] = [tip(0, x), tip(1, y), tip(2, z)];
        triangles.push(if x * y * z > 0.0 { [a, b, c] } else { [a, c, b] });
    }
    triangles
}

/// A corner where its leaves are.
///
/// **Determinism:** what is at one place moves alike in all triangles, so no gaps open.
fn uneven_corner((position, normal): Corner) -> Corner {
    (position + normal * (UNEVEN_M * uneven(&position)), normal)
}

/// Half round, half flat normals: leaves catch the light unevenly.
fn leafy(corners: [Corner; 3]) -> [Corner; 3] {
    let [(a, _), (b, _), (c, _)] = corners;
    let flat = (b - a).cross(&(c - a)).try_normalize(1e-9);
    corners.map(|(position, normal)| {
        let mixed = normal + flat.unwrap_or(normal) * 0.9;
        (position, mixed.try_normalize(1e-6).unwrap_or(normal))
    })
}

/// The middle of an arc between two points with these normals.
fn middle_of((a, normal_a): &Corner, (b, normal_b): &Corner) -> Corner {
    let normal = (normal_a + normal_b).try_normalize(1e-6).unwrap_or(*normal_a);
    let angle_rad = normal_a.dot(normal_b).clamp(-1.0, 1.0).acos();
    let rise_m = (b - a).norm() / 2.0 * (angle_rad / 4.0).tan();
    ((a + b) / 2.0 + normal * rise_m, normal)
}

/// A number from -1 to 1 that depends on the place alone, to the nearest centimetre.
fn uneven(position: &Vec3) -> f32 {
    let [x, y, z] =
        [position.x, position.y, position.z].map(|part| (part * 100.0).round() as i32 as u32);
    let sum =
        x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
    scrambled(sum) * 2.0 - 1.0
}

/// A number from 0 to 1 that follows from another one.
fn scrambled(number: u32) -> f32 {
    let mixed = (number ^ (number >> 15)).wrapping_mul(0x2c1b_3c6d);
    (mixed >> 16) as f32 / 65_535.0
}

/// Any number, another one for every tree and place in it.
fn mixed(label: u32, at: u32) -> u32 {
    let sum = label.wrapping_mul(0x9e37_79b1) ^ at.wrapping_add(1).wrapping_mul(0x85eb_ca77);
    (sum ^ (sum >> 13)).wrapping_mul(0xc2b2_ae3d) >> 8
}

#[cfg(test)]
mod tests {
    use super::*;
    use bodies::Material;

    use crate::scene::town::WallKind;

    const MIDDLE: Vec3 = Vec3::new(3.0, 4.0, 5.0);

    /// An eighth of a ball, and the seven others.
    fn ball(radius_m: f32, label: u32) -> Surface {
        let mut surface = Surface::empty(Material::Foliage, WallKind::Plaster);
        for corners in octahedron(&MIDDLE, &Vec3::repeat(radius_m)) {
            let first = surface.positions_m.len() as u32;
            for (place, normal) in corners {
                surface.positions_m.push(place);
                surface.normals.push(normal);
                surface.labels.push(label);
            }
            surface.triangles.push([first, first + 1, first + 2]);
        }
        surface
    }

    fn reach(level: &CrownLevel) -> f32 {
        let places = level.corners.iter().map(|corner| Vec3::from(corner.position));
        places.map(|place| (place - MIDDLE).norm()).fold(0.0, f32::max)
    }

    /// A tree with a crown of this radius.
    fn tree(radius_m: f32, place: u32) -> Crown {
        let label = TagId::of_scenery(schemas::SemanticTag::Vegetation, place);
        let [crown] = <[Crown; 1]>::try_from(crowns(&ball(radius_m, label))).expect("one tree");
        assert_eq!(crown.label, label);
        crown
    }

    #[test]
    fn crowns_get_coarser_stay_near_the_ball_and_face_outwards() {
        let crown = tree(1.6, 7);
        let levels = crown.levels();
        assert!(levels.len() >= 3);
        assert_eq!(levels[0].error_m, 0.0);
        for pair in levels.windows(2) {
            assert!(pair[0].error_m < pair[1].error_m);
            assert!(pair[0].triangles.len() >= pair[1].triangles.len());
        }
        for level in &levels {
            let most_m = (1.6 + UNEVEN_M) * GROWN[1];
            assert!((1.4..most_m).contains(&reach(level)), "{}", reach(level));
            assert!(level.corners.iter().all(|corner| corner.label == crown.label));
            for triangle in &level.triangles {
                let place = |at: u32| Vec3::from(level.corners[at as usize].position);
                let [a, b, c] = triangle.map(place);
                assert!((b - a).cross(&(c - a)).dot(&(a - MIDDLE)) > 0.0, "{a} {b} {c}");
            }
        }
        assert!(crowns(&ball(1.6, 3)).is_empty(), "leaves of no tree");
    }

    #[test]
    fn equal_trees_are_equal_and_others_have_other_leaves() {
        let places = |crown: &Crown| -> Vec<[f32; 3]> {
            crown.levels()[0].corners.iter().map(|corner| corner.position).collect()
        };
        assert_eq!(places(&tree(1.6, 7)), places(&tree(1.6, 7)));
        assert_ne!(places(&tree(1.6, 7)), places(&tree(1.6, 8)));
    }

    #[test]
    fn a_shared_edge_stays_closed() {
        let levels = tree(2.0, 7).levels();
        // The middle of the edge from y to z occurs in both triangles at it: three times in each.
        let [y, z] = [Vec3::y(), Vec3::z()].map(|way| (MIDDLE + way * 2.0, way));
        let wanted = uneven_corner(middle_of(&y, &z)).0;
        let wanted = MIDDLE + (wanted - MIDDLE) * SHRUNK;
        let places = levels[0].corners.iter().map(|corner| Vec3::from(corner.position));
        assert_eq!(places.filter(|place| (place - wanted).norm() < 1e-3).count(), 6);
    }
}
