//! Crowns of trees: coarse balls made round and uneven.

use std::collections::BTreeMap;

use bodies::{Vertex, pack};
use schemas::{TagId, Vec3};

use super::town::Surface;

/// How far leaves stand out or back, in metres.
const UNEVEN_M: f32 = 0.22;

/// The surface with every triangle cut into four that bulge as its corners' normals say, and leaves
/// that stand out unevenly.
///
/// **Determinism:** what is at one place moves alike in all triangles, so no gaps open.
pub(crate) fn rounded(surface: &Surface) -> Surface {
    let mut round = Surface::empty(surface.material, surface.wall);
    for triangle in &surface.triangles {
        let corner = |at: usize| -> Option<Corner> {
            let index = *triangle.get(at)? as usize;
            Some((*surface.positions_m.get(index)?, *surface.normals.get(index)?))
        };
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { continue };
        let label = triangle.first().and_then(|at| surface.labels.get(*at as usize));
        let (ab, bc, ca) = (middle_of(&a, &b), middle_of(&b, &c), middle_of(&c, &a));
        for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            push(&mut round, corners);
            round.labels.extend(label.map(|label| [*label; 3]).into_iter().flatten());
        }
    }
    round
}

fn push(round: &mut Surface, corners: [Corner; 3]) {
    let first = round.positions_m.len() as u32;
    for (position, normal) in leafy(corners.map(uneven_corner)) {
        round.positions_m.push(position);
        round.normals.push(normal);
    }
    round.triangles.push([first, first + 1, first + 2]);
}

/// Place and normal.
type Corner = (Vec3, Vec3);

/// A corner where its leaves are.
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

/// A crown as it looks from far.
#[derive(Debug)]
pub(crate) struct FarCrown {
    /// The packed label of its tree, which its triangles in the tiles have, too.
    pub(crate) label: u32,
    /// Coarser and coarser ones.
    pub(crate) levels: Vec<FarLevel>,
}

/// A crown with few triangles.
#[derive(Debug)]
pub(crate) struct FarLevel {
    /// Three for each triangle.
    pub(crate) corners: Vec<Vertex>,
    /// How far it is off, at most, in metres.
    pub(crate) error_m: f32,
}

/// How much larger than a ball coarse ones are, so that they cover as many pixels.
const GROWN: [f32; 2] = [1.12, 1.25];

/// The crowns of a surface of coarse balls: those balls, and double pyramids.
pub(crate) fn far_crowns(balls: &Surface) -> Vec<FarCrown> {
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
    let crown = |(label, ball): (u32, Vec<[Corner; 3]>)| {
        let middle = ball.iter().flatten().map(|(place, _)| place).sum::<Vec3>();
        let middle = middle / (3 * ball.len()) as f32;
        let vertex = |(place, normal): Corner| Vertex {
            position: place.into(),
            normal_material: pack(normal, balls.material, 0),
            facade_m: [0.0; 2],
            label,
        };
        let level = |(triangles, error_m): (Vec<[Corner; 3]>, f32)| FarLevel {
            corners: triangles.into_iter().flat_map(leafy).map(vertex).collect(),
            error_m,
        };
        let coarse = coarse_ball(&ball, &middle);
        let pyramid = double_pyramid(&ball, &middle);
        let is_coarser = pyramid.1 > coarse.1;
        let levels = [coarse, pyramid].into_iter().take(if is_coarser { 2 } else { 1 });
        FarCrown { label, levels: levels.map(level).collect() }
    };
    of_tree.into_iter().map(crown).collect()
}

/// The triangles of a ball, grown, and how far they are from those that [`rounded`] makes of them.
fn coarse_ball(ball: &[[Corner; 3]], middle: &Vec3) -> (Vec<[Corner; 3]>, f32) {
    let mut error_m = 0.0f32;
    let grown = |(place, normal): Corner| (middle + (place - middle) * GROWN[0], normal);
    let triangles = ball.iter().map(|[a, b, c]| {
        let corners = [*a, *b, *c].map(uneven_corner).map(grown);
        let [(first, _), (second, _), (third, _)] = corners;
        let flat = (second - first).cross(&(third - first)).try_normalize(1e-9);
        for (place, _) in [middle_of(a, b), middle_of(b, c), middle_of(c, a)].map(uneven_corner) {
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

/// Eight triangles with a corner at each end of a ball, and how far they are off.
fn double_pyramid(ball: &[[Corner; 3]], middle: &Vec3) -> (Vec<[Corner; 3]>, f32) {
    let places: Vec<Vec3> = ball
        .iter()
        .flat_map(|[a, b, c]| [*a, *b, *c, middle_of(a, b), middle_of(b, c), middle_of(c, a)])
        .map(|corner| uneven_corner(corner).0 - middle)
        .collect();
    let half = places.iter().fold(Vec3::repeat(1e-3), |half, place| half.sup(&place.abs()));
    let tips = half * GROWN[1];
    let error_m = places.iter().fold(tips.max() - half.max(), |error_m, place| {
        // Along the way to the middle it is no nearer.
        let outward = place.component_div(&tips).abs().sum().max(1e-3);
        error_m.max(place.norm() * (1.0 - 1.0 / outward).abs())
    });
    let tip = |axis: usize, side: f32| {
        let mut way = Vec3::zeros();
        way[axis] = side;
        (middle + way.component_mul(&tips), way)
    };
    let mut triangles = Vec::with_capacity(8);
    for (x, y, z) in [-1.0, 1.0]
        .into_iter()
        .flat_map(|x| [-1.0, 1.0].into_iter().flat_map(move |y| [-1.0f32, 1.0].map(|z| (x, y, z))))
    {
        let [a, b, c] = [tip(0, x), tip(1, y), tip(2, z)];
        triangles.push(if x * y * z > 0.0 { [a, b, c] } else { [a, c, b] });
    }
    (triangles, error_m)
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
    let mixed =
        x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    (mixed >> 16) as f32 / 32_767.5 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use bodies::Material;

    use crate::scene::town::WallKind;

    /// An eighth of a ball, and the seven others.
    fn ball(radius_m: f32, label: u32) -> Surface {
        let mut surface = Surface::empty(Material::Foliage, WallKind::Plaster);
        let whole = [(Vec3::new(3.0, 4.0, 5.0), Vec3::z())];
        let (triangles, _) = double_pyramid(&[[whole[0]; 3]], &Vec3::zeros());
        for corners in triangles {
            let first = surface.positions_m.len() as u32;
            for (_, way) in corners {
                surface.positions_m.push(Vec3::new(3.0, 4.0, 5.0) + way * radius_m);
                surface.normals.push(way);
                surface.labels.push(label);
            }
            surface.triangles.push([first, first + 1, first + 2]);
        }
        surface
    }

    #[test]
    fn far_crowns_are_near_the_round_one_as_they_say_and_face_outwards() {
        let label = TagId::of_scenery(schemas::SemanticTag::Vegetation, 7);
        let surface = ball(1.6, label);
        let [crown] = <[FarCrown; 1]>::try_from(far_crowns(&surface)).expect("one tree");
        assert_eq!(crown.label, label);
        let middle = Vec3::new(3.0, 4.0, 5.0);
        let round = rounded(&surface);
        for FarLevel { corners, error_m } in &crown.levels {
            assert!((0.1..1.2).contains(error_m), "{error_m}");
            let reach = |places: &mut dyn Iterator<Item = Vec3>| {
                places.map(|place| (place - middle).norm()).fold(0.0, f32::max)
            };
            let far = reach(&mut corners.iter().map(|corner| corner.position.into()));
            let near = reach(&mut round.positions_m.iter().copied());
            assert!((far - near).abs() <= error_m + 1e-4, "{far} {near} {error_m}");
            for corners in corners.as_chunks::<3>().0 {
                let [a, b, c] = corners.map(|corner| Vec3::from(corner.position));
                assert!((b - a).cross(&(c - a)).dot(&(a - middle)) > 0.0);
            }
        }
        assert!(far_crowns(&ball(1.6, 3)).is_empty(), "leaves of no tree");
    }

    #[test]
    fn a_shared_edge_stays_closed() {
        let mut surface = Surface::empty(Material::Foliage, WallKind::Plaster);
        let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
        // Two faces of an octahedron, each with corners of its own.
        for corner in [x, y, z, y, -x, z] {
            surface.positions_m.push(corner * 2.0);
            surface.normals.push(corner);
        }
        surface.triangles = vec![[0, 1, 2], [3, 4, 5]];
        let round = rounded(&surface);
        assert_eq!(round.triangles.len(), 8);
        // The middle of the edge from y to z occurs in both: three times in each face.
        let wanted = middle_of(&(y * 2.0, y), &(z * 2.0, z));
        let wanted = wanted.0 + wanted.1 * (UNEVEN_M * uneven(&wanted.0));
        let count = round.positions_m.iter().filter(|p| (*p - wanted).norm() < 1e-4).count();
        assert_eq!(count, 6);
        assert!(((wanted.norm() - 2.0).abs()) < UNEVEN_M + 0.05);
    }
}
