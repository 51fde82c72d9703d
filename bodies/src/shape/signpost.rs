//! Shapes of traffic lights and signs.
//!
//! **Frame:** x along the traffic they speak to, so that they face -x; y left, z up.

use schemas::Vec3;

use crate::lettering;
use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder, turned};

/// A round post of radius 1 from z = 0 to z = 1.
pub(crate) fn post() -> Mesh {
    let mut builder = MeshBuilder::default();
    let ring = |z: f32| -> Vec<Vec3> { corners(8, 0.0).map(|[x, y]| Vec3::new(x, y, z)).collect() };
    builder.loft(&[ring(0.0), ring(1.0)], Material::Metal);
    builder.finish()
}

/// A housing with a red, an amber and a green lamp under hoods, in metres around its middle. The
/// lamps have an instance's first, second and third colour.
pub(crate) fn light_head() -> Mesh {
    let mut builder = MeshBuilder::default();
    let mut block = |min: [f32; 3], max: [f32; 3]| {
        builder.cuboid(min.into(), max.into(), Material::BlackPlastic);
    };
    block([-0.10, -0.19, -0.54], [0.12, 0.19, 0.54]);
    block([0.02, -0.30, -0.66], [0.04, 0.30, 0.66]);
    for z in [0.34, 0.0, -0.34] {
        block([-0.30, -0.15, z + 0.145], [-0.10, 0.15, z + 0.165]);
    }
    for (z, lens) in
        [(0.34, Material::Paint), (0.0, Material::HeadLamp), (-0.34, Material::TailLamp)]
    {
        front(&mut builder, -0.11, 0.14, z, 12, 0.0, lens);
    }
    builder.finish()
}

/// Of what is written on a stop sign, where the board has radius 1: height of its capitals and half
/// the width of a stroke.
const CAPITAL: f32 = 0.48;
const HALF_STROKE: f32 = 0.042;

/// A red octagon that says STOP.
pub(crate) fn stop_sign() -> Mesh {
    let mut builder = MeshBuilder::default();
    let phase = std::f32::consts::PI / 8.0;
    board(&mut builder, (8, phase), [Material::PropBand, Material::Prop]);
    for [from, to] in lettering::strokes("STOP") {
        // Left is y; whoever reads it looks along x.
        let [from, to] = [from, to].map(|[right, up]| Vec3::new(-0.06, -right, up) * CAPITAL);
        let along = (to - from).normalize() * HALF_STROKE;
        let up = Vec3::new(0.0, -along.z, along.y);
        let (from, to) = (from - along * 0.6, to + along * 0.6);
        let lift = |place: Vec3| Vec3::new(-0.06, place.y, place.z);
        let quad = [from + up, to + up, to - up, from - up].map(lift);
        builder.quad(quad, Material::PropBand);
    }
    builder.finish()
}

/// A white triangle on its tip with a red border.
pub(crate) fn yield_sign() -> Mesh {
    let mut builder = MeshBuilder::default();
    let phase = std::f32::consts::PI / 6.0;
    board(&mut builder, (3, phase), [Material::Prop, Material::PropBand]);
    builder.finish()
}

/// A white disc with a red border.
pub(crate) fn round_sign() -> Mesh {
    let mut builder = MeshBuilder::default();
    board(&mut builder, (20, 0.0), [Material::Prop, Material::PropBand]);
    builder.finish()
}

/// A coloured square with a white border.
pub(crate) fn square_sign() -> Mesh {
    let mut builder = MeshBuilder::default();
    let phase = std::f32::consts::FRAC_PI_4;
    board(&mut builder, (4, phase), [Material::PropBand, Material::Prop]);
    builder.finish()
}

/// A thin board of radius 1: border, and a face in front of it.
fn board(builder: &mut MeshBuilder, (count, phase): (usize, f32), [border, face]: [Material; 2]) {
    let ring =
        |x: f32| -> Vec<Vec3> { corners(count, phase).map(|[y, z]| Vec3::new(x, y, z)).collect() };
    builder.loft(&[ring(-0.03), ring(0.03)], Material::Metal);
    front(builder, -0.04, 1.0, 0.0, count, phase, border);
    front(builder, -0.05, 0.84, 0.0, count, phase, face);
}

/// A flat polygon that faces -x, around y = 0 and this z.
fn front(
    builder: &mut MeshBuilder,
    x: f32,
    radius: f32,
    z: f32,
    count: usize,
    phase: f32,
    material: Material,
) {
    let ring = corners(count, phase).map(|[y, up]| Vec3::new(x, y * radius, z + up * radius));
    let seen_from_outside: Vec<Vec3> = ring.collect::<Vec<_>>().into_iter().rev().collect();
    builder.fan(&seen_from_outside, material);
}

/// Corners of a regular polygon of radius 1, counter-clockwise.
fn corners(count: usize, phase: f32) -> impl Iterator<Item = [f32; 2]> {
    (0..count).map(move |at| turned(phase + std::f32::consts::TAU * at as f32 / count as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_stop_sign_says_faces_whoever_comes_and_lies_on_its_board() {
        let mesh = stop_sign();
        let text: Vec<_> = mesh.vertices.iter().filter(|one| one.position[0] < -0.055).collect();
        assert!(text.len() >= 4 * 20, "{}", text.len());
        for vertex in text {
            let [x, ..] = vertex.normal_material;
            assert!(x < -32_000, "{vertex:?}");
            let [_, y, z] = vertex.position;
            assert!(y.hypot(z) < 0.84, "{vertex:?}");
        }
    }
}
