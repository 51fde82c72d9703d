//! Shapes of vehicles, for a box from -1 to 1 that is scaled to the vehicle's own.
//!
//! **Frame:** x ahead, y left, z up; -1 is the ground.

use schemas::Vec3;

use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder, ellipse, turned};
use crate::shape::Shape;
use crate::shape::walker::rod;

mod cabin;
mod heavy;
mod hull;
mod two_wheeler;
mod wedge;

pub(crate) use heavy::{bus, truck, van};
pub(crate) use two_wheeler::{bicycle, motorcycle};
pub(crate) use wedge::wedge;

use cabin::Cabin;
use hull::{Station, hull, lamps};

/// Where the lamps at the corners of a body are, in the box from -1 to 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LampPlaces {
    /// Foremost and hindmost ends.
    pub(crate) end_x: [f32; 2],
    /// Heights from which head lamps and tail lamps are measured downwards.
    pub(crate) top_z: [f32; 2],
}

/// `None` for what is no body with lamps at its corners.
pub(crate) fn lamp_places(shape: Shape) -> Option<LampPlaces> {
    let slanted =
        |front_z: f32, rear_z: f32| LampPlaces { end_x: [0.985, -0.99], top_z: [front_z, rear_z] };
    let upright =
        |front_z: f32, rear_z: f32| LampPlaces { end_x: [1.008, -1.008], top_z: [front_z, rear_z] };
    Some(match shape {
        Shape::Sedan => slanted(0.05, 0.16),
        Shape::Coupe => slanted(0.05, 0.14),
        Shape::Hatchback => slanted(0.06, 0.18),
        Shape::OffRoader => slanted(0.08, 0.20),
        Shape::Wedge => slanted(0.02, 0.24),
        Shape::Van => upright(-0.14, -0.10),
        Shape::Truck | Shape::FireEngine => upright(-0.30, -0.42),
        Shape::Bus => upright(-0.45, -0.50),
        _ => return None,
    })
}

/// A car with a boot.
pub(crate) fn sedan() -> Mesh {
    let mut builder = MeshBuilder::default();
    hull(&mut builder, &car_stations(0.26, 0.16, -0.06));
    Cabin {
        foot_x: (-0.74, 0.44),
        roof_x: (-0.46, 0.06),
        foot_z: 0.20,
        roof_z: 0.93,
        crown: 0.06,
        half_width: (0.86, 0.62),
        posts: &[-0.17],
    }
    .build(&mut builder);
    lamps(&mut builder, Shape::Sedan);
    builder.finish()
}

/// A low car with a short cabin.
pub(crate) fn coupe() -> Mesh {
    let mut builder = MeshBuilder::default();
    hull(&mut builder, &car_stations(0.22, 0.14, -0.04));
    Cabin {
        foot_x: (-0.82, 0.34),
        roof_x: (-0.40, -0.06),
        foot_z: 0.16,
        roof_z: 0.92,
        crown: 0.08,
        half_width: (0.84, 0.58),
        posts: &[-0.30],
    }
    .build(&mut builder);
    lamps(&mut builder, Shape::Coupe);
    builder.finish()
}

/// A car that ends behind its rear window.
pub(crate) fn hatchback() -> Mesh {
    let mut builder = MeshBuilder::default();
    hull(&mut builder, &car_stations(0.28, 0.20, -0.04));
    Cabin {
        foot_x: (-0.97, 0.46),
        roof_x: (-0.78, 0.08),
        foot_z: 0.20,
        roof_z: 0.93,
        crown: 0.06,
        half_width: (0.87, 0.66),
        posts: &[-0.55, -0.12],
    }
    .build(&mut builder);
    lamps(&mut builder, Shape::Hatchback);
    builder.finish()
}

/// A tall car with an upright rear.
pub(crate) fn off_roader() -> Mesh {
    let mut builder = MeshBuilder::default();
    hull(&mut builder, &car_stations(0.24, 0.20, 0.06));
    Cabin {
        foot_x: (-0.98, 0.44),
        roof_x: (-0.88, 0.14),
        foot_z: 0.18,
        roof_z: 0.92,
        crown: 0.06,
        half_width: (0.90, 0.74),
        posts: &[-0.55, -0.10],
    }
    .build(&mut builder);
    for y in [-0.62, 0.58] {
        let rail = (Vec3::new(-0.80, y, 0.96), Vec3::new(0.0, y + 0.04, 1.0));
        builder.cuboid(rail.0, rail.1, Material::BlackPlastic);
    }
    lamps(&mut builder, Shape::OffRoader);
    builder.finish()
}

/// The lower body of a car: belt line heights at the rear, in the middle, and above the front axle.
fn car_stations(belt_z: f32, rear_z: f32, bonnet_z: f32) -> [Station; 10] {
    let station =
        |x: f32, low_z: f32, high_z: f32, half_width: f32| Station { x, low_z, high_z, half_width };
    [
        station(-1.0, -0.52, rear_z - 0.16, 0.80),
        station(-0.97, -0.66, rear_z, 0.88),
        station(-0.86, -0.70, rear_z + 0.04, 0.96),
        station(-0.60, -0.72, belt_z, 1.0),
        station(0.0, -0.74, belt_z, 1.0),
        station(0.40, -0.74, belt_z - 0.02, 1.0),
        station(0.50, -0.73, (belt_z + bonnet_z) / 2.0 + 0.10, 0.99),
        station(0.84, -0.70, bonnet_z + 0.06, 0.95),
        station(0.95, -0.66, bonnet_z - 0.04, 0.88),
        station(1.0, -0.56, bonnet_z - 0.18, 0.76),
    ]
}

/// Two coloured lamps side by side on a roof: the right one is an instance's first colour, the left
/// one its third.
pub(crate) fn light_bar() -> Mesh {
    let mut builder = MeshBuilder::default();
    let mut block = |from: f32, to: f32, material: Material| {
        builder.cuboid(Vec3::new(-1.0, from, -1.0), Vec3::new(1.0, to, 1.0), material);
    };
    block(-1.0, -0.2, Material::Paint);
    block(-0.2, 0.2, Material::BlackPlastic);
    block(0.2, 1.0, Material::TailLamp);
    builder.finish()
}

/// A leaf of a door, painted outside (+y) and dark inside.
pub(crate) fn door_panel() -> Mesh {
    let mut builder = MeshBuilder::default();
    builder.cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::repeat(1.0), Material::Paint);
    builder.cuboid(Vec3::repeat(-1.0), Vec3::new(1.0, 0.0, 1.0), Material::BlackPlastic);
    builder.finish()
}

/// A pane in a painted frame.
pub(crate) fn door_window() -> Mesh {
    let mut builder = MeshBuilder::default();
    let mut block = |x: (f32, f32), y: f32, z: (f32, f32), material: Material| {
        builder.cuboid(Vec3::new(x.0, -y, z.0), Vec3::new(x.1, y, z.1), material);
    };
    block((-1.0, 1.0), 0.4, (-1.0, 0.9), Material::CabinGlass);
    block((-1.0, 1.0), 0.8, (0.9, 1.0), Material::Paint);
    for x in [-1.0, 0.9] {
        block((x, x + 0.1), 0.8, (-1.0, 1.0), Material::Paint);
    }
    builder.finish()
}

/// A tyre on a rim of five spokes, around the y axis.
pub(crate) fn wheel() -> Mesh {
    let mut builder = MeshBuilder::default();
    let sides = 18;
    tyre(&mut builder, sides, 0.66);
    for (side, y) in [(1.0f32, 0.90f32), (-1.0, -0.90)] {
        let disc = around_y(y, 0.66, sides, side);
        builder.fan(&disc, Material::BlackPlastic);
        for spoke in 0..5 {
            let angle = std::f32::consts::TAU * spoke as f32 / 5.0;
            let (along, across) = (around(angle), around(angle + std::f32::consts::FRAC_PI_2));
            let lift = Vec3::new(0.0, y + 0.03 * side, 0.0);
            let corners = [(0.0, -0.15), (0.64, -0.10), (0.64, 0.10), (0.0, 0.15)]
                .map(|(out, aside)| lift + along * out + across * aside);
            let [a, b, c, d] = corners;
            let seen_from_outside = if side > 0.0 { [d, c, b, a] } else { [a, b, c, d] };
            builder.quad(seen_from_outside, Material::Rim);
        }
    }
    builder.finish()
}

/// A narrow tyre on a thin rim, around the y axis; see-through in the middle.
pub(crate) fn thin_wheel() -> Mesh {
    let mut builder = MeshBuilder::default();
    tyre(&mut builder, 20, 0.88);
    let (inner, outer) = (around_y(-0.5, 0.86, 20, 1.0), around_y(0.5, 0.86, 20, 1.0));
    builder.band(&outer, &inner, Material::Rim);
    let cross = |angle: f32| around(angle) * 0.87;
    for spoke in 0..6 {
        let angle = std::f32::consts::PI * spoke as f32 / 6.0;
        rod(&mut builder, cross(angle), -cross(angle), 0.012, Material::Rim);
    }
    builder.finish()
}

/// The dark gap around a wheel: a flat disc around the y axis.
pub(crate) fn wheel_arch() -> Mesh {
    let mut builder = MeshBuilder::default();
    builder.fan(&around_y(1.0, 1.0, 18, 1.0), Material::BlackPlastic);
    builder.fan(&around_y(-1.0, 1.0, 18, -1.0), Material::BlackPlastic);
    builder.finish()
}

/// Tread and side walls down to the rim.
fn tyre(builder: &mut MeshBuilder, sides: usize, rim_radius: f32) {
    let profile =
        [(1.0, rim_radius), (1.0, 0.93), (0.8, 1.0), (-0.8, 1.0), (-1.0, 0.93), (-1.0, rim_radius)];
    for ((y, radius), (next_y, next_radius)) in profile.iter().zip(profile.iter().skip(1)) {
        builder.band(
            &around_y(*y, *radius, sides, -1.0),
            &around_y(*next_y, *next_radius, sides, -1.0),
            Material::Tyre,
        );
    }
}

/// A point at distance 1 from the y axis.
fn around(angle: f32) -> Vec3 {
    let [cos, sin] = turned(angle);
    Vec3::new(cos, 0.0, sin)
}

/// A circle around the y axis, counter-clockwise seen from +y for `facing` 1, from -y for -1.
fn around_y(y: f32, radius: f32, sides: usize, facing: f32) -> Vec<Vec3> {
    let ring = ellipse(Vec3::zeros(), radius, radius, sides);
    ring.iter().map(|point| Vec3::new(-facing * point.y, y, point.z)).collect()
}
