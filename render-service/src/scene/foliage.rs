//! Crowns of trees: coarse balls made round and uneven.

use schemas::Vec3;

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
        let corner = |at: usize| -> Option<(Vec3, Vec3)> {
            let index = *triangle.get(at)? as usize;
            Some((*surface.positions_m.get(index)?, *surface.normals.get(index)?))
        };
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { continue };
        let label = triangle.first().and_then(|at| surface.labels.get(*at as usize));
        let (ab, bc, ca) = (middle(&a, &b), middle(&b, &c), middle(&c, &a));
        for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            push(&mut round, corners);
            round.labels.extend(label.map(|label| [*label; 3]).into_iter().flatten());
        }
    }
    round
}

fn push(round: &mut Surface, corners: [(Vec3, Vec3); 3]) {
    let first = round.positions_m.len() as u32;
    let moved =
        corners.map(|(position, normal)| position + normal * (UNEVEN_M * uneven(&position)));
    let [a, b, c] = moved;
    let flat = (b - a).cross(&(c - a)).try_normalize(1e-9);
    for (position, (_, normal)) in moved.into_iter().zip(corners) {
        // Half round, half flat: leaves catch the light unevenly.
        let mixed = normal + flat.unwrap_or(normal) * 0.9;
        round.positions_m.push(position);
        round.normals.push(mixed.try_normalize(1e-6).unwrap_or(normal));
    }
    round.triangles.push([first, first + 1, first + 2]);
}

/// The middle of an arc between two points with these normals.
fn middle((a, normal_a): &(Vec3, Vec3), (b, normal_b): &(Vec3, Vec3)) -> (Vec3, Vec3) {
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
        let wanted = middle(&(y * 2.0, y), &(z * 2.0, z));
        let wanted = wanted.0 + wanted.1 * (UNEVEN_M * uneven(&wanted.0));
        let count = round.positions_m.iter().filter(|p| (*p - wanted).norm() < 1e-4).count();
        assert_eq!(count, 6);
        assert!(((wanted.norm() - 2.0).abs()) < UNEVEN_M + 0.05);
    }
}
