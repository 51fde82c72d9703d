//! Shapes of people, in heights of the person.
//!
//! **Frame:** x ahead, y left, z up. Torso and head stand on the ground at z = 0; limbs hang down
//! from the joint at the origin.

use schemas::Vec3;

use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder, turned};

/// (height, half depth, half width, middle's offset ahead)
type Ring = (f32, f32, f32, f32);

/// Hips, trunk, neck.
pub(crate) fn torso() -> Mesh {
    let mut builder = MeshBuilder::default();
    rings(
        &mut builder,
        &[(0.455, 0.060, 0.090, 0.0), (0.50, 0.068, 0.100, 0.0), (0.56, 0.064, 0.094, 0.0)],
        Material::Trousers,
        false,
    );
    rings(
        &mut builder,
        &[
            (0.545, 0.068, 0.097, 0.0),
            (0.62, 0.062, 0.092, 0.002),
            (0.70, 0.070, 0.106, 0.004),
            (0.77, 0.068, 0.122, 0.002),
            (0.81, 0.055, 0.118, 0.0),
            (0.832, 0.036, 0.066, 0.0),
        ],
        Material::Shirt,
        true,
    );
    rings(
        &mut builder,
        &[(0.82, 0.030, 0.030, 0.0), (0.88, 0.028, 0.028, 0.006)],
        Material::Skin,
        false,
    );
    builder.finish()
}

/// Face and short hair.
pub(crate) fn head() -> Mesh {
    let mut builder = MeshBuilder::default();
    let face = [
        (0.862, 0.020, 0.018, 0.014),
        (0.872, 0.040, 0.032, 0.010),
        (0.900, 0.050, 0.043, 0.006),
        (0.935, 0.053, 0.046, 0.004),
        (0.965, 0.050, 0.043, 0.000),
        (0.985, 0.036, 0.030, -0.002),
        (0.993, 0.012, 0.010, -0.002),
    ];
    rings(&mut builder, &face, Material::Skin, true);
    let hair = [
        (0.925, 0.046, 0.049, -0.014),
        (0.955, 0.053, 0.049, -0.007),
        (0.978, 0.050, 0.043, -0.004),
        (0.995, 0.034, 0.028, -0.004),
        (1.0, 0.010, 0.008, -0.004),
    ];
    rings(&mut builder, &hair, Material::Hair, true);
    builder.cuboid(Vec3::new(0.050, -0.008, 0.905), Vec3::new(0.064, 0.008, 0.925), Material::Skin);
    builder.finish()
}

/// Hair down to the shoulders.
pub(crate) fn long_hair() -> Mesh {
    let mut builder = MeshBuilder::default();
    let hair = [
        (0.815, 0.020, 0.050, -0.048),
        (0.86, 0.026, 0.055, -0.042),
        (0.93, 0.038, 0.053, -0.024),
        (0.985, 0.036, 0.042, -0.010),
    ];
    rings(&mut builder, &hair, Material::Hair, true);
    builder.finish()
}

/// A leg and its shoe, from the hip.
pub(crate) fn leg() -> Mesh {
    let mut builder = MeshBuilder::default();
    let trousers = [
        (-0.470, 0.027, 0.024, -0.004),
        (-0.36, 0.036, 0.032, -0.006),
        (-0.26, 0.038, 0.036, 0.0),
        (-0.10, 0.054, 0.046, 0.0),
        (0.02, 0.056, 0.046, 0.0),
    ];
    rings(&mut builder, &trousers, Material::Trousers, true);
    shoe(&mut builder, -0.50);
    builder.finish()
}

/// A shoe whose sole is at a height.
fn shoe(builder: &mut MeshBuilder, sole_z: f32) {
    let ring = |up: f32, toe: f32, half: f32| {
        let z = sole_z + up;
        vec![
            Vec3::new(toe, half * 0.7, z),
            Vec3::new(0.01, half, z),
            Vec3::new(-0.035, half * 0.8, z),
            Vec3::new(-0.035, -half * 0.8, z),
            Vec3::new(0.01, -half, z),
            Vec3::new(toe, -half * 0.7, z),
        ]
    };
    let rings = [ring(0.0, 0.112, 0.029), ring(0.022, 0.108, 0.029), ring(0.048, 0.03, 0.026)];
    builder.loft(&rings, Material::Shoe);
}

/// A sleeve and its hand, from the shoulder.
pub(crate) fn arm() -> Mesh {
    let mut builder = MeshBuilder::default();
    let sleeve = [
        (-0.30, 0.022, 0.020, 0.016),
        (-0.20, 0.026, 0.024, 0.006),
        (-0.16, 0.027, 0.026, 0.0),
        (-0.04, 0.033, 0.029, 0.0),
        (0.012, 0.027, 0.022, 0.0),
    ];
    rings(&mut builder, &sleeve, Material::Shirt, true);
    let hand = [
        (-0.375, 0.012, 0.008, 0.028),
        (-0.345, 0.024, 0.013, 0.024),
        (-0.30, 0.018, 0.015, 0.018),
    ];
    rings(&mut builder, &hand, Material::Skin, true);
    builder.finish()
}

/// A sleeve from the shoulder to the elbow.
pub(crate) fn upper_arm() -> Mesh {
    let mut builder = MeshBuilder::default();
    let sleeve = [
        (-0.178, 0.020, 0.020, 0.0),
        (-0.165, 0.027, 0.026, 0.0),
        (-0.04, 0.033, 0.029, 0.0),
        (0.012, 0.027, 0.022, 0.0),
    ];
    rings(&mut builder, &sleeve, Material::Shirt, true);
    builder.finish()
}

/// A sleeve and its hand, from the elbow.
pub(crate) fn forearm() -> Mesh {
    let mut builder = MeshBuilder::default();
    let sleeve = [
        (-0.135, 0.022, 0.020, 0.016),
        (-0.035, 0.026, 0.024, 0.006),
        (0.005, 0.027, 0.026, 0.0),
        (0.014, 0.018, 0.018, 0.0),
    ];
    rings(&mut builder, &sleeve, Material::Shirt, true);
    let hand =
        [(-0.21, 0.012, 0.008, 0.028), (-0.18, 0.024, 0.013, 0.024), (-0.135, 0.018, 0.015, 0.018)];
    rings(&mut builder, &hand, Material::Skin, true);
    builder.finish()
}

/// A leg from the hip to the knee.
pub(crate) fn thigh() -> Mesh {
    let mut builder = MeshBuilder::default();
    let trousers = [
        (-0.268, 0.026, 0.026, 0.0),
        (-0.25, 0.039, 0.037, 0.0),
        (-0.10, 0.054, 0.046, 0.0),
        (0.02, 0.056, 0.046, 0.0),
    ];
    rings(&mut builder, &trousers, Material::Trousers, true);
    builder.finish()
}

/// A leg and its shoe, from the knee.
pub(crate) fn shin() -> Mesh {
    let mut builder = MeshBuilder::default();
    let trousers = [
        (-0.22, 0.027, 0.024, -0.004),
        (-0.11, 0.036, 0.032, -0.006),
        (-0.005, 0.038, 0.036, 0.0),
        (0.016, 0.026, 0.026, 0.0),
    ];
    rings(&mut builder, &trousers, Material::Trousers, true);
    shoe(&mut builder, -0.25);
    builder.finish()
}

/// A bag on the back.
pub(crate) fn backpack() -> Mesh {
    let mut builder = MeshBuilder::default();
    let bag = [
        (0.58, 0.035, 0.070, -0.098),
        (0.62, 0.050, 0.082, -0.104),
        (0.74, 0.046, 0.080, -0.100),
        (0.80, 0.026, 0.062, -0.088),
    ];
    rings(&mut builder, &bag, Material::Hair, true);
    builder.finish()
}

/// A person on two wheels, in heights of the person from the saddle: legs ahead, leaning a little.
pub(crate) fn rider() -> Mesh {
    let mut builder = MeshBuilder::default();
    let trunk = [
        (-0.03, 0.068, 0.098, 0.0),
        (0.08, 0.064, 0.094, 0.02),
        (0.20, 0.068, 0.112, 0.06),
        (0.29, 0.060, 0.120, 0.09),
        (0.325, 0.034, 0.060, 0.10),
    ];
    rings(&mut builder, &trunk, Material::Shirt, true);
    let helmet = [
        (0.345, 0.026, 0.024, 0.12),
        (0.37, 0.056, 0.050, 0.125),
        (0.42, 0.066, 0.056, 0.125),
        (0.465, 0.050, 0.044, 0.12),
        (0.482, 0.015, 0.014, 0.12),
    ];
    rings(&mut builder, &helmet, Material::Hair, true);
    for side in [-1.0, 1.0] {
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, side * y, z);
        rod(&mut builder, at(0.0, 0.05, 0.0), at(0.20, 0.075, -0.10), 0.042, Material::Trousers);
        rod(
            &mut builder,
            at(0.20, 0.075, -0.10),
            at(0.12, 0.065, -0.32),
            0.032,
            Material::Trousers,
        );
        rod(&mut builder, at(0.10, 0.065, -0.33), at(0.20, 0.065, -0.34), 0.026, Material::Shoe);
        rod(&mut builder, at(0.09, 0.12, 0.28), at(0.20, 0.16, 0.13), 0.026, Material::Shirt);
        rod(&mut builder, at(0.20, 0.16, 0.13), at(0.33, 0.14, 0.12), 0.021, Material::Skin);
    }
    builder.finish()
}

/// A six-sided rod between two points.
pub(crate) fn rod(
    builder: &mut MeshBuilder,
    from: Vec3,
    to: Vec3,
    radius: f32,
    material: Material,
) {
    let axis = (to - from).try_normalize(1e-6).unwrap_or_else(Vec3::x);
    let helper = if axis.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
    let u = axis.cross(&helper).try_normalize(1e-6).unwrap_or_else(Vec3::y);
    let v = axis.cross(&u);
    let ring = |centre: Vec3| -> Vec<Vec3> {
        (0..6)
            .map(|at| {
                let angle = std::f32::consts::TAU * at as f32 / 6.0;
                let [cos, sin] = turned(angle);
                centre + (u * cos + v * sin) * radius
            })
            .collect()
    };
    builder.loft(&[ring(from), ring(to)], material);
}

/// A skin over upright rings from the lowest to the highest, with lids if `closed`.
fn rings(builder: &mut MeshBuilder, of: &[Ring], material: Material, closed: bool) {
    let rings: Vec<Vec<Vec3>> = of
        .iter()
        .map(|(z, half_depth, half_width, ahead)| {
            (0..10)
                .map(|at| {
                    let angle = std::f32::consts::TAU * at as f32 / 10.0;
                    let [cos, sin] = turned(angle);
                    Vec3::new(ahead + half_depth * cos, half_width * sin, *z)
                })
                .collect()
        })
        .collect();
    if closed {
        builder.loft(&rings, material);
    } else {
        for (ring, next) in rings.iter().zip(rings.iter().skip(1)) {
            builder.band(ring, next, material);
        }
    }
}
