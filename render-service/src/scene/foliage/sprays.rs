//! Sprays of leaves that stand out of a crown.

use std::f32::consts::TAU;

use schemas::Vec3;

use super::{Corner, Crown, OUTER, SHADES, mixed, scrambled};

/// How many sprays a crown has, and how long they are for its mean half axis.
pub(super) struct Spread {
    count: u32,
    length: f32,
}

/// Near the viewer.
pub(super) const MANY: Spread = Spread { count: 140, length: 0.27 };
/// Farther away.
pub(super) const FEW: Spread = Spread { count: 40, length: 0.48 };

/// Turn from one place of a lattice of Fibonacci to the next one.
const GOLDEN_RAD: f32 = 2.399_963;

/// Of the corners of a spray: base, right, tip, left.
pub(super) const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

/// The corners of each spray and how dark it is. None turns its back outwards.
pub(super) fn on(
    crown: &Crown,
    Spread { count, length }: &Spread,
) -> impl Iterator<Item = ([Corner; 4], u8)> {
    let places = crown.triangles.iter().flatten().map(|(place, _)| place - crown.middle);
    let half_m = places.fold(Vec3::repeat(1e-3), |half, place| half.sup(&place.abs()));
    let length_m = length * half_m.sum() / 3.0;
    (0..*count).map(move |at| {
        let way = lattice(at, *count);
        let chance = |draw: u32| scrambled(mixed(crown.label, 8 * at + draw));
        let root = crown.middle + way.component_mul(&half_m) * (0.84 + 0.12 * chance(0));
        let outward = way.component_div(&half_m).try_normalize(1e-6).unwrap_or(way);
        let length_m = length_m * (0.75 + 0.5 * chance(1));
        let lift = 0.25 + 0.45 * chance(2);
        let shade = OUTER + (chance(4) * (f32::from(SHADES - OUTER) - 0.001)) as u8;
        (folded(&root, &outward, (chance(3) * TAU, lift, length_m)), shade)
    })
}

/// A direction of so many that are evenly spread.
fn lattice(at: u32, count: u32) -> Vec3 {
    let z = 1.0 - (2 * at + 1) as f32 / count as f32;
    let (sin, cos) = (at as f32 * GOLDEN_RAD).sin_cos();
    let ring = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(ring * cos, ring * sin, z)
}

/// The corners of a spray that grows from a root, turned about the way outward, with its tip lifted
/// by a share of its length, and folded along its middle.
fn folded(root: &Vec3, outward: &Vec3, (turn_rad, lift, length_m): (f32, f32, f32)) -> [Corner; 4] {
    let upright = if outward.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
    let level = upright.cross(outward).normalize();
    let (sin, cos) = turn_rad.sin_cos();
    let along = level * cos + outward.cross(&level) * sin;
    let across = outward.cross(&along);
    let tip = root + (along * 0.75 + outward * lift) * length_m;
    let side = |sign: f32| root + (along * 0.3 + across * (0.45 * sign)) * length_m;
    let base = root - along * (0.25 * length_m);
    // The sides hang below the middle of the spray, which leans back by its lift.
    let leaning = outward - along * lift;
    [
        (base, leaning),
        (side(-1.0), leaning - across * 0.8),
        (tip, leaning),
        (side(1.0), leaning + across * 0.8),
    ]
    .map(|(place, normal)| (place, normal.normalize()))
}
