//! The glazed upper body of a car.

use schemas::Vec3;

use crate::material::Material;
use crate::mesh::MeshBuilder;

/// Glass between the belt line and a painted roof, held by posts. Pairs are (rear, front), widths
/// (foot, roof).
pub(super) struct Cabin {
    pub(super) foot_x: (f32, f32),
    pub(super) roof_x: (f32, f32),
    pub(super) foot_z: f32,
    pub(super) roof_z: f32,
    /// How far the roof bulges above its edge.
    pub(super) crown: f32,
    pub(super) half_width: (f32, f32),
    /// Where posts between the corner posts stand.
    pub(super) posts: &'static [f32],
}

/// Half thickness of a post across and along the body.
const POST: (f32, f32) = (0.03, 0.022);

impl Cabin {
    pub(super) fn build(&self, builder: &mut MeshBuilder) {
        self.glass(builder);
        self.roof(builder);
        for side in [-1.0, 1.0] {
            self.post(builder, (self.foot_x.0, self.roof_x.0), side);
            self.post(builder, (self.foot_x.1, self.roof_x.1), side);
            for x in self.posts {
                self.post(builder, (*x, *x), side);
            }
            self.mirror(builder, side);
        }
    }

    fn foot(&self, x: f32, side: f32) -> Vec3 {
        Vec3::new(x, side * self.half_width.0, self.foot_z)
    }

    fn edge(&self, x: f32, side: f32) -> Vec3 {
        Vec3::new(x, side * self.half_width.1, self.roof_z)
    }

    fn glass(&self, builder: &mut MeshBuilder) {
        let (rear, front) = self.foot_x;
        let (roof_rear, roof_front) = self.roof_x;
        let foot = [
            self.foot(front, 1.0),
            self.foot(rear, 1.0),
            self.foot(rear, -1.0),
            self.foot(front, -1.0),
        ];
        let roof = [
            self.edge(roof_front, 1.0),
            self.edge(roof_rear, 1.0),
            self.edge(roof_rear, -1.0),
            self.edge(roof_front, -1.0),
        ];
        builder.band(&foot, &roof, Material::CarWindow);
    }

    /// A shallow vault over the roof's edges.
    fn roof(&self, builder: &mut MeshBuilder) {
        let (rear, front) = (self.roof_x.0 - 0.02, self.roof_x.1 + 0.02);
        let ring = |x: f32, rise: f32| -> Vec<Vec3> {
            [
                (-1.03, -0.02),
                (1.03, -0.02),
                (1.03, 0.02),
                (0.7, 0.8),
                (0.0, 1.0),
                (-0.7, 0.8),
                (-1.03, 0.02),
            ]
            .map(|(out, up)| {
                Vec3::new(x, out * self.half_width.1, self.roof_z + up * self.crown * rise)
            })
            .to_vec()
        };
        let middle = (rear + front) / 2.0;
        let rings = [
            ring(rear, 0.45),
            ring(rear + 0.08, 0.8),
            ring(middle, 1.0),
            ring(front - 0.08, 0.85),
            ring(front, 0.45),
        ];
        builder.loft(&rings, Material::Paint);
    }

    fn post(&self, builder: &mut MeshBuilder, (foot_x, roof_x): (f32, f32), side: f32) {
        let (out, along) = POST;
        let ring = |centre: Vec3| -> Vec<Vec3> {
            [(-along, -out), (along, -out), (along, out), (-along, out)]
                .map(|(x, y)| centre + Vec3::new(x, y, 0.0))
                .to_vec()
        };
        let inner = Vec3::new(0.0, -0.01 * side, 0.0);
        let (foot, edge) = (self.foot(foot_x, side) + inner, self.edge(roof_x, side) + inner);
        builder.loft(&[ring(foot), ring(edge)], Material::Paint);
    }

    fn mirror(&self, builder: &mut MeshBuilder, side: f32) {
        let x = self.foot_x.1 - 0.16;
        let (a, b) = (side * 0.93, side * 1.08);
        let min = Vec3::new(x, a.min(b), self.foot_z + 0.04);
        builder.cuboid(min, Vec3::new(x + 0.05, a.max(b), self.foot_z + 0.20), Material::Paint);
    }
}

/// A window on both sides of an upright body; `slant` takes its upper front corner back.
pub(super) fn window_band(
    builder: &mut MeshBuilder,
    (rear, front): (f32, f32),
    (low, high): (f32, f32),
    half_width: f32,
    slant: f32,
    material: Material,
) {
    for side in [-1.0, 1.0] {
        let at = |x: f32, z: f32| Vec3::new(x, side * half_width, z);
        let window = [at(rear, low), at(front, low), at(front - slant, high), at(rear, high)];
        let [a, b, c, d] = window;
        builder.quad(if side > 0.0 { [b, a, d, c] } else { window }, material);
    }
}
