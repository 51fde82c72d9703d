//! The painted lower body of a vehicle, and its lamps.

use schemas::Vec3;

use super::lamp_places;
use crate::material::Material;
use crate::mesh::MeshBuilder;
use crate::shape::Shape;

/// A cut through the body at one place of its length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    pub(super) x: f32,
    pub(super) low_z: f32,
    pub(super) high_z: f32,
    pub(super) half_width: f32,
}

impl Station {
    /// Counter-clockwise seen from ahead: sill, bulge, shoulder, deck, and back.
    fn ring(&self) -> Vec<Vec3> {
        let height = self.high_z - self.low_z;
        let left =
            [(0.0, 0.84), (0.08, 0.95), (0.50, 1.0), (0.86, 0.965), (0.97, 0.90), (1.0, 0.80)];
        let point =
            |up: f32, out: f32| Vec3::new(self.x, out * self.half_width, self.low_z + up * height);
        let right = left.iter().rev().map(|(up, out)| point(*up, -out));
        left.iter().map(|(up, out)| point(*up, *out)).chain(right).collect()
    }
}

/// A body through all stations from the rear to the front, with dark sills.
pub(super) fn hull(builder: &mut MeshBuilder, stations: &[Station]) {
    let rings: Vec<Vec<Vec3>> = stations.iter().map(Station::ring).collect();
    builder.loft(&rings, Material::Paint);
    for (from, to) in stations.iter().zip(stations.iter().skip(1)) {
        for side in [-1.0f32, 1.0] {
            let sill = |station: &Station, up: f32, out: f32| {
                Vec3::new(station.x, side * station.half_width * out, station.low_z + up)
            };
            // Up the sill, then back to the hull, or one could look down behind it.
            let edges = [(-0.01, 0.96), (0.09, 1.0), (0.12, 0.94)];
            for (low, high) in edges.iter().zip(edges.iter().skip(1)) {
                let strip = [
                    sill(from, low.0, low.1),
                    sill(to, low.0, low.1),
                    sill(to, high.0, high.1),
                    sill(from, high.0, high.1),
                ];
                let [a, b, c, d] = strip;
                builder.quad(if side > 0.0 { [b, a, d, c] } else { strip }, Material::BlackPlastic);
            }
        }
    }
}

/// Head and tail lamps, grille, bumpers and plates at the ends of a body.
pub(super) fn lamps(builder: &mut MeshBuilder, body: Shape) {
    let Some(places) = lamp_places(body) else { return };
    let ([front_x, rear_x], [front_z, rear_z]) = (places.end_x, places.top_z);
    let mut block = |x: (f32, f32), y: (f32, f32), z: (f32, f32), material: Material| {
        builder.cuboid(Vec3::new(x.0, y.0, z.0), Vec3::new(x.1, y.1, z.1), material);
    };
    for side in [-1.0f32, 1.0] {
        let across = |inner: f32, outer: f32| {
            let (a, b) = (side * inner, side * outer);
            (a.min(b), a.max(b))
        };
        block(
            (0.90, front_x),
            across(0.50, 0.86),
            (front_z - 0.26, front_z - 0.10),
            Material::HeadLamp,
        );
        block(
            (rear_x, -0.90),
            across(0.58, 0.90),
            (rear_z - 0.22, rear_z - 0.02),
            Material::TailLamp,
        );
    }
    block((0.95, 1.005), (-0.42, 0.42), (front_z - 0.32, front_z - 0.14), Material::BlackPlastic);
    block((0.93, 1.01), (-0.66, 0.66), (-0.66, -0.48), Material::BlackPlastic);
    block((-1.01, -0.93), (-0.70, 0.70), (-0.66, -0.46), Material::BlackPlastic);
    block((1.0, 1.015), (-0.22, 0.22), (-0.46, -0.36), Material::Plate);
    block((-1.015, -0.98), (-0.24, 0.24), (rear_z - 0.36, rear_z - 0.24), Material::Plate);
}
