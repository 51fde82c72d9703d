//! Vans, trucks, buses.

use schemas::Vec3;

use super::cabin::window_band;
use super::hull::{Station, hull, lamps};
use crate::material::Material;
use crate::mesh::{Mesh, MeshBuilder};
use crate::shape::Shape;

/// A closed van.
pub(crate) fn van() -> Mesh {
    let mut builder = MeshBuilder::default();
    let station =
        |x: f32, low_z: f32, high_z: f32, half_width: f32| Station { x, low_z, high_z, half_width };
    hull(
        &mut builder,
        &[
            station(-1.0, -0.72, 0.92, 0.94),
            station(-0.97, -0.78, 0.97, 0.98),
            station(0.10, -0.80, 1.0, 1.0),
            station(0.40, -0.80, 0.96, 1.0),
            station(0.52, -0.80, 0.82, 1.0),
            station(0.78, -0.79, 0.02, 0.99),
            station(0.95, -0.76, -0.10, 0.92),
            station(1.0, -0.70, -0.24, 0.82),
        ],
    );
    // The windscreen lies on the slope between bonnet and roof.
    let screen = |x: f32, y: f32, z: f32| Vec3::new(x + 0.012, y, z + 0.006);
    builder.quad(
        [
            screen(0.775, -0.84, 0.05),
            screen(0.775, 0.84, 0.05),
            screen(0.53, 0.80, 0.80),
            screen(0.53, -0.80, 0.80),
        ],
        Material::VanWindow,
    );
    window_band(&mut builder, (0.20, 0.70), (0.12, 0.72), 1.004, 0.30, Material::VanWindow);
    for y in [-0.82, 0.06] {
        back_window(&mut builder, (y, y + 0.76), (0.18, 0.74), Material::VanWindow);
    }
    lamps(&mut builder, Shape::Van);
    builder.finish()
}

/// A cab and a box of a material.
pub(crate) fn truck(box_material: Material) -> Mesh {
    let mut builder = MeshBuilder::default();
    builder.cuboid(
        Vec3::new(-1.0, -0.50, -0.66),
        Vec3::new(0.62, 0.50, -0.52),
        Material::BlackPlastic,
    );
    builder.cuboid(Vec3::new(-1.0, -1.0, -0.50), Vec3::new(0.42, 1.0, 1.0), box_material);
    builder.cuboid(Vec3::new(-1.0, -1.003, -0.50), Vec3::new(0.42, 1.003, -0.42), Material::Chrome);
    let station =
        |x: f32, low_z: f32, high_z: f32, half_width: f32| Station { x, low_z, high_z, half_width };
    hull(
        &mut builder,
        &[
            station(0.46, -0.70, 0.66, 0.95),
            station(0.80, -0.74, 0.70, 0.97),
            station(0.90, -0.76, 0.60, 0.97),
            station(0.98, -0.78, -0.02, 0.96),
            station(1.0, -0.74, -0.20, 0.92),
        ],
    );
    let screen = |x: f32, y: f32, z: f32| Vec3::new(x + 0.012, y, z);
    builder.quad(
        [
            screen(0.975, -0.84, 0.03),
            screen(0.975, 0.84, 0.03),
            screen(0.90, 0.82, 0.56),
            screen(0.90, -0.82, 0.56),
        ],
        Material::TruckWindow,
    );
    window_band(&mut builder, (0.58, 0.88), (0.06, 0.52), 0.978, 0.06, Material::TruckWindow);
    lamps(&mut builder, Shape::Truck);
    builder.finish()
}

/// A city bus.
pub(crate) fn bus() -> Mesh {
    let mut builder = MeshBuilder::default();
    let station =
        |x: f32, low_z: f32, high_z: f32, half_width: f32| Station { x, low_z, high_z, half_width };
    hull(
        &mut builder,
        &[
            station(-1.0, -0.78, 0.88, 0.95),
            station(-0.985, -0.82, 0.96, 1.0),
            station(-0.90, -0.83, 1.0, 1.0),
            station(0.90, -0.83, 1.0, 1.0),
            station(0.985, -0.82, 0.95, 1.0),
            station(1.0, -0.78, 0.86, 0.95),
        ],
    );
    for at in 0..7 {
        let x = -0.92 + 0.262 * at as f32;
        window_band(&mut builder, (x, x + 0.24), (-0.05, 0.66), 1.004, 0.0, Material::BusWindow);
    }
    let front = |y: f32, z: f32| Vec3::new(1.012, y, z);
    let screen = [front(-0.88, -0.22), front(0.88, -0.22), front(0.86, 0.66), front(-0.86, 0.66)];
    builder.quad(screen, Material::BusWindow);
    back_window(&mut builder, (-0.8, 0.8), (0.1, 0.66), Material::BusWindow);
    lamps(&mut builder, Shape::Bus);
    builder.finish()
}

fn back_window(
    builder: &mut MeshBuilder,
    (right, left): (f32, f32),
    (low, high): (f32, f32),
    material: Material,
) {
    let at = |y: f32, z: f32| Vec3::new(-1.012, y, z);
    builder.quad([at(left, low), at(right, low), at(right, high), at(left, high)], material);
}
